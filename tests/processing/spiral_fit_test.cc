#include "processing/spiral_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "gamer/core/error.h"
#include "gamer/core/units.h"
#include "processing/polar_map.h"

namespace gamer::spiral_fit_test {
namespace {

constexpr double pi_value = std::numbers::pi;

/// A disk of scale length h with logarithmic arms, seen at an inclination. Its light is exp(-r/h)
/// times `profile` of the azimuth from an arm's crest.
struct SpiralGalaxy {
  int arms = 2;
  double pitch = 15;       ///< deg, positive where arms turn counter-clockwise outwards
  double inclination = 0;  ///< deg
  double node = 0;         ///< deg from +x towards +y
  double h = 60;
  double phase = 0.4;

  template <class Profile>
  Image image(Profile profile) const {
    const int side = 401;
    const double centre = 200;
    Image result(side, side, 1);
    const double c = std::cos(node * degree), s = std::sin(node * degree);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double u = c * (x - centre) + s * (y - centre);
        const double v = (c * (y - centre) - s * (x - centre)) / std::cos(inclination * degree);
        const double r = std::max(std::hypot(u, v), 1e-3), azimuth = std::atan2(v, u);
        const double crest = std::log(r) / std::tan(pitch * degree) + phase;
        result.at(x, y) =
            std::exp(-r / h) * profile(std::remainder(azimuth - crest, 2 * pi_value / arms));
      }
    }
    return result;
  }

  DiskPlane disk() const { return {200, 200, inclination * degree, node * degree}; }
};

PolarGrid grid_of(double inner, double outer, int columns = 720) {
  PolarGrid grid;
  grid.inner = inner;
  grid.outer = outer;
  grid.columns = columns;
  grid.rows = static_cast<int>(std::log(outer / inner) / grid.azimuth_step());
  return grid;
}

/// The light is 1 + 0.5 cos(m theta), with the amplitude |A| = 1/4 and the contrast 2.5
/// log10(1.5/0.5) = 1.193 mag. Half of the light above the minimum is within half of the arms'
/// distance.
TEST(SpiralFit, CosineArmsOfKnownPitch) {
  for (const double inclination : {0, 45}) {
    for (const int arms : {2, 3, 4}) {
      for (const double pitch : {-30, -12, 5, 8, 20}) {
        SCOPED_TRACE(testing::Message() << arms << " arms, " << pitch << " deg, i " << inclination);
        SpiralGalaxy galaxy;
        galaxy.arms = arms;
        galaxy.pitch = pitch;
        galaxy.inclination = inclination;
        galaxy.node = 35;
        const Image image =
            galaxy.image([&](double theta) { return 1 + 0.5 * std::cos(arms * theta); });
        const PolarGrid grid = grid_of(40, 190);
        const Image map = polar_map(image, galaxy.disk(), grid);
        const SpiralFit fit = fit_spiral(map, grid);
        EXPECT_EQ(fit.strongest.arms, arms);
        EXPECT_NEAR(fit.strongest.pitch / degree, pitch, 0.002);
        EXPECT_LT(fit.strongest.error / degree, 9e-4);
        // Pixels blur arms in proportion to the square of the number of waves per pixel.
        const double waves = arms / std::sin(std::fabs(pitch) * degree);
        const double blur = waves * waves * (inclination > 0 ? 1.3e-4 : 8e-5);
        EXPECT_NEAR(fit.strongest.amplitude, 0.25, blur / 15);
        double contrast = 0, width = 0, across = 0, local = 0, uneven = 0;
        const auto list = arms_by_radius(map, grid, fit.strongest, 8);
        for (const ArmsAtRadius& at : list) {
          contrast = std::max(contrast, std::fabs(at.contrast - 2.5 * std::log10(3)));
          width = std::max(width, std::fabs(at.width_azimuth * arms / pi_value - 1));
          const double expected = at.radius * pi_value / arms * std::sin(std::fabs(pitch) * degree);
          across = std::max(across, std::fabs(at.width / expected - 1));
          local = std::max(local, std::fabs(at.pitch / degree - pitch));
          uneven = std::max(uneven, at.amplitudes[0]);
        }
        EXPECT_EQ(list.size(), 8u);
        EXPECT_LT(contrast, blur);
        EXPECT_LT(width, 0.0048);
        EXPECT_LT(across, 0.0048);
        EXPECT_LT(local, 0.0065);
      }
    }
  }
}

/// Narrow arms, with a Gaussian of sigma 0.12 rad, have the FWHM 0.2826 rad. The light is 1 between
/// arms and 3 on their crests, so that the contrast is 2.5 log10(3).
TEST(SpiralFit, GaussianArms) {
  SpiralGalaxy galaxy;
  galaxy.pitch = 18;
  const double sigma = 0.12;
  const Image image = galaxy.image(
      [&](double theta) { return 1 + 2 * std::exp(-theta * theta / (2 * sigma * sigma)); });
  const PolarGrid grid = grid_of(40, 190);
  const Image map = polar_map(image, galaxy.disk(), grid);
  const SpiralFit fit = fit_spiral(map, grid);
  EXPECT_EQ(fit.strongest.arms, 2);
  EXPECT_NEAR(fit.strongest.pitch / degree, 18, 0.002);
  for (const ArmsAtRadius& at : arms_by_radius(map, grid, fit.strongest, 6)) {
    EXPECT_NEAR(at.width_azimuth, sigma * std::sqrt(8 * std::log(2)), 0.016);
    EXPECT_NEAR(at.contrast, 2.5 * std::log10(3), 0.04);
  }
}

/// The fit and its map work without the missing half of the image.
TEST(SpiralFit, MissingPixels) {
  SpiralGalaxy galaxy;
  Image image = galaxy.image([&](double theta) { return 1 + 0.5 * std::cos(2 * theta); });
  for (int y = 0; y < 401; ++y) {
    for (int x = 300; x < 330; ++x) image.at(x, y) = std::numeric_limits<double>::quiet_NaN();
  }
  const PolarGrid grid = grid_of(40, 190);
  const Image map = polar_map(image, galaxy.disk(), grid);
  EXPECT_TRUE(std::isnan(map.at(0, static_cast<int>(std::log(115 / 40.0) / grid.row_step()))));
  const SpiralFit fit = fit_spiral(map, grid);
  EXPECT_EQ(fit.strongest.arms, 2);
  EXPECT_NEAR(fit.strongest.pitch / degree, 15, 0.06);
  Image dark(401, 401, 1);
  try {
    fit_spiral(polar_map(dark, galaxy.disk(), grid), grid);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).substr(0, 45),
              "only 0 of 178 radii from 40 to 190 pixels hav");
  }
}

/// Bilinear samples follow the brightness 1000 + 3 x + 7 y exactly.
TEST(PolarMap, FollowsALinearImage) {
  Image image(101, 101, 1);
  for (int y = 0; y < 101; ++y) {
    for (int x = 0; x < 101; ++x) image.at(x, y) = 1000 + 3 * x + 7 * y;
  }
  const DiskPlane disk{50, 48, 60 * degree, 30 * degree};
  PolarGrid grid;
  grid.inner = 5;
  grid.outer = 40;
  grid.columns = 1440;
  grid.rows = 70;
  grid.is_logarithmic = false;
  EXPECT_EQ(grid.radius(0), 5);
  EXPECT_EQ(grid.radius(70), 40);
  const Image map = polar_map(image, disk, grid);
  for (const int row : {0, 33, 69}) {
    const double r = grid.radius(row + 0.5);
    for (const int column : {0, 200, 700, 1300}) {
      const double azimuth = (column + 0.5) * 2 * pi_value / 1440;
      const double u = r * std::cos(azimuth), v = r * std::sin(azimuth) / 2;
      const double x = 50 + u * std::sqrt(0.75) - v / 2, y = 48 + u / 2 + v * std::sqrt(0.75);
      EXPECT_NEAR(map.at(column, row), 1000 + 3 * x + 7 * y, 5e-13);
    }
  }
}

}  // namespace
}  // namespace gamer::spiral_fit_test
