#include "fitting/job.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "fitting/fit.h"
#include "reflectance/abc.h"

namespace lobefit {
namespace {

using namespace std::chrono_literals;

// Work that ends only when it is cancelled.
int until_cancelled(Monitor& monitor) {
  for (;;) {
    monitor.throw_if_cancelled();
    std::this_thread::sleep_for(1ms);
  }
}

TEST(Job, GivesItsResult) {
  Job<int> job([](Monitor&) { return 7; });
  ASSERT_TRUE(job.wait(10s));
  EXPECT_EQ(job.result(), 7);
  EXPECT_EQ(job.progress(), 1);
}

TEST(Job, TellsWhatItDoes) {
  std::atomic<bool> go = false;
  Job<int> job([&](Monitor& monitor) {
    monitor.report("Reading", 0.25);
    go = true;
    return until_cancelled(monitor);
  });
  while (!go) std::this_thread::yield();
  EXPECT_STREQ(job.stage(), "Reading");
  EXPECT_EQ(job.progress(), 0.25);
  EXPECT_FALSE(job.done());
  EXPECT_THROW(job.result(), std::logic_error);
}

TEST(Job, ThrowsWhatEndedIt) {
  Job<int> failing([](Monitor&) -> int { throw std::runtime_error("no"); });
  ASSERT_TRUE(failing.wait(10s));
  EXPECT_THROW(failing.result(), std::runtime_error);
  Job<int> cancelled(until_cancelled);
  EXPECT_FALSE(cancelled.wait(1ms));
  cancelled.cancel();
  ASSERT_TRUE(cancelled.wait(10s));
  EXPECT_THROW(cancelled.result(), Cancelled);
}

TEST(Job, IsCancelledAndJoinedByItsDestructor) {
  std::atomic<bool> ended = false;
  {
    const Job<int> job([&](Monitor& monitor) {
      try {
        return until_cancelled(monitor);
      } catch (const Cancelled&) {
        ended = true;
        throw;
      }
    });
  }
  EXPECT_TRUE(ended);
}

TEST(Job, OfAFitStopsSoonAfterItIsCancelled) {
  const Measurement sample = sample_measurement("nickel");
  Job<Fit> job([&](Monitor& monitor) { return fit_model(sample, {}, monitor); });
  job.wait(50ms);
  job.cancel();
  // One pass over the data, or the laying out of samples, is what a cancel can wait for.
  ASSERT_TRUE(job.wait(20s));
  EXPECT_THROW(job.result(), Cancelled);
}

// What a window does: it asks again and again, and may be closed at any moment.
TEST(Job, MayBeWatchedCancelledAndDestroyedAtAnyMoment) {
  const Measurement sample = sample_measurement("nickel");
  for (int polls = 0; polls < 12; ++polls) {
    Job<Fit> job([&](Monitor& monitor) { return fit_model(sample, {}, monitor); });
    for (int i = 0; i < polls && !job.wait(5ms); ++i) {
      EXPECT_NE(job.stage(), nullptr);
      EXPECT_GE(job.progress(), 0);
      EXPECT_LE(job.progress(), 1);
    }
    if (polls % 2) job.cancel();
  }
}

// As where Python quits with a job in a global variable.
TEST(JobDeathTest, IsJoinedWhenTheProgramEnds) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto quit = [] {
    static const Job<int> job(until_cancelled);
    std::exit(0);
  };
  EXPECT_EXIT(quit(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace lobefit
