#include "gamer/core/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace gamer::parallel_for_test {
namespace {

class ParallelFor : public testing::TestWithParam<int> {
 protected:
  ParallelFor() { use_threads(GetParam()); }
  ~ParallelFor() override { use_threads(1); }
};

TEST_P(ParallelFor, CallsWorkOnceForEveryIndex) {
  for (const std::size_t count : {0u, 1u, 2u, 7u, 1000u}) {
    std::vector<std::atomic<int>> calls(count);
    parallel_for(count, [&](std::size_t i) { ++calls[i]; });
    for (const auto& times : calls) EXPECT_EQ(times, 1);
  }
}

TEST_P(ParallelFor, ThrowsWhatWorkThrows) {
  EXPECT_THROW(parallel_for(1000,
                            [](std::size_t i) {
                              if (i == 500) throw std::runtime_error("here");
                            }),
               std::runtime_error);
  // The threads can be used again.
  std::atomic<int> calls = 0;
  parallel_for(100, [&](std::size_t) { ++calls; });
  EXPECT_EQ(calls, 100);
}

TEST_P(ParallelFor, ThrowsForTheLeastIndex) {
  // The least index fails last: with one thread at once, with more after another index has failed.
  std::atomic<bool> has_failed = GetParam() == 1;
  try {
    parallel_for(
        100,
        [&](std::size_t i) {
          while (i == 5 && !has_failed) std::this_thread::yield();
          if (i == 5) std::this_thread::sleep_for(std::chrono::milliseconds(5));
          if (i > 5) has_failed = true;
          if (i >= 5) throw i;
        },
        100);
    FAIL();
  } catch (const std::size_t index) {
    EXPECT_EQ(index, 5);
  }
}

TEST_P(ParallelFor, LoopsWithinLoops) {
  constexpr std::size_t outer = 20, inner = 30;
  constexpr int at_a_time = 2;
  std::vector<std::atomic<int>> calls(outer * inner);
  std::atomic<int> now = 0, most = 0;
  parallel_for(
      outer,
      [&](std::size_t i) {
        int own = ++now;
        for (int known = most; known < own && !most.compare_exchange_weak(known, own);) {
        }
        parallel_for(inner, [&](std::size_t k) {
          std::this_thread::yield();
          ++calls[i * inner + k];
        });
        // The inner loop is complete here.
        for (std::size_t k = 0; k < inner; ++k) EXPECT_EQ(calls[i * inner + k], 1);
        --now;
      },
      at_a_time);
  for (const auto& times : calls) EXPECT_EQ(times, 1);
  EXPECT_LE(most, std::min(at_a_time, GetParam()));
}

TEST_P(ParallelFor, ThrowsWhatLoopsWithinThrow) {
  std::atomic<int> ended = 0;
  EXPECT_THROW(parallel_for(
                   10,
                   [&](std::size_t i) {
                     parallel_for(10, [&](std::size_t k) {
                       if (i == 3 && k == 5) throw std::runtime_error("here");
                     });
                     ++ended;
                   },
                   4),
               std::runtime_error);
  EXPECT_LT(ended, 10);
  std::atomic<int> calls = 0;
  parallel_for(100, [&](std::size_t) { ++calls; });
  EXPECT_EQ(calls, 100);
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelFor, testing::Values(1, 2, 5));

TEST(ParallelFor, WorksInThreads) {
  use_threads(2);
  // Each index waits for the other.
  std::atomic<int> arrived = 0;
  parallel_for(8, [&](std::size_t i) {
    if (i % 4 != 0) return;
    ++arrived;
    while (arrived < 2) std::this_thread::yield();
  });
  EXPECT_EQ(arrived, 2);
  use_threads(1);
}

TEST(ParallelFor, TakesANumberOfThreads) {
  use_threads(1);
  // Each waits for the others.
  std::atomic<int> arrived = 0;
  const auto meet = [&](std::size_t) {
    ++arrived;
    while (arrived < 3) std::this_thread::yield();
  };
  parallel_for(3, meet, {}, 3);
  EXPECT_EQ(arrived, 3);
}

TEST(ParallelFor, OtherThreadsHelpWithinLoops) {
  use_threads(3);
  // The indices of each inner loop wait for each other.
  for (int times = 0; times < 20; ++times) {
    parallel_for(
        2,
        [&](std::size_t) {
          std::atomic<int> arrived = 0;
          parallel_for(3, [&](std::size_t) {
            ++arrived;
            while (arrived < 3) std::this_thread::yield();
          });
        },
        1);
  }
  // The thread that has finished its own index helps with the other.
  parallel_for(
      2,
      [&](std::size_t i) {
        if (i == 0) return;
        std::atomic<int> arrived = 0;
        parallel_for(3, [&](std::size_t) {
          ++arrived;
          while (arrived < 3) std::this_thread::yield();
        });
      },
      2);
  use_threads(1);
}

}  // namespace
}  // namespace gamer::parallel_for_test
