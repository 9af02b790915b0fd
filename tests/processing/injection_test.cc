#include "processing/injection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "gamer/core/error.h"
#include "image/synthetic_image.h"
#include "processing/operation_fixture.h"
#include "processing/plane_info.h"

namespace gamer::injection_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

FitsHeader header_of(const std::vector<Card>& cards) {
  FitsHeader header;
  for (const Card& card : cards) header.set(card);
  return header;
}

TEST(Injection, ZeroPointComesFromTheFirstHeaderThatHasOne) {
  const FitsHeader empty;
  for (const std::string_view key : zero_point_keys()) {
    const FitsHeader own = header_of({{std::string(key), 27.5, {}}});
    const auto value = zero_point_of(std::vector{empty, own}, 0, "");
    ASSERT_TRUE(value) << key;
    EXPECT_EQ(value->value, 27.5);
    EXPECT_EQ(value->key, key);
  }
  const FitsHeader first = header_of({{"PHOTZP", 25.0, {}}, {"BUNIT", "nJy", {}}});
  const FitsHeader second = header_of({{"MAGZERO", 26.0, {}}});
  EXPECT_EQ(zero_point_of(std::vector{first, second}, 0, "")->value, 25);
  EXPECT_EQ(zero_point_of(std::vector{second, first}, 0, "")->value, 26);
  EXPECT_FALSE(zero_point_of(std::vector{empty}, 0, ""));
}

TEST(Injection, ZeroPointOfPlanesAndUnits) {
  const FitsHeader cube = header_of({{"MAGZERO1", 25.0, {}}, {"MAGZERO2", 26.0, {}}});
  EXPECT_EQ(zero_point_of(std::vector{cube}, 1, "")->value, 26);
  EXPECT_EQ(zero_point_of(std::vector{cube}, 1, "")->key, "MAGZERO2");
  // A single plane's own card may have a number.
  const FitsHeader single = header_of({{"MAGZERO1", 25.0, {}}, {"PHOTZP", 25.0, {}}});
  EXPECT_EQ(zero_point_of(std::vector{single}, 0, "")->key, "MAGZERO1");
  EXPECT_EQ(plane_info(single, 0, 1).zero_point, 25);
  // 3631 Jy have the magnitude 0, but for the rounding of 48.60.
  const double jansky = 2.5 * std::log10(3631);
  for (const auto& [unit, janskys] : std::vector<std::pair<std::string, double>>{
           {"Jy", 1}, {"mJy", 1e-3}, {"uJy", 1e-6}, {"nJy", 1e-9}}) {
    const auto value = zero_point_of(std::vector{header_of({{"BUNIT", unit, {}}})}, 0, "");
    EXPECT_NEAR(value->value, jansky - 2.5 * std::log10(janskys), 1e-4) << unit;
  }
}

TEST(Injection, ContradictoryZeroPointsAreAnError) {
  const FitsHeader both = header_of({{"MAGZERO", 25.0, {}}, {"MAGZPT", 25.1, {}}});
  try {
    zero_point_of(std::vector{both}, 0, "here: ");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "here: MAGZERO is 25, but MAGZPT is 25.1; --zero-point says what counts");
  }
}

TEST(Injection, GainMustBePositive) {
  const FitsHeader zero = header_of({{"GAIN", 0.0, {}}});
  EXPECT_FALSE(gain_of(std::vector{zero}, 0));
  const FitsHeader other = header_of({{"EGAIN", 1.5, {}}});
  EXPECT_EQ(gain_of(std::vector{zero, other}, 0)->value, 1.5);
}

TEST(Injection, MeanLightIsAddedAndTheRestKeepsItsBits) {
  const PlanePtr image = std::make_shared<MemoryPlane>(
      4, 1, std::vector<double>{-0.0, nan_value, 5, std::numeric_limits<double>::infinity()});
  const PlanePtr light = std::make_shared<MemoryPlane>(4, 1, std::vector<double>{0, 2, -1, 3});
  Injection injection;
  injection.factor = 0.5;
  injection.has_noise = false;
  const Image sum = evaluate(*injected(image, light, injection));
  EXPECT_TRUE(std::signbit(sum.at(0, 0)));
  EXPECT_TRUE(std::isnan(sum.at(1, 0)));
  EXPECT_EQ(sum.at(2, 0), 4.5);
  EXPECT_TRUE(std::isinf(sum.at(3, 0)));
  injection.least = 1.5;
  EXPECT_EQ(evaluate(*injected(image, light, injection)).at(2, 0), 5);
}

/// The noise has the mean v factor and the variance v factor/gain, to 4 standard errors.
TEST(Injection, NoiseIsThatOfElectrons) {
  constexpr int side = 400;
  constexpr double count = side * side;
  for (const double value : {0.02, 3.0, 700.0}) {
    const PlanePtr image = make_plane(side, side, [](int, int) { return 10.0; });
    const PlanePtr light = make_plane(side, side, [=](int, int) { return value; });
    Injection injection;
    injection.factor = 2;
    injection.gain = 4;
    injection.key = 99;
    const Image sum = evaluate(*injected(image, light, injection), 2);
    const double mean = 2 * value, variance = mean / injection.gain;
    double first = 0, second = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double difference = sum.at(x, y) - 10 - mean;
        first += difference;
        second += difference * difference;
      }
    }
    EXPECT_NEAR(first / count, 0, 4 * std::sqrt(variance / count));
    // The variance of a squared Poisson difference is 2 mu^2 + mu.
    const double electrons = mean * injection.gain;
    const double error = std::sqrt((2 + 1 / electrons) / count);
    EXPECT_NEAR(second / count / variance, 1, 4 * error);
  }
}

TEST(Injection, GridsOnTheSky) {
  SkyView view;
  view.center = {150, 2};
  view.pixel_scale = 0.2;
  view.width = view.height = 101;
  const CelestialWcs large(view);
  const auto shift = grid_shift(large, large, 101, 101);
  ASSERT_TRUE(shift);
  EXPECT_EQ(shift->x, 0);
  EXPECT_EQ(shift->y, 0);
  EXPECT_LT(shift->error, 1e-6);
  EXPECT_LT(grid_difference(large, {51, 51}, large, {51, 51}), 1e-12);
  view.pixel_scale = 0.21;
  const CelestialWcs coarse(view);
  EXPECT_NEAR(grid_difference(large, {51, 51}, coarse, {51, 51}), 0.05, 1e-6);
  // A corner is 50 sqrt(2) pixels from the middle.
  EXPECT_NEAR(grid_shift(large, coarse, 101, 101)->error, 0.05 * 50 * std::sqrt(2.0), 1e-4);
  view.pixel_scale = 0.2;
  view.rotation = 1;
  const CelestialWcs turned(view);
  EXPECT_NEAR(grid_difference(large, {51, 51}, turned, {51, 51}),
              2 * std::sin(std::acos(-1.0) / 360), 1e-6);
}

/// Light of two bands is injected into two planes, each with its own zero point.
TEST_F(SmallFiles, InjectPlaneByPlane) {
  write("cube.fits", {{{even(10), even(20)},
                       {{"MAGZERO1", 31.4, {}}, {"MAGZERO2", 28.9, {}}, {"GAIN", 3.0, {}}}}});
  write("light.fits", {{{even(5), even(50)}, {{"MAGZERO", 31.4, {}}, {"BUNIT", "nJy", {}}}}});
  run({"inject", "--no-noise", "cube.fits", "light.fits", "out.fits"});
  EXPECT_NEAR(pixel(file(), 0, 0), 15, 1e-12);
  EXPECT_NEAR(pixel(file(), 0, 1), 25, 1e-12);
  run({"inject", "--no-noise", "--zero-point", "31.4,31.4", "cube.fits", "light.fits", "out.fits"});
  EXPECT_NEAR(pixel(file(), 0, 1), 70, 1e-12);
  write("one.fits", {{{even(10)}, {{"MAGZERO", 31.4, {}}}}});
  EXPECT_EQ(error({"inject", "--no-noise", "one.fits", "light.fits", "out.fits"}),
            "gutil inject: light.fits has 2 planes, one.fits has 1; as many are needed, or "
            "--plane");
  run({"inject", "--no-noise", "--plane", "2", "one.fits", "light.fits", "out.fits"});
  EXPECT_NEAR(pixel(file(), 0, 0), 60, 1e-12);
}

/// With one seed, the noise of gutil noise and that of injected light are independent.
TEST_F(SmallFiles, InjectedNoiseIsItsOwn) {
  write("zero.fits", {{{even(0)}, {{"MAGZERO", 31.4, {}}, {"GAIN", 1.0, {}}}}});
  write("light.fits", {{{even(1e6)}, {{"MAGZERO", 31.4, {}}, {"BUNIT", "nJy", {}}}}});
  run({"inject", "--seed", "1", "zero.fits", "light.fits", "out.fits"});
  run({"noise", "--seed", "1", "--exposure", "1", "--electrons-per-unit", "1", "light.fits",
       "noise.fits"});
  EXPECT_NE(pixel(file(), 0, 0), pixel(file("noise.fits"), 0, 0));
}

}  // namespace
}  // namespace gamer::injection_test
