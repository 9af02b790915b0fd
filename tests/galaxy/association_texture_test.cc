// Clumps of associations are those of docs/method.md, and keep the light of their component.

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

namespace gamer::association_texture_test {
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

/// A texture over a square of even density.
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
  double cosine, sine;         ///< of the lattice's angle
  double halo, cavity, cores;  ///< heights of Phi, and the depth
  double bends;
  std::uint32_t shape;
};

std::uint32_t mixed(std::uint32_t w) {
  w = (w ^ (w >> 16)) * 0x7feb352du;
  w = (w ^ (w >> 15)) * 0x846ca68bu;
  return w ^ (w >> 16);
}

/// All clumps of a tier near the square, from docs/method.md alone; their density is even.
std::vector<Clump> clumps(const ClumpTier& tier) {
  std::vector<Clump> result;
  const double c = double{tier.cosine} * double{tier.cell};
  const double s = double{tier.sine} * double{tier.cell};
  const double cell{tier.cell};
  const double p = std::min(double{tier.occupancy} / 4, 1 / 1.3);
  const int reach = static_cast<int>(std::ceil(std::numbers::sqrt2 / cell)) + 1;
  const int shift_x = static_cast<int>(tier.offset_x), shift_y = static_cast<int>(tier.offset_y);
  for (int i = shift_x - reach; i <= shift_x + reach; ++i) {
    for (int j = shift_y - reach; j <= shift_y + reach; ++j) {
      const std::uint32_t along = static_cast<std::uint32_t>(j) * 0x85ebca77u + tier.seed;
      const std::uint32_t word = mixed(static_cast<std::uint32_t>(i) * 0x9e3779b1u ^ mixed(along));
      const std::uint32_t again = mixed(word + 0x9e3779b9u);
      const double number = (again & 0xffff) / 65536.0;
      const double weight = std::clamp((1.3 - number / p) / 0.6, 0.0, 1.0);
      if (weight == 0) continue;
      const double u = i + (word & 0xffff) / 65536.0 - double{tier.offset_x};
      const double v = j + (word >> 16) / 65536.0 - double{tier.offset_y};
      const std::size_t k = again >> 23;
      const double height = double{tier.share} * weight / p;
      result.push_back({cell * (c * u - s * v), cell * (s * u + c * v), double{tier.height[k]},
                        1 / double{tier.inverse_radius[k]}, c, s, height * double{tier.halo[k]},
                        double{tier.cavity[k]}, height * double{tier.cores[k]}, double{tier.bends},
                        mixed(again + 0x9e3779b9u)});
    }
  }
  return result;
}

std::vector<Clump> clumps(const AssociationTexture& associations) {
  std::vector<Clump> result;
  for (const ClumpTier& tier : associations.tiers()) {
    const std::vector<Clump> own = clumps(tier);
    result.insert(result.end(), own.begin(), own.end());
  }
  return result;
}

double cube(double rest) { return rest > 0 ? rest * rest * rest : 0; }

double wave(double x) {
  const double f = x - std::round(x);
  return 8 * f * (1 - 2 * std::abs(f));
}

/// Phi of a clump at a point, from docs/method.md alone.
double phi_of(const Clump& clump, const Vector& at) {
  const double dx = (at[0] - clump.x) / clump.radius, dy = (at[1] - clump.y) / clump.radius;
  const double z = (at[2] - clump.z) / clump.radius;
  if (std::abs(z) > 1 || std::hypot(dx, dy) > 3) return 0;
  double x = clump.cosine * dx + clump.sine * dy, y = clump.cosine * dy - clump.sine * dx;
  double b[4];
  for (int k = 0; k < 4; ++k) b[k] = ((clump.shape >> (8 * k)) & 0xff) / 256.0;
  x += clump.bends * 0.2 * wave(0.4 * y + b[0] + 0.3 * z);
  y += clump.bends * 0.2 * wave(0.4 * x + b[1] - 0.3 * z);
  x += clump.bends * 0.06 * wave(1.1 * y + b[2]);
  y += clump.bends * 0.06 * wave(1.1 * x + b[3]);
  const double plane = 1 - x * x - y * y;
  const double halo = cube(plane - z * z) * (1 - clump.cavity * plane * plane) *
                      (1 + 0.6 * (2 * b[1] - 1) * x + 0.6 * (2 * b[3] - 1) * y);
  const double core_x = 0.35 * (2 * b[0] - 1), core_y = 0.35 * (2 * b[2] - 1);
  const auto core = [&](double u, double v) {
    return cube(1 - ((x - u) * (x - u) + (y - v) * (y - v) + z * z) / (0.6 * 0.6));
  };
  return clump.halo * halo + clump.cores * (core(core_x, core_y) + 0.5 * core(-core_y, core_x));
}

/// The light of a clump in the layer: the integral of Phi sech^2(z/z0), by the midpoint rule in z.
/// Slices of q^3 and q^3 Q^2 are integrals over Q; waves and tilts change nothing.
double light_of(const Clump& clump) {
  constexpr int steps = 200;
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double t = 2 * (k + 0.5) / steps - 1;
    const auto layer = [&](double size) {
      const double cosh = std::cosh((clump.z + size * clump.radius * t) / z0);
      return 1 / (cosh * cosh);
    };
    const double rest = 1 - t * t;
    const double hole =
        std::pow(rest, 4) * (rest * rest / 6 + 2 * t * t * rest / 5 + std::pow(t, 4) / 4);
    const double ball = std::pow(rest, 4) / 4;
    sum += clump.halo * (ball - clump.cavity * hole) * layer(1) +
           clump.cores * 1.5 * std::pow(0.6, 3) * ball * layer(0.6);
  }
  return pi * std::pow(clump.radius, 3) * sum * 2 / steps;
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
  p.largest = 0.1;
  p.size_scatter = 0.1;
  const AssociationTexture associations = texture(p);
  const std::vector<Clump> all = clumps(associations);
  const std::vector<Vector> positions = places(4000, 3 * z0);
  std::vector<double> expected;
  for (const Vector& at : positions) {
    double sum = 0;
    for (const Clump& clump : all) sum += phi_of(clump, at);
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

// The numbers of clumps in bins of their light follow the power law.
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

/// The light of a clump, by the midpoint rule over its box: waves and tilts count.
double integral_of(const Clump& clump) {
  constexpr int steps = 72;
  const double reach = 1.3;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      for (int k = 0; k < steps; ++k) {
        const double x = reach * (2 * (i + 0.5) / steps - 1);
        const double y = reach * (2 * (j + 0.5) / steps - 1);
        const double z = clump.z + clump.radius * (2 * (k + 0.5) / steps - 1);
        const Vector at{clump.x + clump.radius * (clump.cosine * x - clump.sine * y),
                        clump.y + clump.radius * (clump.sine * x + clump.cosine * y), z};
        const double cosh = std::cosh(z / z0);
        sum += phi_of(clump, at) / (cosh * cosh);
      }
    }
  }
  return sum * std::pow(2 * clump.radius / steps, 3) * reach * reach;
}

// Bent, tilted and hollow clumps emit their luminosity.
TEST(AssociationTexture, ShapesKeepTheLight) {
  AssociationParameters p = plain();
  p.number = 300;
  p.largest = 0.2;
  p.cavity = 0.95;
  const std::vector<Clump> all = clumps(texture(p));
  ASSERT_GT(all.size(), 20u);
  for (std::size_t k = 0; k < 20; ++k) {
    const double light = light_of(all[k]);
    EXPECT_NEAR(integral_of(all[k]) / light, 1, 3e-6) << k;
  }
}

// Components of one seed have the same clumps at the same places, and each clump has one age.
TEST(AssociationTexture, AgesShareOutTheClumps) {
  AssociationParameters p = plain();
  p.cavity = 0;
  p.cores = 0;
  const AssociationTexture whole = texture(p);
  p.age_range = 0.3;
  const AssociationTexture young = texture(p);
  p.age = 0.7;
  const AssociationTexture old = texture(p);
  const std::vector<Clump> all = clumps(whole), first = clumps(young), last = clumps(old);
  ASSERT_EQ(first.size(), all.size());
  ASSERT_EQ(last.size(), all.size());
  std::size_t of_first = 0, of_last = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_EQ(first[k].x, all[k].x);
    EXPECT_EQ(last[k].y, all[k].y);
    EXPECT_TRUE(first[k].halo == 0 || last[k].halo == 0);
    of_first += first[k].halo > 0 ? 1 : 0;
    of_last += last[k].halo > 0 ? 1 : 0;
  }
  // Each range of 0.3, with the fading 0.2 next to it, is half of all ages.
  EXPECT_NEAR(static_cast<double>(of_first) / static_cast<double>(all.size()), 0.5, 0.006);
  EXPECT_NEAR(static_cast<double>(of_last) / static_cast<double>(all.size()), 0.5, 0.006);
}

/// The mean of Phi over the square, at heights of even shares of sech^2(z/z0).
double mean_phi(const AssociationTexture& associations, double footprint) {
  std::vector<Vector> positions = places(std::size_t{1} << 18, 1);
  for (Vector& at : positions) at[2] = z0 * std::atanh(at[2]);
  double sum = 0;
  for (const double value : phi(associations, positions, footprint)) sum += value;
  return sum / static_cast<double>(positions.size());
}

// The mean of Phi is 1 before calibration, at every footprint.
TEST(AssociationTexture, MeanIsOneAtEveryFootprint) {
  constexpr int seeds = 64;
  constexpr double footprints[] = {0.0, 1e-3, 2e-3, 3e-3, 6e-3};
  double sums[std::size(footprints)] = {};
  for (int seed = 1; seed <= seeds; ++seed) {
    AssociationParameters p = plain();
    p.seed = static_cast<std::uint64_t>(seed);
    p.number = 5e4;
    p.largest = 0.03;
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
  for (const double mean : sums) EXPECT_NEAR(mean, 1, 0.0047);
}

/// Checks that galaxies of this text and three seeds emit the light of their amplitudes.
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

// A component emits the light of its amplitude, whatever its seed.
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

// The points of a cloud may all lie between the clumps.
TEST(AssociationTexture, KeepsTheLightOfClumpsThatACloudMisses) {
  const std::string text =
      "[[component]]\nclass = \"associations\"\nsed = \"flat\"\nz0 = 0.01\nrh = 0.2\nnumber = 8\n"
      "largest = 0.03\nluminosity_range = 1\ndiffuse = 0\n";
  expect_light(text, {0.01, 1000, 2000, 16}, 0.02);
}

// Phi changes slowly with the footprint, so that no clump appears suddenly in a zoom.
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
}  // namespace gamer::association_texture_test
