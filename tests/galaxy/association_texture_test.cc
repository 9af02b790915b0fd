// Associations: that clumps are those of the class comment, and what they promise about light.

#include "galaxy/associations/association_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"

namespace gamer {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double z0 = 0.01;

AssociationParameters plain() {
  AssociationParameters p;
  p.kind = &simplex_noise();
  p.clustering = 0;
  p.diffuse = 0;
  return p;
}

/// Over a square of even density.
AssociationTexture texture(const AssociationParameters& p) {
  return AssociationTexture(p, SurfaceDensity{2, {1, 1, 1, 1}}, z0);
}

std::vector<double> phi(const AssociationTexture& associations,
                        const std::vector<Vector>& positions, double footprint = 0) {
  std::vector<double> result;
  for (std::size_t first = 0; first < positions.size(); first += batch_capacity) {
    BatchArray x{}, y{}, z{}, width, value;
    const std::size_t size = std::min(batch_capacity, positions.size() - first);
    for (std::size_t i = 0; i < size; ++i) {
      x[i] = static_cast<float>(positions[first + i][0]);
      y[i] = static_cast<float>(positions[first + i][1]);
      z[i] = static_cast<float>(positions[first + i][2]);
    }
    std::fill_n(width.data(), batch_capacity, static_cast<float>(footprint));
    std::uint64_t evaluations = 0;
    associations.evaluate({x.data(), y.data(), z.data(), size},
                          footprint > 0 ? width.data() : nullptr, nullptr, {}, std::span(&value, 1),
                          evaluations);
    result.insert(result.end(), value.data(), value.data() + size);
  }
  return result;
}

struct Clump {
  double x, y, z, radius;
  double height;  ///< of Phi at the centre
};

std::uint32_t mixed(std::uint32_t w) {
  w = (w ^ (w >> 16)) * 0x7feb352du;
  w = (w ^ (w >> 15)) * 0x846ca68bu;
  return w ^ (w >> 16);
}

/// All clumps of a level near the square, from docs/method.md alone; their density is even.
std::vector<Clump> clumps(const ClumpLevel& level) {
  std::vector<Clump> result;
  const double c = double{level.cosine} * double{level.cell};
  const double s = double{level.sine} * double{level.cell};
  const double cell{level.cell};
  const double p = std::min(double{level.occupancy} / 4, 1 / 1.3);
  const int reach = static_cast<int>(std::ceil(std::numbers::sqrt2 / cell)) + 1;
  const int shift_x = static_cast<int>(level.offset_x), shift_y = static_cast<int>(level.offset_y);
  for (int i = shift_x - reach; i <= shift_x + reach; ++i) {
    for (int j = shift_y - reach; j <= shift_y + reach; ++j) {
      const std::uint32_t along = static_cast<std::uint32_t>(j) * 0x85ebca77u + level.seed;
      const std::uint32_t word = mixed(static_cast<std::uint32_t>(i) * 0x9e3779b1u ^ mixed(along));
      const std::uint32_t again = mixed(word + 0x9e3779b9u);
      const double number = (again & 0xffff) / 65536.0;
      const double weight = std::clamp((1.3 - number / p) / 0.6, 0.0, 1.0);
      if (weight == 0) continue;
      const double u = i + (word & 0xffff) / 65536.0 - double{level.offset_x};
      const double v = j + (word >> 16) / 65536.0 - double{level.offset_y};
      const std::size_t k = again >> 23;
      result.push_back({cell * (c * u - s * v), cell * (s * u + c * v), double{level.height[k]},
                        1 / std::sqrt(double{level.inverse_square[k]}),
                        double{level.share} * weight * double{level.amplitude[k]} / p});
    }
  }
  return result;
}

std::vector<Clump> clumps(const AssociationTexture& associations) {
  std::vector<Clump> result;
  for (const ClumpLevel& level : associations.levels()) {
    const std::vector<Clump> own = clumps(level);
    result.insert(result.end(), own.begin(), own.end());
  }
  return result;
}

/// The light of a clump in the layer: the integral of Phi sech^2(z/z0), by the midpoint rule in z.
/// A slice of (1 - r^2/R^2)^n has the integral pi R^2 (1 - z^2/R^2)^(n + 1)/(n + 1).
double light_of(const Clump& clump) {
  constexpr int steps = 200;
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double t = 2 * (k + 0.5) / steps - 1;
    const double cosh = std::cosh((clump.z + clump.radius * t) / z0);
    sum += (std::pow(1 - t * t, 4) / 4 + 6 * std::pow(1 - t * t, 13) / 13) / (cosh * cosh);
  }
  return clump.height * pi * std::pow(clump.radius, 3) * sum * 2 / steps;
}

std::vector<Vector> places(std::size_t count, double height) {
  std::vector<Vector> result;
  for (std::size_t i = 0; i < count; ++i) {
    double u[3];
    R3Sequence().point(i, u);
    result.push_back({2 * u[0] - 1, 2 * u[1] - 1, height * (2 * u[2] - 1)});
  }
  return result;
}

TEST(AssociationTexture, IsTheSumOfItsClumps) {
  AssociationParameters p = plain();
  p.number = 5000;
  p.largest = 0.08;
  const AssociationTexture associations = texture(p);
  const std::vector<Clump> all = clumps(associations);
  const std::vector<Vector> positions = places(4000, 3 * z0);
  std::vector<double> expected;
  for (const Vector& at : positions) {
    double sum = 0;
    for (const Clump& clump : all) {
      const double dx = at[0] - clump.x, dy = at[1] - clump.y, dz = at[2] - clump.z;
      const double t = (dx * dx + dy * dy + dz * dz) / (clump.radius * clump.radius);
      if (t < 1) sum += clump.height * (std::pow(1 - t, 3) + 6 * std::pow(1 - t, 12));
    }
    expected.push_back(sum);
  }
  const double most = *std::max_element(expected.begin(), expected.end());
  for_each_simd_target([&] {
    const std::vector<double> found = phi(associations, positions);
    double worst = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      worst = std::max(worst, std::abs(found[i] - expected[i]));
    }
    EXPECT_LT(worst / most, 7e-5);
  });
}

// The numbers of clumps in bins of their light, of the exact light of the power law.
TEST(AssociationTexture, LightFollowsTheLuminosityFunction) {
  for (const double slope : {1.5, 2.0, 2.4}) {
    AssociationParameters p = plain();
    p.number = 20000;
    p.luminosity_slope = slope;
    p.luminosity_range = 1000;
    const AssociationTexture associations = texture(p);
    const auto integral = [&](double power, double from, double to) {
      return power == -1 ? std::log(to / from)
                         : (std::pow(to, power + 1) - std::pow(from, power + 1)) / (power + 1);
    };
    const double least = 1 / p.luminosity_range;
    const double mean = integral(1 - slope, least, 1) / integral(-slope, least, 1);
    const double brightest = 4 * 2 * z0 / p.number / mean;
    constexpr int bins = 15;
    std::vector<double> found(bins, 0.0);
    double total = 0;
    for (const Clump& clump : clumps(associations)) {
      if (std::abs(clump.x) > 1 || std::abs(clump.y) > 1) continue;
      const double light = light_of(clump) / brightest;
      total += light * brightest;
      const double u = bins * (1 + std::log(light) / std::log(p.luminosity_range));
      const int bin = static_cast<int>(std::floor(u));
      if (bin >= 0 && bin < bins) ++found[static_cast<std::size_t>(bin)];
    }
    double chi2 = 0;
    // Half-faded clumps have an even distribution of weights. They blur the cut-offs, and count as
    // the integral of w^(a - 1).
    const double faded = 0.7 + 0.6 / slope;
    for (int bin = 1; bin + 1 < bins; ++bin) {
      const double from = std::pow(p.luminosity_range, double(bin) / bins - 1);
      const double to = std::pow(p.luminosity_range, double(bin + 1) / bins - 1);
      const double expected =
          faded * p.number * integral(-slope, from, to) / integral(-slope, least, 1);
      const double off = found[static_cast<std::size_t>(bin)] - expected;
      chi2 += off * off / expected;
    }
    EXPECT_LT(chi2, 28) << slope;  // 1 % of chi-square of 13 degrees is above 27.7
    EXPECT_NEAR(total / (4 * 2 * z0), 1, 0.045) << slope;
  }
}

/// The mean of Phi over the square, at heights of even shares of sech^2(z/z0).
double mean_phi(const AssociationTexture& associations, double footprint) {
  std::vector<Vector> positions = places(std::size_t{1} << 18, 1);
  for (Vector& at : positions) at[2] = z0 * std::atanh(at[2]);
  double sum = 0;
  for (const double value : phi(associations, positions, footprint)) sum += value;
  return sum / static_cast<double>(positions.size());
}

// Before calibration, and whatever rays see.
TEST(AssociationTexture, MeanIsOneAtEveryFootprint) {
  constexpr int seeds = 16;
  constexpr double footprints[] = {0.0, 1e-3, 2e-3, 3e-3, 6e-3};
  double sums[std::size(footprints)] = {};
  for (int seed = 1; seed <= seeds; ++seed) {
    AssociationParameters p = plain();
    p.seed = static_cast<std::uint64_t>(seed);
    p.number = 5e4;
    p.largest = 0.02;
    p.luminosity_range = 30;
    p.complex_size = 0.01;
    p.clustering = 1;
    p.diffuse = 0.2;
    const AssociationTexture associations = texture(p);
    for (std::size_t k = 0; k < std::size(footprints); ++k) {
      sums[k] += mean_phi(associations, footprints[k]) / seeds;
    }
    EXPECT_EQ(mean_phi(associations, 1), 1);
  }
  for (const double mean : sums) EXPECT_NEAR(mean, 1, 0.006);
}

/// Galaxies of this text and three seeds emit what their amplitudes say.
void expect_light(const std::string& text, const LayerCells& cells, double tolerance) {
  std::vector<std::shared_ptr<const Galaxy>> galaxies;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    galaxies.push_back(parse_galaxy(text, settings_with(seed)));
  }
  const std::vector<double> light = integrate(galaxies, cells);
  for (std::size_t g = 0; g < galaxies.size(); ++g) {
    EXPECT_NEAR(light[g] / galaxies[g]->luminosity(0), 1, tolerance) << g;
  }
}

// A component emits what its amplitude says, whatever its seed.
TEST(AssociationTexture, KeepsTheLight) {
  const std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[component]]\nclass = \"associations\"\n"
      "sed = \"flat\"\nz0 = 0.01\narm_width = 4\nnumber = 1e4\nluminosity_range = 100\n";
  expect_light(text, {0.01, 800, 1600, 16}, 0.005);
}

// A few giant clumps have most of the light, and a cloud of points misses their cores.
TEST(AssociationTexture, KeepsTheLightOfFewClumps) {
  const std::string text =
      "[[component]]\nclass = \"associations\"\nsed = \"flat\"\nz0 = 0.025\nrh = 0.2\n"
      "break_radius = 0.6\nouter_rh = 0.12\nlopsidedness = 0.55\nnumber = 500\n"
      "largest = 0.085\nluminosity_slope = 1.75\nluminosity_range = 2000\n"
      "complex_size = 0.18\nclustering = 1.3\n";
  expect_light(text, {0.025, 800, 1600, 32}, 0.025);
}

// From frame to frame of a zoom nothing appears at once.
TEST(AssociationTexture, FadesWithTheFootprint) {
  AssociationParameters p = plain();
  p.clustering = 1;
  const AssociationTexture associations = texture(p);
  const std::vector<Vector> positions = places(2000, z0);
  constexpr double ratio = 1.01;
  std::vector<double> before = phi(associations, positions, 1e-5), least = before, most = before;
  std::vector<double> step(positions.size(), 0.0);
  for (double footprint = 1e-5; footprint < 1; footprint *= ratio) {
    const std::vector<double> now = phi(associations, positions, footprint);
    for (std::size_t i = 0; i < now.size(); ++i) {
      step[i] = std::max(step[i], std::abs(now[i] - before[i]));
      least[i] = std::min(least[i], now[i]);
      most[i] = std::max(most[i], now[i]);
    }
    before = now;
  }
  // Steps of 1 % change Phi by a small part of its range at this point.
  double worst = 0;
  for (std::size_t i = 0; i < step.size(); ++i) {
    if (most[i] - least[i] > 0.1) worst = std::max(worst, step[i] / (most[i] - least[i]));
  }
  EXPECT_LT(worst, 0.06);
}

}  // namespace
}  // namespace gamer
