#include "gamer/core/cancellation.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>

#include "gamer/core/parallel_for.h"

namespace gamer::cancellation_test {
namespace {

TEST(Cancellation, HoldsWithinItsScope) {
  Cancellation request;
  EXPECT_NO_THROW(check_cancelled());
  {
    const CancellationScope scope(&request);
    EXPECT_EQ(CancellationScope::current(), &request);
    EXPECT_NO_THROW(check_cancelled());
    request.request();
    EXPECT_THROW(check_cancelled(), Cancelled);
    {
      const CancellationScope none(nullptr);
      EXPECT_NO_THROW(check_cancelled());
    }
    EXPECT_THROW(check_cancelled(), Cancelled);
  }
  EXPECT_NO_THROW(check_cancelled());
}

TEST(Cancellation, EndsLoopsInAllThreads) {
  for (const int threads : {1, 3}) {
    use_threads(threads);
    Cancellation request;
    const CancellationScope scope(&request);
    std::atomic<int> begun = 0;
    constexpr std::size_t all = 100000;
    EXPECT_THROW(parallel_for(all,
                              [&](std::size_t) {
                                if (++begun == 10) request.request();
                                EXPECT_EQ(CancellationScope::current(), &request);
                              }),
                 Cancelled);
    // Each thread may still be computing a few indices.
    EXPECT_LT(begun, 50);
  }
  use_threads(1);
}

}  // namespace
}  // namespace gamer::cancellation_test
