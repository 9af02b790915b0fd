#include "processing/detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace gamer::detector_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

PlanePtr constant(int width, int height, double value) {
  return std::make_shared<MemoryPlane>(
      width, height, std::vector<double>(static_cast<std::size_t>(width) * height, value));
}

std::vector<double> values_of(const PlanePtr& plane, int threads = 1) {
  const Image image = evaluate(*plane, threads);
  return {image.plane(0),
          image.plane(0) + static_cast<std::size_t>(image.width()) * image.height()};
}

struct Moments {
  double mean = 0, variance = 0;
};

Moments moments(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Moments m;
  for (const double v : values) m.mean += v / n;
  for (const double v : values) m.variance += (v - m.mean) * (v - m.mean) / (n - 1);
  return m;
}

class CcdEquation : public testing::TestWithParam<double> {};

TEST_P(CcdEquation, GivesMeanAndVarianceOfAMillionPixels) {
  Detector detector;
  detector.electron_rate = 3;
  detector.sky_rate = 0.4 * GetParam();
  detector.dark_rate = 0.02;
  detector.exposure = 500;
  detector.exposures = 4;
  detector.read_noise = 2.5;
  detector.per_electron = 0.1;
  detector.offset = -7;
  constexpr int side_length = 1000;
  const double value = 0.2 * GetParam();
  const PlanePtr source = constant(side_length, side_length, value);
  const Moments m = moments(values_of(observed(source, detector, noise_key(1, "r"))));

  const double mu = (3 * value + 0.4 * GetParam() + 0.02) * 500;
  const double variance = mu + 4 * 2.5 * 2.5;
  constexpr double n = side_length * side_length;
  EXPECT_LT(std::abs(m.mean - (0.1 * mu - 7)), 4 * 0.1 * std::sqrt(variance / n));
  // The fourth central moment of a Poisson variate is 3 variance^2 + mu.
  const double error = std::sqrt((2 + mu / (variance * variance)) / n);
  EXPECT_LT(std::abs(m.variance / (0.01 * variance) - 1), 4 * error);
  for (const double v : values_of(observed_variance(constant(3, 2, value), detector))) {
    EXPECT_NEAR(v / (0.01 * variance), 1, 1e-14);
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, CcdEquation,
                         testing::Values(0.0, 1e-4, 1e-3, 0.01, 0.1, 1.0, 100.0, 1e5));

TEST(Detector, ReachesTheSignalToNoiseOfTheCcdEquation) {
  // docs/facts.md section 11: S = 2, B = 1.5, D = 0.002 electrons/s, t = 600 s, n = 50 pixels, R =
  // 5: S/N 5.5054.
  Detector detector;
  detector.sky_rate = 1.5;
  detector.dark_rate = 0.002;
  detector.exposure = 600;
  detector.read_noise = 5;
  constexpr int pixel_count = 50, apertures = 100'000;
  constexpr double signal_to_noise = 5.5054;
  const PlanePtr source = constant(pixel_count, apertures, 2.0 / pixel_count);

  std::vector<double> sums(apertures);
  const auto counts = values_of(observed(source, detector, noise_key(3, "V")));
  for (std::size_t i = 0; i < counts.size(); ++i) sums[i / pixel_count] += counts[i];
  const Moments m = moments(sums);
  const double ratio = (m.mean - pixel_count * detector.background()) / std::sqrt(m.variance);
  const double error = std::sqrt((1 + signal_to_noise * signal_to_noise / 2) / apertures);
  EXPECT_NEAR(ratio, signal_to_noise, 4 * error);

  double variance = 0;
  for (const double v :
       values_of(observed_variance(constant(pixel_count, 1, 2.0 / pixel_count), detector)))
    variance += v;
  EXPECT_NEAR(2 * 600 / std::sqrt(variance), signal_to_noise, 5e-5);
}

TEST(Detector, CountsWholeElectronsWithoutReadNoise) {
  Detector detector;
  detector.sky_rate = 30;
  detector.offset = 100;
  for (const double v : values_of(observed(constant(50, 50, 5), detector, 1))) {
    EXPECT_EQ(v, std::floor(v));
  }
}

TEST(Detector, KeepsMissingPixelsAndTakesNegativeOnesForDark) {
  Detector detector;
  detector.sky_rate = 10;
  detector.read_noise = 3;
  const auto plane = std::make_shared<MemoryPlane>(4, 1, std::vector<double>{-5, 0, nan_value, 0});
  const auto dark = std::make_shared<MemoryPlane>(4, 1, std::vector<double>{0, 0, nan_value, 0});
  const auto v = values_of(observed(plane, detector, 1));
  const auto expected = values_of(observed(dark, detector, 1));
  EXPECT_TRUE(std::isnan(v[2]));
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(v[i], expected[i]);
  const auto variance = values_of(observed_variance(plane, detector));
  EXPECT_TRUE(std::isnan(variance[2]));
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(variance[i], 19);
}

TEST(Detector, Saturates) {
  Detector detector;
  detector.exposure = 100;
  detector.exposures = 3;
  detector.full_well = 1000;
  detector.read_noise = 10;
  detector.per_electron = 0.5;
  detector.offset = 20;
  EXPECT_EQ(detector.saturation(), 1520);
  // 2000 electrons are 22 sigma below the 3000 of a full well, and 4000 are 14 sigma above.
  for (const double v : values_of(observed(constant(100, 100, 20), detector, 1))) {
    EXPECT_LT(v, 1520);
  }
  for (const double v : values_of(observed(constant(100, 100, 40), detector, 1))) {
    EXPECT_EQ(v, 1520);
  }
}

TEST(Noise, DoesNotDependOnTilesAndThreads) {
  constexpr int image_width = 1201, image_height = 300;
  std::vector<double> ramp(static_cast<std::size_t>(image_width) * image_height);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = 1e-3 * static_cast<double>(i);
  const auto source = std::make_shared<MemoryPlane>(image_width, image_height, ramp);
  Detector detector;
  detector.read_noise = 1;
  const std::uint64_t key = noise_key(1, "r");
  for (const PlanePtr& plane :
       {observed(source, detector, key), with_gaussian_noise(source, 0.3, key)}) {
    const auto whole = values_of(plane, 1);
    EXPECT_EQ(values_of(plane, 5), whole);
    for (const Area area : {Area{3, 7, 40, 30}, Area{510, 299, 691, 1}, Area{1200, 0, 1, 300}}) {
      std::vector<double> part(static_cast<std::size_t>(area.width + 2) * area.height);
      plane->read(area, part.data(), area.width + 2);
      for (int j = 0; j < area.height; ++j) {
        for (int i = 0; i < area.width; ++i) {
          ASSERT_EQ(part[static_cast<std::size_t>(j * (area.width + 2) + i)],
                    whole[static_cast<std::size_t>((area.y + j) * image_width + area.x + i)]);
        }
      }
    }
  }
}

TEST(Noise, DoesNotCorrelate) {
  constexpr int side_length = 1000;
  Detector detector;
  detector.read_noise = 2;
  detector.sky_rate = 40;
  const PlanePtr source = constant(side_length, side_length, 0);
  const auto normalised = [&](std::uint64_t key, bool gaussian) {
    auto values =
        values_of(gaussian ? with_gaussian_noise(source, 1, key) : observed(source, detector, key));
    const Moments m = moments(values);
    for (double& v : values) v = (v - m.mean) / std::sqrt(m.variance);
    return values;
  };
  const auto correlation = [](const std::vector<double>& a, const std::vector<double>& b,
                              std::size_t lag) {
    double sum = 0;
    for (std::size_t i = lag; i < a.size(); ++i) sum += a[i] * b[i - lag];
    return sum / std::sqrt(static_cast<double>(a.size()));
  };
  for (const bool gaussian : {false, true}) {
    const auto first = normalised(noise_key(1, "r"), gaussian);
    // The neighbours are the next pixel, the pixel above, and the two beside that.
    for (const std::size_t lag :
         {1, 2, side_length - 1, side_length, side_length + 1, 2 * side_length}) {
      EXPECT_LT(std::abs(correlation(first, first, lag)), 4) << lag;
    }
    for (const std::uint64_t key : {noise_key(2, "r"), noise_key(1, "i"), noise_key(1, "r", 1)}) {
      const auto other = normalised(key, gaussian);
      EXPECT_NE(other, first);
      EXPECT_LT(std::abs(correlation(first, other, 0)), 4);
    }
  }
}

TEST(Noise, KeysTellPlanesApart) {
  EXPECT_EQ(noise_key(7, "sdss_r"), noise_key(7, "sdss_r", 0));
  EXPECT_NE(noise_key(7, "sdss_r"), noise_key(8, "sdss_r"));
  EXPECT_NE(noise_key(7, "sdss_r"), noise_key(7, "sdss_g"));
  EXPECT_NE(noise_key(7, "ab"), noise_key(7, "ba"));
  EXPECT_NE(noise_key(7, ""), noise_key(7, "", 1));
}

TEST(GaussianNoise, HasItsSigma) {
  constexpr int side_length = 1000;
  const Moments m =
      moments(values_of(with_gaussian_noise(constant(side_length, side_length, 5), 0.25, 1)));
  EXPECT_LT(std::abs(m.mean - 5), 4 * 0.25 / side_length);
  EXPECT_LT(std::abs(m.variance / (0.25 * 0.25) - 1), 4 * std::sqrt(2.0) / side_length);
  const auto plane = std::make_shared<MemoryPlane>(2, 1, std::vector<double>{nan_value, 3});
  EXPECT_TRUE(std::isnan(values_of(with_gaussian_noise(plane, 1, 1))[0]));
  EXPECT_EQ(values_of(with_gaussian_noise(plane, 0, 1))[1], 3);
  EXPECT_TRUE(std::isnan(values_of(gaussian_variance(plane, 0.5))[0]));
  EXPECT_EQ(values_of(gaussian_variance(plane, 0.5))[1], 0.25);
}

TEST(SignalNorm, IsThatOfAMatchedFilter) {
  const auto plane = std::make_shared<MemoryPlane>(3, 1, std::vector<double>{3, nan_value, -4});
  EXPECT_EQ(signal_norm(*plane), 5);
  // A least-squares fit of the known profile to noisy images gives its flux with this ratio.
  constexpr int image_count = 20'000;
  const std::vector<double> profile = {0.1, 0.5, 1, 0.7, 0.2};
  std::vector<double> images, fluxes;
  for (int i = 0; i < image_count; ++i) images.insert(images.end(), profile.begin(), profile.end());
  const auto source = std::make_shared<MemoryPlane>(5, image_count, images);
  const auto noisy = values_of(with_gaussian_noise(source, 0.1, 1));
  const double norm = signal_norm(MemoryPlane(5, 1, profile));
  for (int i = 0; i < image_count; ++i) {
    double flux = 0;
    for (std::size_t k = 0; k < profile.size(); ++k) {
      flux += noisy[static_cast<std::size_t>(i) * 5 + k] * profile[k] / (norm * norm);
    }
    fluxes.push_back(flux);
  }
  const Moments m = moments(fluxes);
  EXPECT_LT(std::abs(m.mean / std::sqrt(m.variance) / (norm / 0.1) - 1),
            4 / std::sqrt(2.0 * image_count));
}

}  // namespace
}  // namespace gamer::detector_test
