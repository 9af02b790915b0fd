#include "core/denormals.h"

#include <gtest/gtest.h>

#include <limits>

namespace gamer {
namespace {

/// Half of the number, as the processor has it now.
float half_of(float number) {
  volatile float own = number;
  return 0.5f * own;
}

TEST(Denormals, AreZeroWhileAskedFor) {
#if !defined(__SSE__)
  GTEST_SKIP() << "only x86 processors are told so";
#endif
  constexpr float smallest = std::numeric_limits<float>::min();
  constexpr float denormal = std::numeric_limits<float>::denorm_min();
  EXPECT_GT(half_of(smallest), 0);
  {
    const DenormalsAreZero mode;
    EXPECT_EQ(half_of(smallest), 0) << "computed";
    volatile float tiny = denormal;
    EXPECT_EQ(0x1p100f * tiny, 0) << "given";
    EXPECT_EQ(half_of(2 * smallest), smallest);
    {
      const DenormalsAreZero again;
      EXPECT_EQ(half_of(smallest), 0);
    }
    EXPECT_EQ(half_of(smallest), 0) << "after one inside";
  }
  EXPECT_GT(half_of(smallest), 0) << "the thread's own mode again";
}

}  // namespace
}  // namespace gamer
