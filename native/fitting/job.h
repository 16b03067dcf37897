// A computation in a thread of its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "fitting/monitor.h"

namespace lobefit {

// The thread starts with the object and is joined by its destructor, which cancels it first. Where
// the system gives no thread, for want of memory as a rule, std::bad_alloc is thrown.
template <typename Result>
class Job {
 public:
  explicit Job(std::function<Result(Monitor&)> work)
      : work_(std::move(work)), thread_(started([this] { run(); })) {}
  ~Job() { monitor_.cancel(); }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  double progress() const { return done() ? 1 : monitor_.progress(); }
  const char* stage() const { return monitor_.stage(); }
  void cancel() { monitor_.cancel(); }

  bool done() const {
    const std::lock_guard lock(guard_);
    return done_;
  }

  // Waits up to that long; true when the job is done.
  bool wait(std::chrono::duration<double> at_most) const {
    std::unique_lock lock(guard_);
    return finished_.wait_for(lock, at_most, [this] { return done_; });
  }

  // Of a job that is done. Throws what ended it: InputError, Cancelled or another exception.
  const Result& result() const {
    if (!done()) throw std::logic_error("the job is not done");
    if (failure_) std::rethrow_exception(failure_);
    return *result_;
  }

 private:
  static std::jthread started(std::function<void()> work) {
    try {
      return std::jthread(std::move(work));
    } catch (const std::system_error&) {
      throw std::bad_alloc();
    }
  }

  void run() {
    try {
      result_ = work_(monitor_);
    } catch (...) {
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(guard_);
    done_ = true;
    finished_.notify_all();
  }

  const std::function<Result(Monitor&)> work_;
  Monitor monitor_;
  mutable std::mutex guard_;
  mutable std::condition_variable finished_;
  bool done_ = false;
  std::exception_ptr failure_;
  std::optional<Result> result_;
  std::jthread thread_;  // last, so that everything it uses outlives it
};

}  // namespace lobefit
