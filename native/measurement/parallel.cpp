#include "measurement/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>

namespace lobefit {
namespace {

// The crew of this thread that is free.
thread_local Crew* free_crew = nullptr;

// Starts up to `count` threads, or as many as the system gives.
std::vector<std::jthread> start_threads(int count, const std::function<void()>& work) {
  std::vector<std::jthread> threads;
  try {
    for (int t = 0; t < count; ++t) threads.emplace_back(work);
  } catch (const std::system_error&) {
    // Those that are there do the work.
  }
  return threads;
}

}  // namespace

int thread_count(int asked) {
  if (asked > 0) return asked;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(int count, int threads, const std::function<void(int)>& work) {
  std::atomic<int> next = 0;
  std::exception_ptr failure;
  std::mutex failure_guard;
  const auto take_work = [&] {
    try {
      for (int i = next++; i < count; i = next++) work(i);
    } catch (...) {
      const std::lock_guard lock(failure_guard);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  const int helpers = std::min(threads, count) - 1;
  if (helpers > 0 && free_crew) {
    free_crew->run(helpers, take_work);
  } else {
    const std::vector<std::jthread> started = start_threads(helpers, take_work);
    take_work();
  }
  if (failure) std::rethrow_exception(failure);
}

Crew::Crew(int threads)
    : outer_(free_crew), helpers_(start_threads(threads - 1, [this] { wait_for_work(); })) {
  free_crew = this;
}

Crew::~Crew() {
  free_crew = outer_;
  const std::lock_guard lock(guard_);
  over_ = true;
  begins_.notify_all();
}

void Crew::run(int helpers, const std::function<void()>& work) {
  free_crew = nullptr;
  {
    const std::lock_guard lock(guard_);
    work_ = &work;
    places_ = helpers;
  }
  begins_.notify_all();
  work();
  std::unique_lock lock(guard_);
  places_ = 0;  // who wakes only now has nothing to do
  ends_.wait(lock, [&] { return inside_ == 0; });
  free_crew = this;
}

void Crew::wait_for_work() {
  std::unique_lock lock(guard_);
  while (true) {
    begins_.wait(lock, [&] { return over_ || places_ > 0; });
    if (over_) return;
    --places_;
    ++inside_;
    const std::function<void()>& work = *work_;
    lock.unlock();
    work();
    lock.lock();
    if (--inside_ == 0) ends_.notify_one();
  }
}

}  // namespace lobefit
