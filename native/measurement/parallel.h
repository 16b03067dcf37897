// Work shared between threads.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace lobefit {

// The number of threads that `asked` stands for: itself, or for 0 what the machine has.
int thread_count(int asked);

// Calls work(0) .. work(count - 1), each once, on up to `threads` threads, the caller's among
// them, or as many as the system gives, and returns when all are done. An exception of any of them
// is thrown on.
void parallel_for(int count, int threads, const std::function<void(int)>& work);

// Threads that, as long as it lives, wait for the parallel_for of the thread that made it, which
// else starts threads of its own each time: that takes .1 ms, as long as a pass over a subsample.
// What is called while they are at work, or from one of them, starts its own.
class Crew {
 public:
  // With the caller up to `threads`, or as many as the system gives.
  explicit Crew(int threads);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

 private:
  friend void parallel_for(int, int, const std::function<void(int)>&);
  // Calls work on this thread and up to `helpers` more, and returns when all of them have.
  void run(int helpers, const std::function<void()>& work);
  void wait_for_work();

  Crew* const outer_;  // the one of this thread before
  std::mutex guard_;
  std::condition_variable begins_, ends_;
  const std::function<void()>* work_ = nullptr;
  int places_ = 0, inside_ = 0;  // free for helpers, and taken
  bool over_ = false;
  std::vector<std::jthread> helpers_;  // last, so that everything they use outlives them
};

}  // namespace lobefit
