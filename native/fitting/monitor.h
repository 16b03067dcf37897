// What a long computation tells while it runs, and how it is stopped.
#pragma once

#include <atomic>
#include <exception>

namespace lobefit {

// Thrown out of a computation that was cancelled.
struct Cancelled : std::exception {
  const char* what() const noexcept override { return "cancelled"; }
};

// Shared between the thread that computes and the one that watches.
class Monitor {
 public:
  void cancel() { cancelled_ = true; }
  bool cancelled() const { return cancelled_; }
  void throw_if_cancelled() const {
    if (cancelled_) throw Cancelled();
  }

  // `stage` must be a literal; progress runs from 0 to 1 over the whole computation.
  void report(const char* stage, double progress) {
    stage_ = stage;
    progress_ = progress;
  }
  const char* stage() const { return stage_; }
  double progress() const { return progress_; }

 private:
  std::atomic<bool> cancelled_ = false;
  std::atomic<const char*> stage_ = "";
  std::atomic<double> progress_ = 0;
};

}  // namespace lobefit
