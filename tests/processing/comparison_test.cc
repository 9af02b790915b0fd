#include "processing/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace gamer::comparison_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double positive_infinity = std::numeric_limits<double>::infinity();

TEST(Comparison, OfFewNumbers) {
  const MemoryPlane a(4, 2, {1, 2, -8, 4, 5, 6, nan_value, 8});
  const MemoryPlane b(4, 2, {1, 2.5, -8, 4, 3, 8, 7, nan_value});
  const Comparison result = compare(a, b, 2);
  EXPECT_EQ(result.count, 6);
  EXPECT_EQ(result.differing, 3);
  EXPECT_EQ(result.mismatched, 2);
  EXPECT_EQ(result.max_difference, 2);
  EXPECT_EQ(result.max_at.x, 0);
  EXPECT_EQ(result.max_at.y, 1);
  EXPECT_EQ(result.max_reference, 8);
  EXPECT_DOUBLE_EQ(result.rms_difference, std::sqrt(8.25 / 6));
  EXPECT_DOUBLE_EQ(result.rms_reference, std::sqrt(146.0 / 6));
  EXPECT_DOUBLE_EQ(result.relative_max(), 0.25);
  EXPECT_DOUBLE_EQ(result.relative_rms(), std::sqrt(8.25 / 146));
  EXPECT_FALSE(result.within(10, 10));
}

TEST(Comparison, Tolerances) {
  const Comparison result = compare(MemoryPlane(2, 1, {4, 0}), MemoryPlane(2, 1, {4, 0.5}), 1);
  EXPECT_TRUE(result.within(0, 0.5));
  EXPECT_FALSE(result.within(0, 0.49));
  EXPECT_TRUE(result.within(0.125, 0));
  EXPECT_FALSE(result.within(0.12, 0));
  EXPECT_TRUE(result.within(0.1, 0.1));
}

TEST(Comparison, EqualPlanes) {
  const MemoryPlane a(5, 1, {nan_value, positive_infinity, -positive_infinity, 0.0, 3});
  const MemoryPlane b(5, 1, {nan_value, positive_infinity, -positive_infinity, -0.0, 3});
  const Comparison result = compare(a, b, 1);
  EXPECT_EQ(result.count, 2);
  EXPECT_EQ(result.differing, 0);
  EXPECT_TRUE(result.within(0, 0));
  const Comparison zeros = compare(MemoryPlane(1, 1, {0}), MemoryPlane(1, 1, {0}), 1);
  EXPECT_EQ(zeros.relative_max(), 0);
  EXPECT_EQ(zeros.relative_rms(), 0);
  const Comparison signs =
      compare(MemoryPlane(1, 1, {positive_infinity}), MemoryPlane(1, 1, {-positive_infinity}), 1);
  EXPECT_FALSE(signs.within(0, 0));
  EXPECT_EQ(compare(MemoryPlane(1, 1, {0}), MemoryPlane(1, 1, {1}), 1).relative_max(),
            positive_infinity);
}

TEST(Comparison, RefusesOtherSizes) {
  EXPECT_THROW(compare(MemoryPlane(2, 1, {4, 0}), MemoryPlane(1, 2, {4, 0}), 1),
               std::invalid_argument);
}

}  // namespace
}  // namespace gamer::comparison_test
