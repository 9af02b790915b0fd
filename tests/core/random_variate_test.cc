#include "gamer/core/random_variate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/each_simd_target.h"
#include "gamer/core/random.h"

namespace gamer::random_variate_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

/// The number of values in a sample, and in each piece of it.
constexpr std::size_t sample_size = 10'000'000, piece_size = 1 << 16;

/// Calls use(values) until sample_size values are made by make(first, values).
template <class Make, class Use>
void sample(Make make, Use use) {
  std::vector<double> values;
  for (std::size_t first = 0; first < sample_size; first += piece_size) {
    values.assign(std::min(piece_size, sample_size - first), 0.0);
    make(first, values);
    use(values);
  }
}

/// Chi-square of observed against expected counts as a standard normal number (Wilson & Hilferty
/// 1931): (chi2/f)^(1/3) is normal with mean 1 - 2/(9f) and variance 2/(9f). Bins of few are
/// joined with the next.
double chi_square_sigmas(const std::vector<double>& found, const std::vector<double>& expected) {
  constexpr double least_count = 20;
  double chi_square = 0, seen = 0, wanted = 0;
  int bins = 0;
  double left = 0;
  for (const double e : expected) left += e;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    seen += found[i];
    wanted += expected[i];
    left -= expected[i];
    const bool is_last = i + 1 == expected.size();
    if (!is_last && (wanted < least_count || left < least_count)) continue;
    chi_square += (seen - wanted) * (seen - wanted) / wanted;
    ++bins;
    seen = wanted = 0;
  }
  const double f = bins - 1;
  return (std::cbrt(chi_square / f) - (1 - 2 / (9 * f))) / std::sqrt(2 / (9 * f));
}

class PoissonDistribution : public testing::TestWithParam<double> {};

TEST_P(PoissonDistribution, PassesAChiSquareTest) {
  const double mean = GetParam();
  const double sigma = std::sqrt(mean);
  const auto low = static_cast<long>(std::max(0.0, std::floor(mean - 9 * sigma)));
  const auto high = static_cast<long>(std::ceil(mean + 9 * sigma + 20));
  std::vector<double> expected;
  for (long k = low; k <= high; ++k) {
    const auto x = static_cast<double>(k);
    expected.push_back(sample_size * std::exp(x * std::log(mean) - mean - std::lgamma(x + 1)));
  }
  std::vector<double> found(expected.size());
  const std::vector<double> means(piece_size, mean);
  sample(
      [&](std::size_t first, std::vector<double>& values) {
        poisson_variates(hash_words({42}), first, {means.data(), values.size()}, values);
      },
      [&](const std::vector<double>& values) {
        for (const double v : values) {
          ASSERT_EQ(v, std::floor(v));
          ASSERT_GE(v, static_cast<double>(low));
          ASSERT_LE(v, static_cast<double>(high));
          ++found[static_cast<std::size_t>(static_cast<long>(v) - low)];
        }
      });
  EXPECT_LT(std::abs(chi_square_sigmas(found, expected)), 4);
}

// The means lie on both sides of the change of methods at 10, and of the end of the table of
// Stirling's errors.
INSTANTIATE_TEST_SUITE_P(Means, PoissonDistribution,
                         testing::Values(0.001, 0.1, 1.0, 5.0, 9.999, 10.0, 12.0, 25.0, 50.0, 500.0,
                                         1e4),
                         [](const auto& parameter) {
                           std::string name = std::to_string(parameter.param);
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

class LargePoisson : public testing::TestWithParam<double> {};

// Moments up to the third replace bins, which would be too many. Their standard errors follow from
// the central moments of a Poisson distribution: mu, mu + 3 mu^2 and, of sixth order, 15 mu^3 + ...
TEST_P(LargePoisson, HasItsMoments) {
  const double mean = GetParam();
  const std::vector<double> means(piece_size, mean);
  double first_sum = 0, second = 0, third = 0;
  sample(
      [&](std::size_t first, std::vector<double>& values) {
        poisson_variates(hash_words({43}), first, {means.data(), values.size()}, values);
      },
      [&](const std::vector<double>& values) {
        for (const double v : values) {
          const double z = (v - mean) / std::sqrt(mean);
          first_sum += z;
          second += z * z;
          third += z * z * z;
        }
      });
  constexpr double n = sample_size;
  EXPECT_LT(std::abs(first_sum / n), 4 / std::sqrt(n));
  EXPECT_LT(std::abs(second / n - 1), 4 * std::sqrt((2 + 1 / mean) / n));
  EXPECT_LT(std::abs(third / n - 1 / std::sqrt(mean)), 4 * std::sqrt(15 / n));
}

INSTANTIATE_TEST_SUITE_P(Means, LargePoisson, testing::Values(1e3, 1e5, 1e7, 1e9, 1e12));

TEST(NormalVariates, PassAChiSquareTest) {
  // Bins have equal steps in z; the end bins hold the tails beyond 6.
  constexpr int bin_count = 600;
  constexpr double end_record = 6;
  const auto below = [](double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); };
  std::vector<double> found(bin_count), expected(bin_count);
  for (int i = 0; i < bin_count; ++i) {
    const double low = i == 0 ? -100 : -end_record + 2 * end_record * i / bin_count;
    const double high =
        i + 1 == bin_count ? 100 : -end_record + 2 * end_record * (i + 1) / bin_count;
    // The upper half follows by symmetry, which avoids small differences of numbers near 1.
    expected[static_cast<std::size_t>(i)] =
        sample_size * (low >= 0 ? below(-low) - below(-high) : below(high) - below(low));
  }
  sample([](std::size_t first, std::vector<double>& values) { normal_variates(5, first, values); },
         [&](const std::vector<double>& values) {
           for (const double v : values) {
             const int bin =
                 static_cast<int>(std::floor((v + end_record) / (2 * end_record) * bin_count));
             ++found[static_cast<std::size_t>(std::clamp(bin, 0, bin_count - 1))];
           }
         });
  EXPECT_LT(std::abs(chi_square_sigmas(found, expected)), 4);
}

TEST(NormalVariates, InvertTheDistributionFunction) {
  // The uniform number of each variate is known, and erfc gives it back. The least probable of 10^6
  // is in a tail of about 1e-6.
  constexpr std::size_t count = 1'000'000;
  std::vector<double> values(count);
  normal_variates(9, 100, values);
  double largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t word = mix64(9 + (100 + i + 1) * golden_gamma);
    const double p = (static_cast<double>(word >> 12) + 0.5) * 0x1p-52;
    const double tail = std::min(p, 1 - p);
    const double back = 0.5 * std::erfc(std::abs(values[i]) / std::numbers::sqrt2);
    largest = std::max(largest, std::abs(back / tail - 1));
    ASSERT_EQ(values[i] < 0, p < 0.5);
  }
  EXPECT_LT(largest, 1.8e-14);
}

TEST(RandomVariates, AreFunctionsOfKeyAndNumber) {
  constexpr std::size_t count = 3000;
  std::vector<double> means(count);
  // The means belong to all methods in random order, so that vectors are mixed.
  for (std::size_t i = 0; i < count; ++i) means[i] = std::pow(10.0, to_unit(mix64(i)) * 7 - 2);
  std::vector<double> counts(count), normals(count);
  poisson_variates(1, 7, means, counts);
  normal_variates(1, 7, normals);
  for (const std::size_t first : {0u, 1u, 5u, 511u, 1030u}) {
    for (const std::size_t size : {1u, 2u, 9u, 512u, 700u}) {
      std::vector<double> some(means.begin() + first, means.begin() + first + size);
      poisson_variates(1, 7 + first, some, some);
      EXPECT_TRUE(std::equal(some.begin(), some.end(), counts.begin() + first));
      normal_variates(1, 7 + first, some);
      EXPECT_TRUE(std::equal(some.begin(), some.end(), normals.begin() + first));
    }
  }
  std::vector<double> other(count);
  normal_variates(2, 7, other);
  EXPECT_NE(other, normals);
}

TEST(RandomVariates, AreTheSameOnEveryTarget) {
  constexpr std::size_t count = 200'000;
  std::vector<double> means(count);
  for (std::size_t i = 0; i < count; ++i) means[i] = std::pow(10.0, to_unit(mix64(i)) * 12 - 2);
  std::vector<double> counts, normals;
  for_each_simd_target([&] {
    std::vector<double> c(count), z(count);
    poisson_variates(3, 0, means, c);
    normal_variates(3, 0, z);
    if (counts.empty()) counts = c, normals = z;
    EXPECT_EQ(c, counts);
    EXPECT_EQ(z, normals);
  });
}

TEST(PoissonVariates, AreDefinedWithoutLightAndWithTooMuch) {
  const std::vector<double> means = {0, -0.0, -5, -1e300, nan_value, 1e100, 1e101, INFINITY, 12, 0};
  std::vector<double> counts(means.size());
  for_each_simd_target([&] {
    poisson_variates(1, 0, means, counts);
    for (const int i : {0, 1, 2, 3, 9}) EXPECT_EQ(counts[i], 0);
    EXPECT_TRUE(std::isnan(counts[4]));
    EXPECT_NEAR(counts[5] / 1e100, 1, 1e-15);
    EXPECT_EQ(counts[6], 1e101);
    EXPECT_EQ(counts[7], INFINITY);
    EXPECT_NEAR(counts[8], 12, 40);
  });
  std::vector<double> fewer(3);
  EXPECT_THROW(poisson_variates(1, 0, means, fewer), std::invalid_argument);
}

TEST(RandomVariates, DoNotCorrelate) {
  // Correlations of neighbours, and of the streams of neighbouring keys.
  constexpr std::size_t count = 2'000'000;
  const std::vector<double> means(count, 20.0);
  std::vector<double> counts(count), others(count), normals(count);
  poisson_variates(1, 0, means, counts);
  poisson_variates(2, 0, means, others);
  normal_variates(hash_words({1}), 0, normals);
  for (double& v : counts) v = (v - 20) / std::sqrt(20.0);
  for (double& v : others) v = (v - 20) / std::sqrt(20.0);
  const auto correlation = [&](const std::vector<double>& a, const std::vector<double>& b,
                               std::size_t lag) {
    double sum = 0;
    for (std::size_t i = lag; i < count; ++i) sum += a[i] * b[i - lag];
    return sum / std::sqrt(static_cast<double>(count));
  };
  for (const std::size_t lag : {1u, 2u, 3u, 8u, 512u, 1000u}) {
    EXPECT_LT(std::abs(correlation(counts, counts, lag)), 4) << lag;
    EXPECT_LT(std::abs(correlation(normals, normals, lag)), 4) << lag;
  }
  for (const std::size_t lag : {0u, 1u}) {
    EXPECT_LT(std::abs(correlation(counts, others, lag)), 4) << lag;
    EXPECT_LT(std::abs(correlation(counts, normals, lag)), 4) << lag;
  }
}

}  // namespace
}  // namespace gamer::random_variate_test
