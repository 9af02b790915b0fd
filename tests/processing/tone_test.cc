#include "processing/tone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::tone_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

PlanePtr plane(int width, std::vector<double> values) {
  const int height = static_cast<int>(values.size()) / width;
  return std::make_shared<MemoryPlane>(width, height, std::move(values));
}

std::vector<double> values_of(const Plane& plane) {
  std::vector<double> values(static_cast<std::size_t>(plane.width()) * plane.height());
  plane.read(plane.whole(), values.data());
  return values;
}

std::vector<double> random_values(int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(static_cast<double>(random() >> 11) * 0x1p-53 * 8 - 1);
  }
  return values;
}

// ---- Normalising -------------------------------------------------------------------------------

TEST(Normalise, TotalPeakAndMeanOfOnePlane) {
  std::vector<double> values = random_values(5000, 1);
  values[17] = nan_value;
  const std::vector<PlanePtr> planes = {plane(100, values)};
  const auto after = [&](const LinearTone& tone) {
    std::vector<double> result = values_of(*linear_tone(planes[0], tone));
    EXPECT_TRUE(std::isnan(result[17]));
    result.erase(result.begin() + 17);
    return result;
  };
  const auto sum = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0);
  };
  EXPECT_NEAR(sum(after(tone_to_total(planes, 1, 2))), 1, 1e-12);
  EXPECT_NEAR(sum(after(tone_to_total(planes, 3e10, 2))) / 3e10, 1, 1e-12);
  const auto peak = after(tone_to_peak(planes, 0.3, 1));
  EXPECT_DOUBLE_EQ(*std::max_element(peak.begin(), peak.end()), 0.3);
  EXPECT_NEAR(sum(after(tone_to_mean(planes, 2, 1))) / 4999, 2, 1e-12);
}

TEST(Normalise, PlanesTogetherWhateverTheirSize) {
  const std::vector<PlanePtr> planes = {plane(3, {1, 2, 3, 4, 5, 6}),
                                        plane(2, {10, 20, 30, nan_value}), plane(4, {7, 8, 9, 5})};
  EXPECT_DOUBLE_EQ(tone_to_total(planes, 110, 2).factor, 1);
  EXPECT_DOUBLE_EQ(tone_to_peak(planes, 60, 2).factor, 2);
  EXPECT_DOUBLE_EQ(tone_to_mean(planes, 110.0 / 13, 2).factor, 1);
  EXPECT_EQ(positive_maximum(planes, 1), 30);
  // The sorted values are 1 2 3 4 5 5 6 7 8 9 10 20 30.
  const Limits limits = quantile_limits(planes, 0.25, 11.0 / 12, 1);
  EXPECT_DOUBLE_EQ(limits.low, 4);
  EXPECT_DOUBLE_EQ(limits.high, 20);
}

TEST(Normalise, RangeBecomesZeroToOne) {
  const PlanePtr source = plane(3, random_values(300, 2));
  const std::vector<PlanePtr> planes = {source};
  const Limits limits = quantile_limits(planes, 0.1, 0.9, 1);
  const std::vector<PlanePtr> after = {linear_tone(source, tone_to_unit_range(limits))};
  const Limits unit = quantile_limits(after, 0.1, 0.9, 1);
  EXPECT_NEAR(unit.low, 0, 1e-15);
  EXPECT_NEAR(unit.high, 1, 1e-15);
}

template <class Call>
std::string message_of(Call call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Normalise, WhatCannotBeScaledIsAnError) {
  const std::vector<PlanePtr> dark = {plane(2, {0, 0})}, negative = {plane(2, {-3, 1})};
  const std::vector<PlanePtr> empty = {plane(2, {nan_value, nan_value})},
                              tiny = {plane(1, {1e-300})};
  EXPECT_EQ(message_of([&] { tone_to_total(dark, 1, 1); }),
            "the sum of the pixels is 0, which no positive factor brings to 1");
  EXPECT_EQ(message_of([&] { tone_to_mean(negative, 2, 1); }),
            "the mean of the pixels is -1, which no positive factor brings to 2");
  EXPECT_EQ(message_of([&] { tone_to_peak(dark, 1, 1); }),
            "the largest pixel is 0, which no positive factor brings to 1");
  EXPECT_EQ(message_of([&] { tone_to_peak(tiny, 1e300, 1); }),
            "the largest pixel is 1e-300, which no positive factor brings to 1e+300");
  EXPECT_EQ(message_of([&] { tone_to_total(empty, 1, 1); }), "no pixel has a finite value");
  EXPECT_EQ(message_of([&] { quantile_limits(empty, 0, 1, 1); }), "no pixel has a finite value");
  EXPECT_EQ(message_of([&] { positive_maximum(empty, 1); }), "no pixel has a finite value");
  EXPECT_EQ(message_of([&] { positive_maximum(dark, 1); }), "no pixel is above 0");
  EXPECT_EQ(message_of([&] {
              tone_to_unit_range({2, 2});
            }),
            "2 and 2 span no range of values that becomes 0 to 1");
}

// ---- gamma -------------------------------------------------------------------------------------

TEST(GammaTone, IsThePowerOfTheFractionOfTheMaximum) {
  const auto values = values_of(*gamma_tone(plane(6, {0, 1, 2, 4, -1, nan_value}), 4, 0.5));
  EXPECT_EQ(values[0], 0);
  EXPECT_DOUBLE_EQ(values[1], 0.5);
  EXPECT_DOUBLE_EQ(values[2], std::sqrt(0.5));
  EXPECT_EQ(values[3], 1);
  EXPECT_DOUBLE_EQ(values[4], -0.5);
  EXPECT_TRUE(std::isnan(values[5]));
}

TEST(GammaTone, ThereAndBack) {
  const std::vector<double> values = random_values(1000, 3);
  const auto back = values_of(*gamma_tone(gamma_tone(plane(10, values), 7, 0.4545), 1, 1 / 0.4545));
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(back[i], values[i] / 7, 5e-16);
}

// ---- stretch -----------------------------------------------------------------------------------

std::vector<double> stretch(Stretch::Function function, double softening, bool clip,
                            std::vector<double> values) {
  const int width = static_cast<int>(values.size());
  // The limits are 10 and 30.
  for (double& value : values) value = 10 + 20 * value;
  return values_of(*stretched(plane(width, values), {function, softening, {10, 30}, clip}));
}

TEST(Stretch, ClosedForms) {
  using F = Stretch::Function;
  const std::vector<double> x = {0, 0.25, 0.5, 1};
  EXPECT_EQ(stretch(F::linear, 1, true, x), x);
  const auto root = stretch(F::square_root, 1, true, x);
  EXPECT_DOUBLE_EQ(root[1], 0.5);
  EXPECT_DOUBLE_EQ(root[2], std::sqrt(0.5));
  // The values are ln(1 + 3 * 0.25)/ln 4, and ln 2/ln 4, since 1 + 3 x = 2 at x = 1/3.
  const auto logarithm = stretch(F::logarithm, 3, true, {0.25, 1.0 / 3});
  EXPECT_NEAR(logarithm[0], 0.40367746102880205, 1e-15);
  EXPECT_NEAR(logarithm[1], 0.5, 1e-15);
  // The values are asinh(3/4) = ln 2 and asinh(4/3) = ln 3.
  const auto asinh = stretch(F::asinh, 0.75, true, {0.5625});
  EXPECT_NEAR(asinh[0], std::log(2) / std::log(3), 1e-15);
  for (const F function : {F::linear, F::square_root, F::logarithm, F::asinh}) {
    const auto ends = stretch(function, default_softening(function), true, {0, 1});
    EXPECT_EQ(ends[0], 0);
    EXPECT_DOUBLE_EQ(ends[1], 1);
  }
}

// Expected values of LogStretch(1000) and AsinhStretch(0.1) at 0.1 and 0.6 are those of Astropy
// 5.2.1.
TEST(Stretch, DefaultsAreAstropys) {
  using F = Stretch::Function;
  const auto logarithm = stretch(F::logarithm, default_softening(F::logarithm), true, {0.1, 0.6});
  const auto asinh = stretch(F::asinh, default_softening(F::asinh), true, {0.1, 0.6});
  EXPECT_NEAR(logarithm[0], 0.6680104684941067, 1e-15);
  EXPECT_NEAR(logarithm[1], 0.9261574826324088, 1e-15);
  EXPECT_NEAR(asinh[0], 0.2939653260048424, 1e-15);
  EXPECT_NEAR(asinh[1], 0.8310855776743599, 1e-15);
}

TEST(Stretch, ClipsOrContinuesAsOddFunction) {
  using F = Stretch::Function;
  for (const F function : {F::linear, F::square_root, F::logarithm, F::asinh}) {
    const double softening = default_softening(function);
    const auto clipped = stretch(function, softening, true, {-0.5, 1.5, nan_value});
    EXPECT_EQ(clipped[0], 0);
    EXPECT_DOUBLE_EQ(clipped[1], 1);
    EXPECT_TRUE(std::isnan(clipped[2]));
    const auto open = stretch(function, softening, false, {-0.5, 0.5, 1.5, nan_value});
    EXPECT_DOUBLE_EQ(open[0], -open[1]);
    EXPECT_GT(open[2], 1);
    EXPECT_TRUE(std::isnan(open[3]));
  }
}

TEST(Stretch, Rises) {
  using F = Stretch::Function;
  std::vector<double> x;
  for (int i = -1000; i <= 2000; ++i) x.push_back(i / 1000.0);
  for (const F function : {F::linear, F::square_root, F::logarithm, F::asinh}) {
    const auto values = stretch(function, default_softening(function), false, x);
    for (std::size_t i = 1; i < values.size(); ++i) ASSERT_GT(values[i], values[i - 1]);
  }
}

}  // namespace
}  // namespace gamer::tone_test
