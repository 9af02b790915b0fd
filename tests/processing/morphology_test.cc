#include "processing/morphology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "galaxy_images.h"
#include "gamer/core/error.h"
#include "processing/gini_m20.h"
#include "processing/segmentation.h"
#include "processing/smoothing.h"

namespace gamer::morphology_test {
namespace {

constexpr double pi_value = std::numbers::pi;
constexpr double re = 50;  ///< effective radius of the disks, pixels
constexpr int side = 401;
constexpr double centre_x = 200.3, centre_y = 199.6;

double radius_at(double x, double y) { return std::hypot(x - centre_x, y - centre_y); }

Image round_galaxy(const std::vector<SersicProfile>& parts) {
  std::vector<std::function<double(double)>> profiles;
  for (const SersicProfile& part : parts) profiles.push_back(part.profile());
  return drawn_image(
      side, side,
      [&](double x, double y) {
        double sum = 0;
        for (const auto& profile : profiles) sum += profile(radius_at(x, y));
        return sum;
      },
      centre_x, centre_y);
}

/// Options without sky noise, since the corners hold the galaxy's outskirts.
MorphologyOptions no_noise() {
  MorphologyOptions options;
  options.sky_sigma = 0;
  return options;
}

/// Values of the profiles without pixels, by SciPy 1.10: the ratio of the Petrosian radius to re by
/// brentq, C by gammainc, G and M20 of the circle within it by quad.
struct Expected {
  std::vector<SersicProfile> parts;
  double petrosian, concentration, gini, m20;
  double asymmetry = 0.001;  ///< limit; cubic convolution does not follow a cusp within a pixel
};

TEST(Morphology, SersicProfilesAndBulges) {
  const double h = re / 1.67834699;
  const std::vector<Expected> cases = {
      {{{1, 0.5, re}}, 1.95912 * re, 2.14152, 0.39859, -1.60476},
      {{{1, 1, re}}, 2.15830 * re, 2.73600, 0.48923, -1.81614},
      {{{1, 2, re}}, 2.19558 * re, 3.47727, 0.55612, -2.11195},
      {{{1, 4, re}}, 1.82037 * re, 4.28623, 0.60059, -2.47179, 0.006},
      {{{0.95, 1, re}, {0.05, 1, 0.2 * h}}, 3.51606 * h, 3.01616, 0.50583, -2.00508},
      {{{0.9, 1, re}, {0.1, 1.5, 0.25 * h}}, 3.40059 * h, 3.27346, 0.52072, -2.12837},
      {{{0.75, 1, re}, {0.25, 4, 0.3 * h}}, 3.10384 * h, 3.94495, 0.55170, -2.50062, 0.012},
      {{{0.6, 1, re}, {0.4, 3, 0.3 * h}}, 2.55412 * h, 4.65780, 0.59390, -2.69658, 0.012}};
  for (const Expected& expected : cases) {
    SCOPED_TRACE(testing::Message() << expected.parts.size() << " n " << expected.parts.back().n
                                    << " f " << expected.parts.back().flux);
    const Morphology found = morphology(round_galaxy(expected.parts), no_noise());
    EXPECT_NEAR(found.x, centre_x, 0.014);
    EXPECT_NEAR(found.y, centre_y, 0.014);
    EXPECT_NEAR(found.petrosian / expected.petrosian, 1, 2e-4);
    EXPECT_NEAR(found.petrosian_major / expected.petrosian, 1, 2e-4);
    EXPECT_NEAR(found.concentration, expected.concentration, 0.009);
    EXPECT_NEAR(found.gini, expected.gini, 2.2e-4);
    EXPECT_NEAR(found.m20, expected.m20, 0.006);
    EXPECT_NEAR(found.asymmetry, 0, expected.asymmetry);
  }
}

/// Along its major axis, an inclined disk has the Petrosian radius of the face-on disk. The round
/// Gaussian widens the segmentation; expected G and M20 are by SciPy's gaussian_filter.
TEST(Morphology, InclinedDisk) {
  const SersicProfile disk{1, 1, re};
  const auto profile = disk.profile();
  const double ratio = 0.5, turn = 0.6;
  const Image image = drawn_image(
      side, side,
      [&](double x, double y) {
        const double u = std::cos(turn) * (x - centre_x) + std::sin(turn) * (y - centre_y);
        const double v = std::cos(turn) * (y - centre_y) - std::sin(turn) * (x - centre_x);
        return profile(std::hypot(u, v / ratio));
      },
      centre_x, centre_y);
  const Morphology found = morphology(image, no_noise());
  EXPECT_NEAR(found.axis_ratio, ratio, 1e-4);
  EXPECT_NEAR(found.angle, turn, 1e-4);
  EXPECT_NEAR(found.petrosian_major / (2.15830 * re), 1, 1e-4);
  EXPECT_NEAR(found.gini, 0.49416, 2e-5);
  EXPECT_NEAR(found.m20, -1.78947, 7e-4);
  EXPECT_NEAR(found.asymmetry, 0, 9e-4);
}

/// A disk with a narrow Gaussian clump far from the centre has sum|I - I180| equal to twice the
/// clump's flux.
TEST(Morphology, AsymmetryOfAnOffsetClump) {
  const SersicProfile disk{1, 1, re};
  const auto profile = disk.profile();
  const double share = 0.08, sigma = 6, clump_x = centre_x + 55, clump_y = centre_y + 30;
  const Image image = drawn_image(
      side, side,
      [&](double x, double y) {
        const double distance2 = (x - clump_x) * (x - clump_x) + (y - clump_y) * (y - clump_y);
        return profile(radius_at(x, y)) +
               share / (2 * pi_value * sigma * sigma) * std::exp(-distance2 / (2 * sigma * sigma));
      },
      centre_x, centre_y);
  const Morphology found = morphology(image, no_noise());
  EXPECT_NEAR(found.x, centre_x, 0.006);
  EXPECT_NEAR(found.y, centre_y, 0.006);
  const double light = disk.within(1.5 * found.petrosian) + share;
  EXPECT_NEAR(found.asymmetry, 2 * share / light, 6e-5);
}

/// The mean of a Gaussian over a box is a product of differences of error functions.
TEST(Morphology, SmoothnessOfAGaussian) {
  const double sigma = 40;
  const Image image = drawn_image(
      side, side,
      [&](double x, double y) {
        const double r = radius_at(x, y) / sigma;
        return std::exp(-r * r / 2);
      },
      centre_x, centre_y);
  const Morphology found = morphology(image, no_noise());
  const double rp = found.petrosian;
  const auto smoothness = [&](double inner, double width) {
    const auto mean = [&](double x) {
      const double root = std::sqrt(2) * sigma;
      return std::sqrt(pi_value / 2) * sigma / width *
             (std::erf((x + width / 2) / root) - std::erf((x - width / 2) / root));
    };
    double clumps = 0, light = 0;
    const int steps = 4000, turns = 64;
    for (int i = 0; i < steps; ++i) {
      const double r = inner + (1.5 * rp - inner) * (i + 0.5) / steps;
      for (int j = 0; j < turns; ++j) {
        const double x = r * std::cos(2 * pi_value * j / turns);
        const double y = r * std::sin(2 * pi_value * j / turns);
        const double value = std::exp(-r * r / (2 * sigma * sigma));
        clumps += r * std::max(0.0, value - mean(x) * mean(y));
        light += r * value;
      }
    }
    return clumps / light;
  };
  EXPECT_NEAR(found.smoothness, 10 * smoothness(0.075 * rp, 0.3 * rp), 6e-4);
  EXPECT_NEAR(found.smoothness_lotz, smoothness(0.25 * rp, 0.25 * rp), 1.6e-5);
}

/// Noise adds nothing to A on average. To S, a pixel that is d above its neighbourhood adds E
/// max(0, d + n) for noise n of sigma s. This is d P(d/s) + s p(d/s), with the normal
/// distribution's P and density p.
TEST(Morphology, NoiseIsSubtracted) {
  const Image clean = round_galaxy({{4e5, 1, 30}});
  const Morphology without = morphology(clean, no_noise());
  Image noisy = clean;
  std::mt19937 generator(5);
  std::normal_distribution<double> noise(0, 1);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) noisy.at(x, y) += noise(generator);
  }
  const Image smooth = box_mean(clean, 0.3 * without.petrosian);
  double clumps = 0, light = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double r = radius_at(x, y) / without.petrosian;
      if (r < 0.075 || r > 1.5) continue;
      const double d = clean.at(x, y) - smooth.at(x, y);
      const double density = std::exp(-d * d / 2) / std::sqrt(2 * pi_value);
      clumps += d * std::erfc(-d / std::sqrt(2)) / 2 + density - 1 / std::sqrt(2 * pi_value);
      light += clean.at(x, y);
    }
  }
  MorphologyOptions white;
  white.sky_sigma = 1;
  for (const MorphologyOptions& options : {MorphologyOptions{}, white}) {
    const Morphology found = morphology(noisy, options);
    EXPECT_NEAR(found.sky_sigma, 1, 0.016);
    EXPECT_NEAR(found.asymmetry_sky, 0.0755, 0.002);
    EXPECT_NEAR(found.asymmetry, 0, 0.002);
    EXPECT_NEAR(found.smoothness, 10 * clumps / light, 0.0055);
  }
}

TEST(Gini, OfSimpleLists) {
  EXPECT_EQ(gini({3, 3, 3, 3}), 0);
  EXPECT_EQ(gini({0, 0, 5, 0}), 1);
  // Values 1 ... n: G = sum (2 i - n - 1) i / ((n - 1) n (n + 1)/2) = 1/3.
  EXPECT_NEAR(gini({-4, 2, 1, 3, 5}), 1.0 / 3, 1e-15);
}

TEST(M20, OfFivePixels) {
  // The brightest pixel, at the centroid, has half of the light, so that the brightest 20 % have no
  // moment.
  const std::vector<LitPixel> cross = {{0, 0, 4}, {1, 0, 1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, 1}};
  EXPECT_EQ(m20(cross), -std::numeric_limits<double>::infinity());
  // The two brightest pixels are at the ends, with 1/4 of the light each; the brightest 1/5 has the
  // moment 4/20 of 9 over 4 (9 + 1)/8.
  const std::vector<LitPixel> line = {{-3, 0, 2}, {3, 0, 2}, {-1, 0, 2}, {1, 0, 2}};
  EXPECT_NEAR(m20(line), std::log10(0.2 * 9 / (0.5 * 9 + 0.5 * 1)), 1e-15);
}

TEST(MidStatistics, OfTwoGaussians) {
  // The Gaussians, of flux 1 and 0.4, are so far apart that each basin holds one.
  const int width = 120, height = 60;
  const double sigma = 5;
  const auto gaussian = [&](double x, double y, double px, double py) {
    return std::exp(-((x - px) * (x - px) + (y - py) * (y - py)) / (2 * sigma * sigma));
  };
  const Image image = drawn_image(
      width, height,
      [&](double x, double y) { return gaussian(x, y, 35, 30) + 0.4 * gaussian(x, y, 85, 30); },
      -100, -100);
  const std::vector<bool> galaxy(static_cast<std::size_t>(width) * height, true);
  const MidStatistics found = mid_statistics(image, galaxy);
  EXPECT_NEAR(found.intensity, 0.4, 1e-6);
  const double offset = 50 * 0.4 / 1.4;
  EXPECT_NEAR(found.deviation, offset / std::sqrt(width * height / pi_value), 1e-6);
  // Above the level t, a Gaussian of peak p has a piece of the area 2 pi sigma^2 ln(p/t). The
  // quantile q leaves (1 - q) n pixels to both pieces; the ratio is largest while they are apart.
  double best = 0;
  for (int q = 0; q < 50; ++q) {
    const double both = (1 - q / 50.0) * width * height;
    const double mean = both / (4 * pi_value * sigma * sigma);
    const double half = std::log(1 / 0.4) / 2;
    // The circles of both Gaussians touch where their radii add up to the distance, or leave the
    // image.
    const double first = std::sqrt(2 * (mean + half)) * sigma;
    if (mean > half && first < 25) best = std::max(best, (mean - half) / (mean + half));
  }
  EXPECT_NEAR(found.multimode, best, 0.0014);
}

TEST(ConnectedPieces, TouchAtCorners) {
  const std::vector<bool> inside = {true,  false, false, true,   //
                                    false, true,  false, false,  //
                                    false, false, false, true};
  const Pieces pieces = connected_pieces(inside, 4, 3);
  ASSERT_EQ(pieces.sizes, (std::vector<std::size_t>{2, 1, 1}));
  EXPECT_EQ(pieces.labels[0], pieces.labels[5]);
  EXPECT_EQ(pieces.labels[1], 0);
}

std::string error_of(const Image& image, const MorphologyOptions& options) {
  try {
    morphology(image, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(Morphology, RefusesWhatIsNoGalaxy) {
  Image flat(60, 50, 1);
  EXPECT_EQ(error_of(flat, {}), "no galaxy: no pixel has light above the sky");
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 60; ++x) flat.at(x, y) = 1;
  }
  MorphologyOptions middle;
  middle.x = 30;
  middle.y = 25;
  EXPECT_EQ(error_of(flat, middle),
            "the Petrosian radius lies beyond the frame: at 24 pixels from pixel (31, 26), the "
            "image's edge, the brightness is still 1 of the mean inside, not 0.2");
  Image noise(200, 200, 1);
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) noise.at(x, y) = normal(generator);
  }
  MorphologyOptions there;
  there.x = there.y = 100;
  const std::string text = error_of(noise, there);
  EXPECT_TRUE(text.starts_with("no galaxy: the light ")) << text;
  Image missing = round_galaxy({{1, 1, 30}});
  missing.at(210, 180) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(missing, {}),
            "pixel (211, 181) has no value, but lies within 1.5 Petrosian radii of the galaxy");
  const std::string wide = error_of(round_galaxy({{1, 1, 80}}), no_noise());
  EXPECT_TRUE(wide.starts_with("the circle of 1.5 Petrosian radii, 259 pixels about pixel (201.2"))
      << wide;
}

}  // namespace
}  // namespace gamer::morphology_test
