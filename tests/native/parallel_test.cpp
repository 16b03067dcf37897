#include "measurement/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace lobefit {
namespace {

// How often parallel_for did each of so many pieces of work.
std::vector<int> times_done(int count, int threads) {
  std::vector<std::atomic<int>> done(static_cast<std::size_t>(count));
  parallel_for(count, threads, [&](int i) { ++done[static_cast<std::size_t>(i)]; });
  return {done.begin(), done.end()};
}

const std::vector<int> once(50, 1);

TEST(Parallel, EachPieceOfWorkIsDoneOnce) {
  for (const int threads : {0, 1, 2, 7, 100}) EXPECT_EQ(times_done(50, threads), once) << threads;
  EXPECT_TRUE(times_done(0, 2).empty());
}

// Over and over, because helpers that wake too late must not take from work that is over.
TEST(Parallel, ACrewDoesEachPieceOfWorkOnce) {
  for (const int helpers : {1, 2, 5}) {
    const Crew crew(helpers);
    for (int round = 0; round < 500; ++round) {
      ASSERT_EQ(times_done(50, 1 + round % 4), once) << helpers << ' ' << round;
    }
  }
  EXPECT_EQ(times_done(50, 2), once);
}

TEST(Parallel, ACrewKeepsItsThreads) {
  const Crew crew(2);
  std::atomic<int> waiting = 0;
  std::thread::id first, second;
  // Both pieces wait for each other, so that a thread of its own does each.
  const auto meet = [&](std::thread::id& helper) {
    waiting = 0;
    parallel_for(2, 2, [&, caller = std::this_thread::get_id()](int) {
      ++waiting;
      while (waiting < 2) std::this_thread::yield();
      if (std::this_thread::get_id() != caller) helper = std::this_thread::get_id();
    });
  };
  meet(first);
  meet(second);
  EXPECT_EQ(first, second);
  EXPECT_NE(first, std::thread::id());
}

TEST(Parallel, WorkWithinWorkIsDone) {
  const Crew crew(3);
  std::atomic<int> done = 0;
  parallel_for(4, 3, [&](int) { parallel_for(5, 2, [&](int) { ++done; }); });
  EXPECT_EQ(done, 20);
}

TEST(Parallel, ACrewWithinACrewGivesWayToTheOuterOne) {
  const Crew outer(2);
  {
    const Crew inner(3);
    EXPECT_EQ(times_done(50, 3), once);
  }
  EXPECT_EQ(times_done(50, 2), once);
}

TEST(Parallel, AnotherThreadHasNoneOfTheCrew) {
  const Crew crew(2);
  std::thread([] { EXPECT_EQ(times_done(50, 2), once); }).join();
}

TEST(Parallel, AnExceptionIsThrownOn) {
  const auto message = [](int threads) {
    try {
      parallel_for(50, threads, [](int i) {
        if (i == 20) throw std::runtime_error("the twentieth");
      });
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(1), "the twentieth");
  EXPECT_EQ(message(2), "the twentieth");
  const Crew crew(2);
  EXPECT_EQ(message(2), "the twentieth");
  EXPECT_EQ(times_done(50, 2), once);
}

}  // namespace
}  // namespace lobefit
