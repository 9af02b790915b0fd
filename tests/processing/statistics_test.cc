#include "processing/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace gamer::statistics_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double positive_infinity = std::numeric_limits<double>::infinity();

PlanePtr row(std::vector<double> values) {
  const auto count = static_cast<int>(values.size());
  return std::make_shared<MemoryPlane>(count, 1, std::move(values));
}

/// A plane whose pixels are computed when they are read, so that large planes need no memory.
class FormulaPlane final : public Plane {
 public:
  FormulaPlane(int width, int height, std::function<double(int x, int y)> formula)
      : Plane(width, height), formula_(std::move(formula)) {}
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    for (int y = 0; y < area.height; ++y) {
      for (int x = 0; x < area.width; ++x) out[y * stride + x] = formula_(area.x + x, area.y + y);
    }
  }

 private:
  std::function<double(int x, int y)> formula_;
};

/// Values from 3e-320 to 1e300 of both signs, zeros, infinities and NaN.
std::vector<double> mixed_values(int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> exponent(-320, 300);
  std::uniform_int_distribution<int> kind(0, 9);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    switch (kind(random)) {
      case 0: values.push_back(nan_value); break;
      case 1: values.push_back(i % 2 == 0 ? positive_infinity : -positive_infinity); break;
      case 2: values.push_back(i % 2 == 0 ? 0.0 : -0.0); break;
      default: values.push_back((i % 2 == 0 ? 1 : -1) * std::pow(10, exponent(random)));
    }
  }
  return values;
}

std::vector<double> sorted(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  std::sort(values.begin(), values.end());
  return values;
}

/// The definition of a quantile by sorted values.
double sorted_quantile(const std::vector<double>& values, double q) {
  const double place = q * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(place);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (place - static_cast<double>(low)) * (values[high] - values[low]);
}

TEST(Statistics, OfFewNumbers) {
  // NumPy gives for [3, -1, nan, 7, inf, -1, 7, -inf] the mean 3 and the standard deviation
  // 3.5777087639996634.
  const Statistics result = statistics(
      MemoryPlane(4, 2, {3, -1, nan_value, 7, positive_infinity, -1, 7, -positive_infinity}), 1);
  EXPECT_EQ(result.count, 5);
  EXPECT_EQ(result.nans, 1);
  EXPECT_EQ(result.infinities, 2);
  EXPECT_EQ(result.sum, 15);
  EXPECT_EQ(result.mean, 3);
  EXPECT_DOUBLE_EQ(result.sigma, std::sqrt(12.8));
  EXPECT_EQ(result.min, -1);
  EXPECT_EQ(result.min_at.x, 1);
  EXPECT_EQ(result.min_at.y, 0);
  EXPECT_EQ(result.max, 7);
  EXPECT_EQ(result.max_at.x, 3);
  EXPECT_EQ(result.max_at.y, 0);
}

TEST(Statistics, PositionsCountRowsFromTheBottom) {
  std::vector<double> values(9000 * 3, 1.0);
  values[2 * 9000 + 8123] = -4;
  values[9000 + 5000] = 9;
  const Statistics result = statistics(MemoryPlane(9000, 3, values), 2);
  EXPECT_EQ(result.min_at.x, 8123);
  EXPECT_EQ(result.min_at.y, 2);
  EXPECT_EQ(result.max_at.x, 5000);
  EXPECT_EQ(result.max_at.y, 1);
}

TEST(Statistics, NothingFinite) {
  const Statistics result = statistics(*row({nan_value, positive_infinity}), 1);
  EXPECT_EQ(result.count, 0);
  for (const double value : {result.sum, result.min, result.max, result.mean, result.sigma}) {
    EXPECT_TRUE(std::isnan(value));
  }
  EXPECT_TRUE(std::isnan(median(*row({nan_value, -positive_infinity}), 1)));
  EXPECT_TRUE(std::isnan(mad_sigma(*row({nan_value}), nan_value, 1)));
}

TEST(Statistics, OnePixelAndEqualPixels) {
  const Statistics one = statistics(*row({-2.5}), 1);
  EXPECT_EQ(one.sum, -2.5);
  EXPECT_EQ(one.sigma, 0);
  EXPECT_EQ(median(*row({-2.5}), 1), -2.5);
  // Since 0.1 is no binary number, a rounding of the mean would give a sigma of 1e-17.
  const Statistics equal = statistics(MemoryPlane(300, 300, std::vector<double>(90000, 0.1)), 1);
  EXPECT_EQ(equal.mean, 0.1);
  EXPECT_EQ(equal.sigma, 0);
  EXPECT_EQ(mad_sigma(MemoryPlane(300, 300, std::vector<double>(90000, 0.1)), 0.1, 1), 0);
}

TEST(Statistics, SumsLoseNothing) {
  // The sum's terms cancel to 2^-52 of the largest; then the mean is far above sigma.
  EXPECT_EQ(statistics(*row({1e16, 1, -1e16, 1}), 1).sum, 2);
  const FormulaPlane offset(20000, 1000, [](int x, int) { return 1e9 + (x % 2 == 0 ? 1 : -1); });
  const Statistics result = statistics(offset, 2);
  EXPECT_EQ(result.sum, 2e16);
  EXPECT_EQ(result.sigma, 1);
  // The sum is 4e7 times the double nearest to 0.1; a plain sum would err by 1e-10.
  const FormulaPlane tenths(20000, 2000, [](int, int) { return 0.1; });
  EXPECT_NEAR(statistics(tenths, 2).sum / 4e6, 1, 3e-16);
}

TEST(Statistics, DoNotDependOnThreads) {
  const FormulaPlane plane(3001, 977,
                           [](int x, int y) { return std::sin(x * 12.9898 + y * 78.2); });
  const Statistics one = statistics(plane, 1), four = statistics(plane, 4);
  EXPECT_EQ(one.sum, four.sum);
  EXPECT_EQ(one.sigma, four.sigma);
}

TEST(Statistics, DenormalsAndOverflow) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(statistics(*row({tiny, tiny, 3 * tiny}), 1).sum, 5 * tiny);
  EXPECT_EQ(median(*row({tiny, -tiny, 3 * tiny}), 1), tiny);
  EXPECT_EQ(statistics(*row({1e308, 1e308}), 1).sum, positive_infinity);
  const double largest = std::numeric_limits<double>::max();
  EXPECT_EQ(median(*row({-largest, largest}), 1), 0);
}

TEST(Quantiles, AreThoseOfSortedValues) {
  const std::vector<double> fractions = {0.5, 0, 1, 0.25, 0.9, 0.001, 0.999, 0.1234, 0.5};
  for (const int count : {1, 2, 3, 10, 1001, 20000}) {
    const std::vector<double> values = mixed_values(count * 3, 7 + static_cast<unsigned>(count));
    const std::vector<double> found = quantiles(MemoryPlane(count, 3, values), fractions, 2);
    const std::vector<double> ordered = sorted(values);
    for (std::size_t i = 0; i < fractions.size(); ++i) {
      const double wanted = sorted_quantile(ordered, fractions[i]);
      EXPECT_NEAR(found[i], wanted, 1e-15 * std::fabs(wanted)) << count << ' ' << fractions[i];
    }
    EXPECT_EQ(quantiles(values, fractions), found);
  }
}

TEST(Quantiles, ZeroHasNoSign) { EXPECT_FALSE(std::signbit(median(*row({-0.0, -0.0}), 1))); }

/// Quantiles of large planes use radix selection; the cases need all four digits, and have ties and
/// floats.
TEST(Quantiles, OfLargePlanes) {
  constexpr int image_width = 2500, image_height = 1800;
  const std::vector<double> fractions = {0, 0.01, 0.3, 0.5, 0.75, 0.99999, 1};
  const auto hash = [](int x, int y) {
    auto state = static_cast<std::uint64_t>(y) * image_width + static_cast<std::uint64_t>(x) + 1;
    state = (state ^ (state >> 31)) * 0x9E3779B97F4A7C15u;
    state = (state ^ (state >> 29)) * 0xBF58476D1CE4E5B9u;
    return static_cast<double>(state >> 11) * 0x1p-53;
  };
  const std::vector<std::function<double(int, int)>> formulae = {
      [&](int x, int y) { return hash(x, y) < 0.001 ? nan_value : std::log(hash(x, y)); },
      // The first three digits are equal in all pixels.
      [&](int x, int y) { return 1 + std::floor(60000 * hash(x, y)) * 0x1p-52; },
      [&](int x, int y) { return -static_cast<double>(static_cast<float>(hash(x, y))); },
      [&](int x, int y) { return std::floor(5 * hash(x, y)) - 2; }, [](int, int) { return -0.1; }};
  for (const auto& formula : formulae) {
    const FormulaPlane plane(image_width, image_height, formula);
    const Image image = evaluate(plane);
    const std::vector<double> ordered =
        sorted(std::vector<double>(image.plane(0), image.plane(0) + image_width * image_height));
    const std::vector<double> found = quantiles(plane, fractions, 2);
    for (std::size_t i = 0; i < fractions.size(); ++i) {
      EXPECT_DOUBLE_EQ(found[i], sorted_quantile(ordered, fractions[i])) << fractions[i];
    }
  }
}

TEST(Quantiles, RefuseOtherFractions) {
  EXPECT_THROW(quantiles(*row({1}), std::vector<double>{1.5}, 1), std::invalid_argument);
  EXPECT_THROW(quantiles(*row({1}), std::vector<double>{nan_value}, 1), std::invalid_argument);
}

TEST(Background, OfNoiseWithSources) {
  // Noise has sigma 2 about 10, and 2 % of the pixels are sources.
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(10, 2);
  std::vector<double> values(1000 * 1000);
  for (double& value : values) value = noise(random);
  const MemoryPlane empty(1000, 1000, values);
  // The tolerance is twice the standard error of the MAD sigma, 1.17 sigma/sqrt(n).
  EXPECT_NEAR(mad_sigma(empty, median(empty, 2), 2), 2, 2 * 1.17 * 2e-3);
  for (std::size_t i = 0; i < values.size(); i += 50) values[i] = 500;
  const MemoryPlane crowded(1000, 1000, values);
  const Background background = clipped_background(crowded, 3, 2);
  EXPECT_NEAR(background.level, 10, 4e-3);
  // A normal distribution clipped repeatedly at 3 sigma has sigma 0.98.
  EXPECT_NEAR(background.sigma, 2 * 0.98, 0.02);
  EXPECT_NEAR(static_cast<double>(background.count), 980000 * 0.9965, 1500);
  EXPECT_THROW(clipped_background(crowded, 0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace gamer::statistics_test
