#include "processing/tone_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/each_simd_target.h"

namespace gamer::tone_kernel_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double positive_infinity = std::numeric_limits<double>::infinity();

double exact(const ToneKernel& kernel, double x) {
  const long double size = std::abs(x), a = kernel.parameter;
  switch (kernel.curve) {
    case ToneCurve::power: return static_cast<double>(std::pow(size, a));
    case ToneCurve::logarithm: return static_cast<double>(std::log1p(a * size));
    case ToneCurve::asinh: return static_cast<double>(std::asinh(a * size));
  }
  return 0;
}

TEST(ToneKernel, AccuracyAndTheSameBitsOnEveryTarget) {
  std::vector<double> x;
  for (double value = 1e-300; value < 1e300; value *= 1.37) x.push_back(value);
  for (int i = 1; i < 3000; ++i) x.push_back(-i / 1000.0);
  for (const ToneCurve curve : {ToneCurve::power, ToneCurve::logarithm, ToneCurve::asinh}) {
    for (const double parameter : {1e-3, 0.4545, 1.0, 2.2, 1e4}) {
      ToneKernel kernel;
      kernel.curve = curve;
      kernel.parameter = parameter;
      std::vector<double> first;
      for_each_simd_target([&] {
        std::vector<double> values = x;
        apply_tone(kernel, values.data(), values.size());
        if (first.empty()) first = values;
        ASSERT_EQ(std::memcmp(first.data(), values.data(), values.size() * sizeof(double)), 0);
      });
      double worst = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const double expected = exact(kernel, x[i]);
        const double grows =
            curve == ToneCurve::power ? 1 + std::abs(parameter * std::log(std::abs(x[i]))) : 1;
        // Beyond e^+-700 the power is 0 or infinite.
        if (curve == ToneCurve::power && grows > 700) {
          ASSERT_TRUE(std::abs(first[i]) == 0 || std::isinf(first[i]) || grows < 702);
          continue;
        }
        ASSERT_EQ(std::signbit(first[i]), std::signbit(x[i]));
        worst = std::max(worst, std::abs(std::abs(first[i]) / expected - 1) / grows);
      }
      EXPECT_LT(worst, 1e-15) << parameter;
    }
  }
}

TEST(ToneKernel, SpecialValuesAtAnyPlaceOfAVector) {
  for (const ToneCurve curve : {ToneCurve::power, ToneCurve::logarithm, ToneCurve::asinh}) {
    ToneKernel kernel;
    kernel.curve = curve;
    kernel.parameter = 0.5;
    for_each_simd_target([&] {
      for (std::size_t count = 1; count < 40; ++count) {
        std::vector<double> values(count, 1.0);
        values.front() = nan_value;
        values.back() = count % 2 == 0 ? positive_infinity : -positive_infinity;
        values[count / 2] = 0;
        apply_tone(kernel, values.data(), count);
        if (count > 2) {
          EXPECT_TRUE(std::isnan(values.front()));
          EXPECT_TRUE(std::isinf(values.back()));
          EXPECT_EQ(std::signbit(values.back()), count % 2 != 0);
        }
        EXPECT_EQ(values[count / 2], 0);
      }
      kernel.clip = true;
      std::vector<double> values = {nan_value, -3, positive_infinity, -positive_infinity, 0.3};
      apply_tone(kernel, values.data(), values.size());
      EXPECT_TRUE(std::isnan(values[0]));
      EXPECT_EQ(values[1], 0);
      EXPECT_NEAR(values[2], exact(kernel, 1), 2e-16);
      EXPECT_EQ(values[3], 0);
      EXPECT_NEAR(values[4], exact(kernel, 0.3), 2e-16);
      kernel.clip = false;
    });
  }
}

TEST(ToneKernel, OffsetRangeAndFactor) {
  ToneKernel kernel;
  kernel.curve = ToneCurve::power;
  kernel.parameter = 2;
  kernel.offset = 10;
  kernel.range = 4;
  kernel.factor = 3;
  std::vector<double> values = {12, 8, 10};
  apply_tone(kernel, values.data(), values.size());
  EXPECT_NEAR(values[0], 0.75, 2e-16);
  EXPECT_NEAR(values[1], -0.75, 2e-16);
  EXPECT_EQ(values[2], 0);
}

}  // namespace
}  // namespace gamer::tone_kernel_test
