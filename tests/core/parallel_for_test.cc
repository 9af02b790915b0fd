#include "gamer/core/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

namespace gamer {
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
  EXPECT_THROW(
      parallel_for(1000, [](std::size_t i) { if (i == 500) throw std::runtime_error("here"); }),
      std::runtime_error);
  // And can be used again.
  std::atomic<int> calls = 0;
  parallel_for(100, [&](std::size_t) { ++calls; });
  EXPECT_EQ(calls, 100);
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelFor, testing::Values(1, 2, 5));

TEST(ParallelFor, WorksInThreads) {
  use_threads(2);
  // Each waits for the other.
  std::atomic<int> arrived = 0;
  parallel_for(8, [&](std::size_t i) {
    if (i % 4 != 0) return;
    ++arrived;
    while (arrived < 2) std::this_thread::yield();
  });
  EXPECT_EQ(arrived, 2);
  use_threads(1);
}

}  // namespace
}  // namespace gamer
