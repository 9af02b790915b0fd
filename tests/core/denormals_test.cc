#include "core/denormals.h"

#include <gtest/gtest.h>

#include <limits>

namespace gamer::denormals_test {
namespace {

/// Products in the processor's present mode, which are examined in its usual mode.
struct Products {
  float computed;  ///< half of the smallest normal number
  float given;     ///< 2^100 times a denormal number
};

Products products() {
  volatile float smallest = std::numeric_limits<float>::min();
  volatile float denormal = std::numeric_limits<float>::denorm_min();
  return {0.5f * smallest, 0x1p100f * denormal};
}

TEST(Denormals, AreZeroWhileAskedFor) {
#if !defined(__SSE__)
  GTEST_SKIP() << "only x86 processors are told so";
#endif
  const auto while_asked_for = [](int times) {
    const DenormalsAreZero mode;
    if (times == 1) return products();
    { const DenormalsAreZero again; }
    return products();
  };
  for (const int times : {1, 2}) {
    const Products zero = while_asked_for(times);
    EXPECT_EQ(zero.computed, 0) << times;
    EXPECT_EQ(zero.given, 0) << times;
    const Products usual = products();
    EXPECT_EQ(usual.computed, 0.5f * std::numeric_limits<float>::min()) << times;
    EXPECT_EQ(usual.given, 0x1p-49f) << times;
  }
}

}  // namespace
}  // namespace gamer::denormals_test
