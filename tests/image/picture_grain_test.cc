#include "image/picture_grain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace gamer::picture_grain_test {
namespace {

constexpr int grain_side = 512;

/// Noise of one channel, [y][x].
std::vector<double> grain_of(const PictureStyle& style) {
  PictureGrain grain(style, grain_side, grain_side, 1);
  std::vector<double> all;
  for (int y = grain_side - 1; y >= 0; --y) {
    const auto row = grain.row(y);
    all.insert(all.begin(), row.begin(), row.end());
  }
  return all;
}

/// Mean product of values `dx` and `dy` apart, without a plane that is fitted to all values.
double covariance(const std::vector<double>& values, int dx, int dy) {
  double mean = 0, along_x = 0, along_y = 0;
  const double middle = 0.5 * (grain_side - 1),
               norm = grain_side * grain_side * (grain_side * grain_side - 1.0) / 12;
  for (int y = 0; y < grain_side; ++y) {
    for (int x = 0; x < grain_side; ++x) {
      const double value = values[static_cast<std::size_t>(y * grain_side + x)];
      mean += value / (grain_side * grain_side);
      along_x += value * (x - middle) / norm;
      along_y += value * (y - middle) / norm;
    }
  }
  double sum = 0;
  const auto at = [&](int x, int y) {
    return values[static_cast<std::size_t>(y * grain_side + x)] - mean - along_x * (x - middle) -
           along_y * (y - middle);
  };
  for (int y = 0; y + dy < grain_side; ++y) {
    for (int x = 0; x + dx < grain_side; ++x) sum += at(x, y) * at(x + dx, y + dy);
  }
  return sum / (grain_side - dx) / (grain_side - dy);
}

// Five standard errors of a mean of independent products.
constexpr double errors_of_grain = 5.0 / grain_side;

TEST(PictureGrain, PixelsWithoutSeeingAreIndependent) {
  const std::vector<double> noise = grain_of({.grain = 0.01});
  EXPECT_NEAR(covariance(noise, 0, 0), 1, std::sqrt(2.0) * errors_of_grain);
  EXPECT_NEAR(covariance(noise, 1, 0), 0, errors_of_grain);
  EXPECT_NEAR(covariance(noise, 0, 1), 0, errors_of_grain);
}

// The covariance of (1, 4, 1)/sqrt 18 with itself is 1, 8/18, 1/18, 0.
TEST(PictureGrain, NoiseOfAStackIsCorrelated) {
  const std::vector<double> noise = grain_of({.seeing = 1.2, .grain = 0.01});
  // Neighbours are not independent, and mean products have larger errors: the sum of squares of the
  // covariance is (1 + 2 (8/18)^2 + 2 (1/18)^2)^2.
  const double error = (1 + 2 * 64.0 / 324 + 2 / 324.0) * errors_of_grain;
  EXPECT_NEAR(covariance(noise, 0, 0), 1, std::sqrt(2.0) * error);
  EXPECT_NEAR(covariance(noise, 1, 0), 8.0 / 18, std::sqrt(2.0) * error);
  EXPECT_NEAR(covariance(noise, 0, 1), 8.0 / 18, std::sqrt(2.0) * error);
  EXPECT_NEAR(covariance(noise, 1, 1), 64.0 / 324, std::sqrt(2.0) * error);
  EXPECT_NEAR(covariance(noise, 2, 0), 1.0 / 18, std::sqrt(2.0) * error);
  EXPECT_NEAR(covariance(noise, 3, 0), 0, error);
}

TEST(PictureGrain, TheSkyOfAStackHasASlope) {
  PictureGrain grain({.seeing = 1.2, .grain = 0.01, .grain_seed = 4}, grain_side, grain_side, 3);
  double left[3] = {}, right[3] = {}, lower[3] = {}, upper[3] = {};
  for (int y = 0; y < grain_side; ++y) {
    const auto row = grain.row(y);
    for (int x = 0; x < grain_side; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double value =
            row[static_cast<std::size_t>(x) * 3 + c] / (grain_side * grain_side / 2.0);
        (2 * x < grain_side ? left : right)[c] += value;
        (2 * y < grain_side ? lower : upper)[c] += value;
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    // The mean of a half is half of the way to its end, in units of sigma.
    const double slope = std::hypot(right[c] - left[c], upper[c] - lower[c]);
    EXPECT_GT(slope, PictureGrain::common_slope - PictureGrain::own_slope - 0.05);
    EXPECT_LT(slope, PictureGrain::common_slope + PictureGrain::own_slope + 0.05);
  }
}

TEST(PictureGrain, RowsComeInAnyOrder) {
  const PictureStyle style{.seeing = 2, .grain = 0.01};
  PictureGrain down(style, 7, 5, 3), alone(style, 7, 5, 3);
  for (int y = 4; y >= 0; --y) {
    const auto row = down.row(y);
    const std::vector<double> seen(row.begin(), row.end());
    const auto same = alone.row((y * 3) % 5);
    const auto again = alone.row(y);
    EXPECT_EQ(same.size(), seen.size());
    EXPECT_EQ(std::vector<double>(again.begin(), again.end()), seen);
  }
}

}  // namespace
}  // namespace gamer::picture_grain_test
