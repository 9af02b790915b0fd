#include "gamer/core/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

namespace gamer::random_test {
namespace {

using std::numbers::pi;

TEST(Mix64, GivesTheKnownSequenceOfSplitmix64) {
  // Output of Vigna's splitmix64.c (https://prng.di.unimi.it/splitmix64.c) for x = 1234567.
  const std::uint64_t known[] = {6457827717110365317u, 3203168211198807973u, 9817491932198370423u,
                                 4593380528125082431u, 16408922859458223821u};
  std::uint64_t state = 1234567;
  for (const std::uint64_t value : known) {
    state += golden_gamma;
    EXPECT_EQ(mix64(state), value);
  }
  // The first number for x = 0.
  EXPECT_EQ(mix64(golden_gamma), 0xe220a8397b1dcdafu);
}

TEST(Mix64, EveryInputBitFlipsHalfOfTheOutput) {
  constexpr int samples = 4096;
  for (int bit = 0; bit < 64; ++bit) {
    int flipped = 0;
    for (std::uint64_t i = 0; i < samples; ++i) {
      const std::uint64_t x = i * golden_gamma;
      flipped += std::popcount(mix64(x) ^ mix64(x ^ (std::uint64_t{1} << bit)));
    }
    // 64 * 4096 fair bits: sigma of the share is 0.00098; five sigma.
    EXPECT_NEAR(flipped / (64.0 * samples), 0.5, 0.005) << "bit " << bit;
  }
}

TEST(HashWords, DependsOnOrderNumberAndValue) {
  const std::set<std::uint64_t> hashes = {
      hash_words({}),     hash_words({0}),    hash_words({0, 0}), hash_words({1}),
      hash_words({0, 1}), hash_words({1, 0}), hash_words({1, 2}), hash_words({2, 1}),
  };
  EXPECT_EQ(hashes.size(), 8u);
}

TEST(HashWords, NeighboursDoNotCollideAndFillTheUnitInterval) {
  std::set<std::uint64_t> hashes;
  constexpr int side = 64;
  constexpr int bins = 64;
  std::vector<int> histogram(bins, 0);
  for (std::uint64_t i = 0; i < side; ++i) {
    for (std::uint64_t j = 0; j < side; ++j) {
      const std::uint64_t h = hash_words({i, j});
      hashes.insert(h);
      ++histogram[static_cast<std::size_t>(to_unit(h) * bins)];
    }
  }
  EXPECT_EQ(hashes.size(), std::size_t{side * side});
  // Chi-squared with 63 degrees of freedom: mean 63, sigma 11.2; five sigma either way.
  const double expected = double{side} * side / bins;
  double chi_squared = 0;
  for (const int count : histogram) {
    chi_squared += (count - expected) * (count - expected) / expected;
  }
  EXPECT_GT(chi_squared, 63 - 56);
  EXPECT_LT(chi_squared, 63 + 56);
}

TEST(ToUnit, IsInTheHalfOpenInterval) {
  EXPECT_EQ(to_unit(0), 0.0);
  EXPECT_EQ(to_unit(std::uint64_t{1} << 63), 0.5);
  EXPECT_EQ(to_unit(~std::uint64_t{0}), 1.0 - 0x1p-53);
}

TEST(R3Sequence, FollowsItsDefinition) {
  // Newton's method gives g independently of the tabulated steps.
  long double g = 1.2L;
  for (int i = 0; i < 30; ++i) g -= (g * g * g * g - g - 1) / (4 * g * g * g - 1);
  const R3Sequence sequence;
  for (const std::uint64_t i : {0u, 1u, 2u, 1000u, 1000000u}) {
    double p[3];
    sequence.point(i, p);
    long double step = 1;
    for (const double x : p) {
      step /= g;
      const long double y = 0.5L + static_cast<long double>(i) * step;
      EXPECT_NEAR(x, static_cast<double>(y - std::floor(y)), 1.2e-13) << i;
    }
  }
}

TEST(R3Sequence, IntegratesBetterThanIndependentPoints) {
  const R3Sequence sequence;
  constexpr int n = 4096;
  double mean[3] = {0, 0, 0};
  double wave = 0;
  for (int i = 0; i < n; ++i) {
    double p[3];
    sequence.point(static_cast<std::uint64_t>(i), p);
    for (int k = 0; k < 3; ++k) mean[k] += p[k] / n;
    wave += std::sin(pi * p[0]) * std::sin(pi * p[1]) * std::sin(pi * p[2]) / n;
  }
  // Independent points have sigma 4.5e-3 for each mean, and 3.9e-3 for the wave, whose mean is
  // (2/pi)^3.
  for (const double m : mean) EXPECT_NEAR(m, 0.5, 1.2e-3);
  EXPECT_NEAR(wave, std::pow(2 / pi, 3), 2.4e-5);
}

TEST(R3Sequence, LowDiscrepancy) {
  // The largest deviation of the share of points in boxes [0, a) x [0, b) x [0, c).
  const R3Sequence sequence;
  constexpr int n = 4096;
  constexpr int grid = 16;
  std::vector<double> points(3 * n);
  for (int i = 0; i < n; ++i) sequence.point(static_cast<std::uint64_t>(i), &points[3u * i]);
  double worst = 0;
  for (int a = 1; a <= grid; ++a) {
    for (int b = 1; b <= grid; ++b) {
      for (int c = 1; c <= grid; ++c) {
        int inside = 0;
        for (int i = 0; i < n; ++i) {
          const double* p = &points[3u * i];
          inside += p[0] * grid < a && p[1] * grid < b && p[2] * grid < c;
        }
        const double volume = double{1} * a * b * c / (grid * grid * grid);
        worst = std::max(worst, std::fabs(static_cast<double>(inside) / n - volume));
      }
    }
  }
  // The measured value is 6.8e-3; ten sets of independent points gave 1.2e-2 to 2.4e-2.
  EXPECT_LT(worst, 8e-3);
}

}  // namespace
}  // namespace gamer::random_test
