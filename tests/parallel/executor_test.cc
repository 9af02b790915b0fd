#include "gamer/parallel/executor.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "gamer/core/error.h"
#include "parallel/checks.h"

namespace gamer::executor_test {
namespace {

using std::chrono::milliseconds;

class EveryRowOnce : public testing::TestWithParam<int> {};

TEST_P(EveryRowOnce, ArrivesWithItsValues) {
  const int threads = GetParam();
  for (const int rows : {0, 1, 2, 5, 16, 101}) {
    for (const int block : {1, 2, 3, 16, 1000}) {
      SCOPED_TRACE(std::to_string(rows) + " rows in blocks of " + std::to_string(block));
      ThreadExecutor executor(threads);
      EXPECT_EQ(executor.workers(), threads);
      for (const std::size_t width : {0u, 1u, 7u}) {
        RowCheck check(even_blocks(rows, block), width);
        executor.run(check.blocks(), width, check.compute(), check.consume());
        check.expect_all_consumed();
        EXPECT_EQ(check.computed(), rows);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, EveryRowOnce, testing::Values(1, 2, 3, 8));

TEST(EvenBlocks, CoverTheRowsOnce) {
  EXPECT_EQ(even_blocks(0, 3), std::vector<RowRange>());
  EXPECT_EQ(even_blocks(7, 3), (std::vector<RowRange>{{0, 3}, {3, 6}, {6, 7}}));
  EXPECT_EQ(even_blocks(2, 1000), (std::vector<RowRange>{{0, 2}}));
  EXPECT_THROW(even_blocks(-1, 1), std::invalid_argument);
  EXPECT_THROW(even_blocks(1, 0), std::invalid_argument);
}

TEST(ThreadExecutor, BlocksMayDifferAndLeaveRowsOut) {
  for (const int threads : {1, 2, 5}) {
    RowCheck check({{10, 17}, {0, 2}, {5, 6}, {100, 103}}, 3);
    ThreadExecutor(threads).run(check.blocks(), 3, check.compute(), check.consume());
    check.expect_all_consumed();
    EXPECT_EQ(check.computed(), check.rows());
  }
}

TEST(ThreadExecutor, OneThreadIsTheCallers) {
  const auto caller = std::this_thread::get_id();
  ThreadExecutor(1).run(
      even_blocks(4, 1), 1, [&](RowRange, auto) { EXPECT_EQ(std::this_thread::get_id(), caller); },
      [&](RowRange, auto) { EXPECT_EQ(std::this_thread::get_id(), caller); });
}

TEST(ThreadExecutor, ConsumesInTheCallersThreadWhileOthersCompute) {
  const auto caller = std::this_thread::get_id();
  ThreadExecutor(3).run(
      even_blocks(12, 1), 1, [&](RowRange, auto) { EXPECT_NE(std::this_thread::get_id(), caller); },
      [&](RowRange, auto) { EXPECT_EQ(std::this_thread::get_id(), caller); });
}

TEST(ThreadExecutor, HandsBlocksOutInTheOrderGiven) {
  const std::vector<RowRange> blocks = {{4, 8}, {8, 9}, {0, 4}};
  std::vector<RowRange> computed;
  ThreadExecutor(1).run(
      blocks, 1, [&](RowRange range, auto) { computed.push_back(range); }, [](RowRange, auto) {});
  EXPECT_EQ(computed, blocks);
}

TEST(ThreadExecutor, SlowBlockDoesNotHoldOthersUp) {
  // The first block waits until all others are consumed, so that the second thread must compute
  // them.
  constexpr int rows = 20;
  std::atomic<int> consumed = 0;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  ThreadExecutor(2).run(
      even_blocks(rows, 1), 1,
      [&](RowRange range, auto) {
        while (range.first == 0 && consumed < rows - 1) {
          ASSERT_LT(std::chrono::steady_clock::now(), deadline);
          std::this_thread::sleep_for(milliseconds(1));
        }
      },
      [&](RowRange, auto) { ++consumed; });
  EXPECT_EQ(consumed, rows);
}

TEST(ThreadExecutor, SlowConsumerBoundsWaitingResults) {
  constexpr int threads = 3;
  std::atomic<int> computed = 0;
  int consumed = 0;
  int most_ahead = 0;
  ThreadExecutor(threads).run(
      even_blocks(40, 1), 1, [&](RowRange, auto) { ++computed; },
      [&](RowRange, auto) {
        std::this_thread::sleep_for(milliseconds(2));
        ++consumed;
        most_ahead = std::max(most_ahead, computed - consumed);
      });
  EXPECT_LE(most_ahead, 2 * threads);  // one waiting and one held per thread
  EXPECT_GE(most_ahead, threads);
}

TEST(ThreadExecutor, TellsWhereTheTimeWent) {
  for (const int threads : {1, 3}) {
    ThreadExecutor executor(threads);
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 2; ++i) {
      // The first block takes one thread longer than all other blocks together.
      executor.run(
          even_blocks(5, 1), 1,
          [](RowRange range, auto) {
            std::this_thread::sleep_for(milliseconds(range.first == 0 ? 120 : 5));
          },
          [](RowRange, auto) { std::this_thread::sleep_for(milliseconds(2)); });
    }
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    const RunTimes& times = executor.times();
    EXPECT_LE(times.wall, wall.count());
    EXPECT_GE(times.compute, 2 * 0.14);
    EXPECT_GE(times.consume, 2 * 0.01);
    const double in_workers = times.compute + times.waiting + (threads == 1 ? times.consume : 0);
    EXPECT_NEAR(in_workers, threads * times.wall, 1e-9);
    // Two threads wait for most of the first block's time, or for a third of it on a busy machine.
    if (threads == 3) {
      EXPECT_GE(times.waiting, 2 * 0.08);
    }
  }
}

class Failing : public testing::TestWithParam<int> {};

TEST_P(Failing, ComputeEndsTheRunWithItsException) {
  std::atomic<int> computed = 0;
  ThreadExecutor executor(GetParam());
  try {
    executor.run(
        even_blocks(10000, 1), 1,
        [&](RowRange range, auto) {
          ++computed;
          if (range.first == 5) throw InputError("row 5 is wrong");
          std::this_thread::sleep_for(milliseconds(1));
        },
        [](RowRange, auto) {});
    FAIL() << "nothing thrown";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "row 5 is wrong");
  }
  EXPECT_LT(computed, 5000);
  RowCheck check(even_blocks(10, 3), 2);
  executor.run(check.blocks(), 2, check.compute(), check.consume());
  check.expect_all_consumed();
}

TEST_P(Failing, ConsumeEndsTheRunWithItsException) {
  std::atomic<int> computed = 0;
  int consumed = 0;
  EXPECT_THROW(ThreadExecutor(GetParam())
                   .run(
                       even_blocks(10000, 1), 1, [&](RowRange, auto) { ++computed; },
                       [&](RowRange, auto) {
                         if (++consumed == 3) throw RunError("disk full");
                       }),
               RunError);
  EXPECT_EQ(consumed, 3);
  EXPECT_LE(computed, 3 + 2 * GetParam());
}

TEST_P(Failing, UnknownExceptionsPass) {
  EXPECT_THROW(
      ThreadExecutor(GetParam())
          .run(
              even_blocks(10, 1), 1, [](RowRange, auto) { throw 7; }, [](RowRange, auto) {}),
      int);
}

INSTANTIATE_TEST_SUITE_P(Threads, Failing, testing::Values(1, 2, 5));

TEST(ThreadExecutor, RejectsWrongNumbers) {
  EXPECT_THROW(ThreadExecutor(0), std::invalid_argument);
  for (const int threads : {1, 2}) {
    ThreadExecutor executor(threads);
    const auto nothing = [](RowRange, auto) {};
    for (const RowRange wrong : {RowRange{-1, 1}, RowRange{2, 2}, RowRange{3, 2}}) {
      const std::vector<RowRange> blocks = {{0, 1}, wrong};
      EXPECT_THROW(executor.run(blocks, 1, nothing, nothing), std::invalid_argument);
    }
  }
}

TEST(AvailableCores, FollowsTheAffinityMask) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  EXPECT_GE(available_cores(), 1);
  EXPECT_LE(available_cores(), CPU_COUNT(&before));
  int cpu = 0;
  while (!CPU_ISSET(cpu, &before)) ++cpu;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(cpu, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  EXPECT_EQ(available_cores(), 1);
  sched_setaffinity(0, sizeof before, &before);
}

}  // namespace
}  // namespace gamer::executor_test
