// Statistics of the base noises over space: moments, bounds, smoothness, isotropy, no period.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "noise/evaluate.h"

namespace gamer::statistics_test {
namespace {

constexpr double pi = std::numbers::pi;

std::string name_of(const Noise& noise) { return std::string(noise.name()); }

/// Positions so far apart that values are nearly independent.
const std::vector<Vector>& independent_points() {
  static const std::vector<Vector> positions = positions_in_cube(1 << 21, 1024, 4);
  return positions;
}

double variance_by_definition(const Noise& noise) {
  if (name_of(noise) == "perlin") return 35054270.0 / 480729249.0;  // docs/facts.md section 7
  if (name_of(noise) == "value") return std::pow(181.0 / 231, 3) / 3;
  if (name_of(noise) == "cell") return 1.0 / 3;
  // Simplex noise has 2 lattice points per unit volume, and <(g . r)^2> = 2 r^2/3. The variance is
  // therefore scale^2 2 (2/3) int (1/2 - r^2)^8 r^2 d^3r, where the integral is 2 pi 2^-10.5 B(5/2,
  // 9).
  if (name_of(noise) == "simplex") {
    return 76.8857 * 76.8857 * 2 * (2.0 / 3) * 2 * pi * std::pow(2, -10.5) * std::tgamma(2.5) *
           std::tgamma(9) / std::tgamma(11.5);
  }
  throw std::logic_error("unknown variance of noise '" + name_of(noise) + "'");
}

TEST(BaseNoise, Moments) {
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    double sums[5] = {};
    for (const double v : evaluate(*noise, independent_points(), 21)) {
      for (int power = 1; power <= 4; ++power) sums[power] += std::pow(v, power);
    }
    const auto count = static_cast<double>(independent_points().size());
    const double variance = sums[2] / count;
    EXPECT_NEAR(noise->variance(), variance_by_definition(*noise), 1e-6);
    EXPECT_NEAR(variance, noise->variance(), 0.002 * noise->variance());
    EXPECT_NEAR(sums[1] / count, 0, 4 * std::sqrt(variance / count));
    EXPECT_NEAR(sums[3] / count, 0, 0.01 * std::pow(variance, 1.5));
    if (name_of(*noise) == "simplex") {
      EXPECT_NEAR(std::sqrt(variance), 0.3925, 5e-4);  // docs/facts.md section 7
    }
    if (name_of(*noise) == "perlin") {
      EXPECT_NEAR(sums[4] / count / (variance * variance), 2.54, 0.005);
    }
  }
}

TEST(BaseNoise, PerlinMagnitudes) {
  double sum = 0;
  double above_half = 0;
  for (const float v : evaluate(perlin_noise(), independent_points(), 23)) {
    sum += std::abs(v);
    above_half += std::abs(v) > 0.5f ? 1 : 0;
  }
  const auto count = static_cast<double>(independent_points().size());
  EXPECT_NEAR(sum / count, 0.2202, 3e-4);
  EXPECT_NEAR(above_half / count, 0.058, 5e-4);
}

std::vector<Vector> lattice_points(std::size_t count) {
  std::vector<Vector> positions = positions_in_cube(count, 1024, 14);
  for (Vector& p : positions) {
    for (double& c : p) c = std::floor(c);
  }
  return positions;
}

TEST(BaseNoise, BoundHoldsAndIsTight) {
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    for (const float v : evaluate(*noise, independent_points(), 22)) {
      ASSERT_LE(std::abs(v), noise->bound());
    }
    if (name_of(*noise) == "value" || name_of(*noise) == "cell") {
      // The largest number at a lattice point.
      const std::vector<float> lattice = evaluate(*noise, lattice_points(1 << 16), 22);
      EXPECT_GT(*std::max_element(lattice.begin(), lattice.end()), 1 - 2e-4f);
      EXPECT_LT(*std::min_element(lattice.begin(), lattice.end()), -1 + 2e-4f);
      continue;
    }
    // The largest value for any choice of gradients: the best point of a grid, then steps uphill.
    Vector best{};
    double largest = 0;
    const auto visit = [&](const Vector& p) {
      const double value = reference::evaluate(name_of(*noise), p, reference::steepest_gradient);
      if (value > largest) {
        largest = value;
        best = p;
      }
    };
    constexpr int steps = 40;
    for (int i = 0; i < steps * steps * steps; ++i) {
      visit({(i % steps) / double{steps}, (i / steps % steps) / double{steps},
             (i / steps / steps) / double{steps}});
    }
    for (double step = 0.5 / steps; step > 1e-6; step *= 0.7) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
          Vector p = best;
          p[axis] += sign * step;
          visit(p);
        }
      }
    }
    EXPECT_LE(largest, noise->bound());
    EXPECT_GT(largest, noise->bound() - 1e-4);
  }
}

TEST(BaseNoise, CellsHaveOneEvenlyDistributedNumber) {
  Octave octave;
  octave.seed = 9;
  const std::vector<Vector> corners = lattice_points(1 << 18);
  std::vector<Vector> inside = corners;
  Random random(15);
  for (Vector& p : inside) {
    for (double& c : p) c += std::floor(4096 * random.unit()) / 4096;
  }
  const auto numbers = evaluate_vector(cell_noise(), corners, {&octave, 1}, 3);
  EXPECT_EQ(evaluate_vector(cell_noise(), inside, {&octave, 1}, 3), numbers);
  for (const std::vector<float>& component : numbers) {
    constexpr std::size_t bins = 64;
    std::vector<double> counts(bins);
    for (const float number : component) {
      counts[std::min(static_cast<std::size_t>((double{number} + 1) / 2 * bins), bins - 1)] += 1;
    }
    const double expected = static_cast<double>(component.size()) / bins;
    double chi_square = 0;
    for (const double count : counts) chi_square += std::pow(count - expected, 2) / expected;
    EXPECT_LT((chi_square - (bins - 1)) / std::sqrt(2.0 * (bins - 1)), 4);
  }
}

TEST(BaseNoise, PerlinIsZeroAtLatticePoints) {
  Random random(6);
  std::vector<Vector> lattice;
  for (int i = 0; i < 1000; ++i) {
    Vector p = random.position(i % 2 == 0 ? 8 : 32768);
    for (double& c : p) c = std::floor(c);
    lattice.push_back(p);
  }
  for (const float v : evaluate(perlin_noise(), lattice, 24)) ASSERT_EQ(v, 0.0f);
}

TEST(BaseNoise, SimplexIsZeroAtLatticePoints) {
  Random random(7);
  std::vector<Vector> lattice;
  for (int i = 0; i < 1000; ++i) {
    Vector p = random.position(8);
    for (double& c : p) c = std::floor(c);
    const double unskew = (p[0] + p[1] + p[2]) / 6;
    for (double& c : p) c -= unskew;
    lattice.push_back(p);
  }
  for (const float v : evaluate(simplex_noise(), lattice, 24)) ASSERT_NEAR(v, 0, 4e-6);
}

// A jump J of the gradient anywhere on a line would show as a second difference J/h, and a jump of
// the value as more. The true second derivative is at most 44.2 (simplex) and 12 (Perlin). For
// value noise it is at most 2 (10/sqrt 3), where numbers change from -1 to 1 along the axis. Cell
// noise jumps.
TEST(BaseNoise, ValueAndGradientAreContinuousAcrossFaces) {
  constexpr double h = 1.0 / 512;
  constexpr int size = 2048;
  const std::map<std::string, double> largest_curvature = {
      {"simplex", 50}, {"perlin", 14}, {"value", 16}};
  for (const Noise* noise : noise_kinds()) {
    if (name_of(*noise) == "cell") continue;
    SCOPED_TRACE(noise->name());
    Random random(5);
    double worst = 0;
    for (int line = 0; line < 400; ++line) {
      const Vector start = random.position(4);
      Vector direction = random.position(1);
      if (line % 3 == 0)
        direction = {line % 9 == 0 ? 1.0 : 0, line % 9 == 3 ? 1.0 : 0, line % 9 == 6 ? 1.0 : 0};
      const double length = std::sqrt(reference::dot(direction, direction));
      std::vector<Vector> positions(size);
      for (int i = 0; i < size; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          positions[i][axis] = start[axis] + direction[axis] / length * h * i;
        }
      }
      const std::vector<float> v = evaluate(*noise, positions, 3);
      for (int i = 1; i + 1 < size; ++i) {
        worst = std::max(worst, std::abs(double{v[i - 1]} - 2.0 * v[i] + v[i + 1]) / (h * h));
      }
    }
    EXPECT_LT(worst, largest_curvature.at(name_of(*noise)));
  }
}

/// The shares of power in bands of frequency along lines of one direction, and the rms frequency.
struct LineSpectrum {
  static constexpr double band_ends[] = {0.25, 0.5, 1.0, 1.5};  // cycles per cell
  double shares[4] = {};
  double rms_frequency = 0;
};

LineSpectrum spectrum_along(const Noise& noise, Vector direction) {
  constexpr int size = 128;
  constexpr int lines = 16000;
  constexpr double spacing = 0.125;
  constexpr int frequencies = 33;  // up to 2 cycles per cell
  const double length = std::sqrt(reference::dot(direction, direction));
  std::vector<double> power(frequencies);
  std::vector<double> cosines(frequencies * size);
  std::vector<double> sines(frequencies * size);
  for (int f = 0; f < frequencies; ++f) {
    for (int i = 0; i < size; ++i) {
      const double hann = 0.5 - 0.5 * std::cos(2 * pi * (i + 0.5) / size);
      cosines[i * frequencies + f] = hann * std::cos(2 * pi * f * i / size);
      sines[i * frequencies + f] = hann * std::sin(2 * pi * f * i / size);
    }
  }
  Random random(9);
  std::vector<Vector> positions(size);
  for (int line = 0; line < lines; ++line) {
    const Vector start = random.position(512);
    for (int i = 0; i < size; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        positions[i][axis] = start[axis] + direction[axis] / length * spacing * i;
      }
    }
    const std::vector<float> v = evaluate(noise, positions, 4 + line % 4);
    double c[frequencies] = {};
    double s[frequencies] = {};
    for (int i = 0; i < size; ++i) {
      for (int f = 0; f < frequencies; ++f) {
        c[f] += v[i] * cosines[i * frequencies + f];
        s[f] += v[i] * sines[i * frequencies + f];
      }
    }
    for (int f = 0; f < frequencies; ++f) power[f] += c[f] * c[f] + s[f] * s[f];
  }
  LineSpectrum result;
  double total = 0;
  double second = 0;
  for (int f = 0; f < frequencies; ++f) {
    const double frequency = f / (size * spacing);
    const double weighted = (f == 0 ? 0.5 : 1.0) * power[f];
    total += weighted;
    second += weighted * frequency * frequency;
    for (int band = 0; band < 4; ++band) {
      const double begin = band == 0 ? -1 : LineSpectrum::band_ends[band - 1];
      if (frequency > begin && frequency <= LineSpectrum::band_ends[band]) {
        result.shares[band] += weighted;
      }
    }
  }
  for (double& share : result.shares) share /= total;
  result.rms_frequency = std::sqrt(second / total);
  return result;
}

// Simplex noise is a sum of independent bumps that are isotropic on average, and is equal in all
// directions. Perlin noise is so only to a few per cent.
TEST(BaseNoise, SpectrumIsTheSameAlongAxesAndDiagonals) {
  const std::vector<Vector> directions = {{1, 0, 0},  {0, 1, 0}, {0, 0, 1}, {1, 1, 0},
                                          {0, 1, -1}, {1, 1, 1}, {1, -1, 1}};
  const std::map<std::string, double> stated = {{"simplex", 0.025}, {"perlin", 0.04}};
  for (const Noise* noise : {&simplex_noise(), &perlin_noise()}) {
    SCOPED_TRACE(noise->name());
    std::vector<LineSpectrum> spectra;
    LineSpectrum mean;
    for (const Vector& direction : directions) {
      spectra.push_back(spectrum_along(*noise, direction));
      const auto share = 1.0 / static_cast<double>(directions.size());
      for (int band = 0; band < 4; ++band) mean.shares[band] += share * spectra.back().shares[band];
      mean.rms_frequency += share * spectra.back().rms_frequency;
    }
    for (std::size_t i = 0; i < directions.size(); ++i) {
      SCOPED_TRACE("direction " + std::to_string(i));
      EXPECT_NEAR(spectra[i].rms_frequency / mean.rms_frequency, 1, 0.006);
      for (int band = 0; band < 4; ++band) {
        if (mean.shares[band] < 0.02) continue;
        EXPECT_NEAR(spectra[i].shares[band] / mean.shares[band], 1, stated.at(name_of(*noise)))
            << "band " << band;
      }
    }
  }
}

/// Chi-square of a table of pairs of gradients against independent, even pairs, in standard
/// deviations from its expectation.
template <typename First, typename Second>
double pair_deviation(First&& first, Second&& second) {
  constexpr int n = reference::gradient_count;
  constexpr int side = 32;
  constexpr double expected = double{side} * side * side / (n * n);
  std::vector<int> counts(n * n);
  // The block lies about the origin, but off centre, so that it has negative coordinates.
  for (int i = -18; i < side - 18; ++i) {
    for (int j = -15; j < side - 15; ++j) {
      for (int k = -9; k < side - 9; ++k) ++counts[first(i, j, k) * n + second(i, j, k)];
    }
  }
  double chi_square = 0;
  for (const int count : counts) chi_square += (count - expected) * (count - expected) / expected;
  return (chi_square - (n * n - 1)) / std::sqrt(2.0 * (n * n - 1));
}

/// A bound on a few hundred independent deviations.
class Deviations {
 public:
  void add(double z, const std::string& what) {
    EXPECT_LT(z, 4.5) << what;
    EXPECT_GT(z, -4.5) << what;
    squares_ += z * z;
    ++count_;
  }
  void check() const { EXPECT_NEAR(std::sqrt(squares_ / count_), 1, 0.1); }

 private:
  double squares_ = 0;
  int count_ = 0;
};

using reference::gradient_index;

TEST(LatticeHash, NeighboursAreIndependent) {
  const int directions[][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1}, {1, 1, 0},
                               {1, -1, 0}, {1, 0, 1},  {0, 1, 1}, {0, 1, -1},
                               {1, 1, 1},  {1, -1, 1}, {2, 1, 0}, {-1, 0, 3}};
  const int distances[] = {1,  2,   3,   4,   5,   7,   8,    15,   16,   17,    31,    32,
                           64, 127, 128, 255, 256, 257, 1000, 1024, 4096, 16384, 65536, 131072};
  Deviations deviations;
  for (const std::uint32_t seed : {0u, 0x12345678u, 0xdeadbeefu}) {
    for (const int distance : distances) {
      for (const auto& d : directions) {
        const double z =
            pair_deviation([&](int i, int j, int k) { return gradient_index(i, j, k, seed); },
                           [&](int i, int j, int k) {
                             return gradient_index(i + distance * d[0], j + distance * d[1],
                                                   k + distance * d[2], seed);
                           });
        deviations.add(z, std::to_string(distance) + " times (" + std::to_string(d[0]) + ", " +
                              std::to_string(d[1]) + ", " + std::to_string(d[2]) + ")");
      }
    }
  }
  deviations.check();
}

TEST(LatticeHash, ComponentsAreIndependent) {
  Deviations deviations;
  const int steps[][3] = {{0, 0, 0}, {1, 0, 0},  {0, 1, 0}, {0, 0, 1},
                          {1, 1, 0}, {0, -1, 1}, {1, 1, 1}, {2, 0, 0}};
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    for (const auto& step : steps) {
      for (int first = 0; first < 3; ++first) {
        for (int second = 0; second < 3; ++second) {
          if (step[0] == 0 && step[1] == 0 && step[2] == 0 && first <= second) continue;
          if (first == 0 && second == 0) continue;
          const double z = pair_deviation(
              [&](int i, int j, int k) { return gradient_index(i, j, k, seed, first); },
              [&](int i, int j, int k) {
                return gradient_index(i + step[0], j + step[1], k + step[2], seed, second);
              });
          deviations.add(z, std::to_string(first) + " and " + std::to_string(second) + ", seed " +
                                std::to_string(seed));
        }
      }
    }
  }
  deviations.check();
}

/// Chi-square, as pair_deviation(), of the alternating sum of gradient numbers, modulo their count,
/// over the corners of parallelograms (two edges) or parallelepipeds (three). Corners that are
/// independent in pairs may still fix the last of them.
double corner_deviation(std::span<const std::array<int, 3>> edges, std::uint32_t seed) {
  constexpr int n = reference::gradient_count;
  constexpr int side = 48;
  constexpr double expected = double{side} * side * side / n;
  std::vector<int> counts(n);
  for (int i = -18; i < side - 18; ++i) {
    for (int j = -15; j < side - 15; ++j) {
      for (int k = -9; k < side - 9; ++k) {
        int sum = 0;
        for (int corner = 0; corner < 1 << edges.size(); ++corner) {
          int p[3] = {i, j, k};
          bool odd = false;
          for (std::size_t e = 0; e < edges.size(); ++e) {
            if ((corner >> e & 1) == 0) continue;
            odd = !odd;
            for (int axis = 0; axis < 3; ++axis) p[axis] += edges[e][axis];
          }
          const int index = reference::gradient_index(p[0], p[1], p[2], seed);
          sum += odd ? n - index : index;
        }
        ++counts[sum % n];
      }
    }
  }
  double chi_square = 0;
  for (const int count : counts) chi_square += (count - expected) * (count - expected) / expected;
  return (chi_square - (n - 1)) / std::sqrt(2.0 * (n - 1));
}

TEST(LatticeHash, CornersTogetherAreIndependent) {
  for (const int distance : {1, 2, 3, 5, 6, 16, 64}) {
    const std::array<int, 3> x = {distance, 0, 0};
    const std::array<int, 3> y = {0, distance, 0};
    const std::array<int, 3> z = {0, 0, distance};
    const std::array<int, 3> diagonal = {distance, distance, 0};
    double sum = 0;
    int count = 0;
    for (const std::uint32_t seed : {0u, 1u, 0x12345678u, 0xdeadbeefu}) {
      for (const std::vector<std::array<int, 3>>& edges :
           {std::vector{x, y}, std::vector{x, z}, std::vector{y, z}, std::vector{diagonal, z},
            std::vector{x, y, z}}) {
        const double z_score = corner_deviation(edges, seed);
        EXPECT_LT(z_score, 5.5) << distance << ", seed " << seed;
        sum += z_score;
        ++count;
      }
    }
    // The mean of 20 deviations, each of variance 1.
    EXPECT_LT(sum / count, 4 / std::sqrt(count)) << distance;
  }
}

TEST(LatticeHash, HasNoMirrorImages) {
  Deviations deviations;
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    const auto direct = [&](int i, int j, int k) { return gradient_index(i, j, k, seed); };
    // No mirror image of a point lies in the block, which is far from the origin.
    const auto add = [&](const char* what, auto&& image) {
      deviations.add(
          pair_deviation([&](int i, int j, int k) { return direct(i + 40, j + 120, k + 80); },
                         [&](int i, int j, int k) { return image(i + 40, j + 120, k + 80); }),
          what);
    };
    add("-x -y", [&](int i, int j, int k) { return direct(-i, -j, k); });
    add("-x -z", [&](int i, int j, int k) { return direct(-i, j, -k); });
    add("-y -z", [&](int i, int j, int k) { return direct(i, -j, -k); });
    add("-x -y -z", [&](int i, int j, int k) { return direct(-i, -j, -k); });
    add("-x", [&](int i, int j, int k) { return direct(-i, j, k); });
    add("y x z", [&](int i, int j, int k) { return direct(j, i, k); });
  }
  deviations.check();
}

TEST(LatticeHash, SeedsAreIndependent) {
  Deviations deviations;
  const auto compare = [&](std::uint32_t a, std::uint32_t b) {
    deviations.add(pair_deviation([&](int i, int j, int k) { return gradient_index(i, j, k, a); },
                                  [&](int i, int j, int k) { return gradient_index(i, j, k, b); }),
                   std::to_string(a) + " and " + std::to_string(b));
  };
  for (std::uint32_t seed = 0; seed < 60; ++seed) compare(seed, seed + 1);
  for (int bit = 0; bit < 32; ++bit) {
    compare(0, std::uint32_t{1} << bit);
    compare(0xdeadbeef, 0xdeadbeef ^ (std::uint32_t{1} << bit));
  }
  deviations.check();
}

/// Positions whose sums with whole numbers below 2^17 are exact in single precision.
std::vector<Vector> coarse_positions(std::size_t count) {
  std::vector<Vector> positions = positions_in_cube(count, 64, 11);
  for (Vector& p : positions) {
    for (double& c : p) c = std::floor(c * 64) / 64 + 1.0 / 128;
  }
  return positions;
}

constexpr std::size_t correlated = 1 << 18;
const double largest_correlation = 4.5 / std::sqrt(double{correlated});

TEST(BaseNoise, HasNoPeriod) {
  const std::vector<Vector> positions = coarse_positions(correlated);
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const std::vector<float> here = evaluate(*noise, positions, 31);
    for (const double distance : {3.0, 16.0, 255.0, 256.0, 289.0, 4096.0, 65536.0, 100000.0}) {
      for (const Vector& d :
           {Vector{1, 0, 0}, Vector{0, 1, 0}, Vector{0, 0, -1}, Vector{1, 1, 0}, Vector{1, 1, 1}}) {
        std::vector<Vector> shifted = positions;
        for (Vector& p : shifted) {
          for (int axis = 0; axis < 3; ++axis) p[axis] += distance * d[axis];
        }
        EXPECT_LT(std::abs(correlation(here, evaluate(*noise, shifted, 31))), largest_correlation)
            << distance << " along " << d[0] << " " << d[1] << " " << d[2];
      }
    }
  }
}

TEST(BaseNoise, HasNoSymmetry) {
  const std::vector<Vector> positions = coarse_positions(correlated);
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const std::vector<float> here = evaluate(*noise, positions, 31);
    for (const Vector& sign : {Vector{-1, 1, 1}, Vector{1, -1, 1}, Vector{-1, -1, 1},
                               Vector{1, -1, -1}, Vector{-1, 1, -1}, Vector{-1, -1, -1}}) {
      std::vector<Vector> mirrored = positions;
      for (Vector& p : mirrored) {
        for (int axis = 0; axis < 3; ++axis) p[axis] *= sign[axis];
      }
      EXPECT_LT(std::abs(correlation(here, evaluate(*noise, mirrored, 31))), largest_correlation);
    }
  }
}

TEST(BaseNoise, SeedsDecorrelate) {
  const std::vector<Vector> positions = coarse_positions(correlated);
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const std::vector<float> here = evaluate(*noise, positions, 100);
    for (const std::uint32_t seed : {101u, 102u, 228u, 0u, 0x80000064u}) {
      EXPECT_LT(std::abs(correlation(here, evaluate(*noise, positions, seed))), largest_correlation)
          << seed;
    }
  }
}

TEST(BaseNoise, ComponentsOfAVectorAreAlikeAndIndependent) {
  const std::vector<Vector>& positions = independent_points();
  const auto count = static_cast<double>(positions.size());
  Octave octave;
  octave.seed = 21;
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const auto parts = evaluate_vector(*noise, positions, {&octave, 1}, Noise::most_components);
    for (std::size_t c = 0; c < parts.size(); ++c) {
      double sum = 0, squares = 0;
      for (const float v : parts[c]) {
        sum += double{v};
        squares += double{v} * double{v};
      }
      EXPECT_NEAR(sum / count, 0, 4 * std::sqrt(noise->variance() / count)) << c;
      EXPECT_NEAR(squares / count, noise->variance(), 0.002 * noise->variance()) << c;
      for (std::size_t other = 0; other < c; ++other) {
        EXPECT_LT(std::abs(correlation(parts[c], parts[other])), 4.5 / std::sqrt(count)) << c;
      }
    }
  }
}

TEST(NoiseKinds, AreFoundByName) {
  for (const Noise* noise : noise_kinds()) {
    EXPECT_EQ(&find_noise(name_of(*noise)), noise);
    EXPECT_FALSE(noise->description().empty());
  }
  EXPECT_EQ(noise_names().size(), noise_kinds().size());
  EXPECT_EQ(error_text([] { find_noise("perlim"); }),
            "unknown noise 'perlim'; did you mean 'perlin'?");
}

}  // namespace
}  // namespace gamer::statistics_test
