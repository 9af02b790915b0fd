#include "processing/power_spectrum.h"

#include <fftw3.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::power_spectrum_test {
namespace {

constexpr double pi_value = std::numbers::pi;

/// A periodic Gaussian field with power k^slope.
std::vector<double> power_law(int side, double slope, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const int half = side / 2 + 1;
  auto* modes = fftw_alloc_complex(static_cast<std::size_t>(side) * half);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < half; ++x) {
      const double k = std::hypot(x, y <= side / 2 ? y : y - side);
      const double amplitude = k == 0 ? 0 : std::pow(k, slope / 2);
      modes[y * half + x][0] = amplitude * normal(random);
      modes[y * half + x][1] = amplitude * normal(random);
    }
  }
  std::vector<double> values(static_cast<std::size_t>(side) * side);
  const fftw_plan plan = fftw_plan_dft_c2r_2d(side, side, modes, values.data(), FFTW_ESTIMATE);
  fftw_execute(plan);
  fftw_destroy_plan(plan);
  fftw_free(modes);
  return values;
}

MemoryPlane cut(const std::vector<double>& values, int side, int part) {
  std::vector<double> result;
  for (int y = 0; y < part; ++y) {
    const auto row = values.begin() + static_cast<std::ptrdiff_t>(y) * side;
    result.insert(result.end(), row, row + part);
  }
  return MemoryPlane(part, part, std::move(result));
}

SpectrumOptions with_window(SpectrumWindow window) {
  SpectrumOptions options;
  options.window = window;
  return options;
}

TEST(PowerSpectrum, OfPeriodicFieldsHasTheirSlope) {
  for (const double slope : {-2.9, -1.0, 0.0}) {
    const MemoryPlane plane(1024, 1024, power_law(1024, slope, 1));
    const PowerSpectrum spectrum =
        power_spectrum(plane, with_window(SpectrumWindow::none), "field", 2);
    EXPECT_NEAR(spectrum.fit.slope, slope, 0.06);
    EXPECT_EQ(spectrum.fit.bins, 12);
    EXPECT_EQ(spectrum.fit.highest, 256);
  }
}

/// The scatter of slopes agrees with their standard errors.
TEST(PowerSpectrum, ErrorOfTheSlope) {
  constexpr int fields = 50;
  double sum = 0, squares = 0, errors = 0;
  for (unsigned seed = 1; seed <= fields; ++seed) {
    const MemoryPlane plane(256, 256, power_law(256, -2.9, seed));
    const auto fit = power_spectrum(plane, with_window(SpectrumWindow::none), "field", 1).fit;
    sum += fit.slope;
    squares += std::pow(fit.slope + 2.9, 2);
    errors += std::pow(fit.slope_error, 2);
  }
  // The logarithm is biased at low k, where modes are few.
  EXPECT_NEAR(sum / fields, -2.88, 0.02);
  EXPECT_GT(std::sqrt(errors / squares), 0.8);
  EXPECT_LT(std::sqrt(errors / squares), 1.6);
}

/// Mean slopes of cuts of 256^2 from 1024^2 show the leakage from edges, and the effect of windows.
TEST(PowerSpectrum, OfCutsDependsOnTheWindow) {
  constexpr int fields = 16;
  const auto mean_slopes = [](double slope) {
    std::array<double, 3> sums{};
    for (unsigned seed = 1; seed <= fields; ++seed) {
      const MemoryPlane plane = cut(power_law(1024, slope, seed), 1024, 256);
      for (std::size_t i = 0; i < sums.size(); ++i) {
        const SpectrumOptions options = with_window(static_cast<SpectrumWindow>(i));
        sums[i] += power_spectrum(plane, options, "field", 1).fit.slope / fields;
      }
    }
    return sums;
  };
  const auto [none, hann, cosine] = mean_slopes(-2.9);
  EXPECT_NEAR(none, -2.88, 0.04);
  EXPECT_NEAR(hann, -2.88, 0.05);
  EXPECT_NEAR(cosine, -3.00, 0.05);
  const auto [steep_none, steep_hann, steep_cosine] = mean_slopes(-3.6);
  EXPECT_NEAR(steep_none, -3.04, 0.06);
  EXPECT_NEAR(steep_hann, -3.59, 0.05);
}

MemoryPlane wave(int width, int height, int kx, int ky, double amplitude) {
  std::vector<double> values;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double phase =
          static_cast<double>(kx) * x / width + static_cast<double>(ky) * y / height;
      values.push_back(7 + amplitude * std::cos(2 * pi_value * phase + 0.3));
    }
  }
  return MemoryPlane(width, height, std::move(values));
}

/// All power of a wave lies in its annulus, and equals its variance (Parseval).
TEST(PowerSpectrum, OfAWave) {
  struct Case {
    int width, height, kx, ky, k;
  };
  // k counts waves along the shorter side.
  for (const Case& c : {Case{64, 64, 3, 4, 5}, Case{64, 64, 0, 9, 9}, Case{65, 65, -7, 0, 7},
                        Case{128, 64, 12, 8, 10}, Case{64, 96, 6, 12, 10}}) {
    const PowerSpectrum spectrum = power_spectrum(wave(c.width, c.height, c.kx, c.ky, 2),
                                                  with_window(SpectrumWindow::none), "wave", 1);
    double sum = 0;
    for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) {
      const double power = annulus.power * static_cast<double>(annulus.modes);
      sum += power;
      if (annulus.k != c.k) {
        EXPECT_LT(power, 1e-20);
      }
    }
    EXPECT_NEAR(sum / (c.width * c.height), 2, 1e-12);
    EXPECT_NEAR(spectrum.sigma, std::sqrt(2), 1e-12);
    EXPECT_NEAR(spectrum.mean, 7, 1e-12);
    EXPECT_NEAR(spectrum.annuli[4].frequency, 5.0 / std::min(c.width, c.height), 1e-15);
  }
}

TEST(PowerSpectrum, CountsModes) {
  const PowerSpectrum spectrum =
      power_spectrum(wave(8, 8, 1, 0, 1), with_window(SpectrumWindow::none), "wave", 1);
  // Values of |k| are 1 and 1.41 for (1,0), (1,1); 2 and 2.24 for (2,0), (2,1); 2.83, 3, 3.16 for
  // (2,2), (3,0), (3,1); and 3.61, 4, 4.12, 4.24, 4.47 for (3,2), (4,0), (4,1), (3,3), (4,2). The
  // frequencies 4 and -4 are one.
  ASSERT_EQ(spectrum.annuli.size(), 4u);
  EXPECT_EQ(spectrum.annuli[0].modes, 8);
  EXPECT_EQ(spectrum.annuli[1].modes, 4 + 8);
  EXPECT_EQ(spectrum.annuli[2].modes, 4 + 4 + 8);
  EXPECT_EQ(spectrum.annuli[3].modes, 8 + 2 + 4 + 4 + 4);
}

TEST(PowerSpectrum, OfWhiteNoiseIsItsVariance) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(3, 0.5);
  std::vector<double> values(512 * 512);
  for (double& value : values) value = noise(random);
  const MemoryPlane plane(512, 512, values);
  for (const SpectrumWindow window :
       {SpectrumWindow::none, SpectrumWindow::hann, SpectrumWindow::cosine}) {
    const PowerSpectrum spectrum = power_spectrum(plane, with_window(window), "noise", 1);
    double power = 0, modes = 0;
    for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) {
      power += annulus.power * static_cast<double>(annulus.modes);
      modes += static_cast<double>(annulus.modes);
    }
    // 2e5 modes of scatter 1, divided by about 1.5 for the window, have a mean error of 0.003.
    EXPECT_NEAR(power / modes, 0.25, 0.25 * 0.01);
    EXPECT_LT(std::fabs(spectrum.fit.slope), 3 * spectrum.fit.slope_error);
  }
  SpectrumOptions options = with_window(SpectrumWindow::none);
  options.white_level = 0.25;
  const PowerSpectrum spectrum = power_spectrum(plane, options, "noise", 1);
  double sum = 0;
  for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) {
    sum += annulus.power * static_cast<double>(annulus.modes);
  }
  EXPECT_LT(std::fabs(sum), 0.25 * 0.01 * 2e5);
}

TEST(PowerSpectrum, DividesByThePsf) {
  // The field is seen through a Gaussian of FWHM 3 pixels: power times exp(-(2 pi sigma f)^2).
  const std::vector<double> field = power_law(512, -2.9, 9);
  SpectrumOptions options = with_window(SpectrumWindow::none);
  const PowerSpectrum plain = power_spectrum(MemoryPlane(512, 512, field), options, "field", 1);
  options.psf_fwhm = 3;
  const PowerSpectrum divided = power_spectrum(MemoryPlane(512, 512, field), options, "field", 1);
  const double sigma = 3 / 2.354820045;
  for (const std::size_t i : {std::size_t{9}, std::size_t{99}}) {
    const double f = static_cast<double>(i + 1) / 512;
    EXPECT_NEAR(divided.annuli[i].power / plain.annuli[i].power,
                std::exp(std::pow(2 * pi_value * sigma * f, 2)), 1e-6);
  }
  EXPECT_TRUE(std::isnan(divided.annuli[255].power));
}

TEST(PowerSpectrum, OfOpticalDepths) {
  // v = 1 - exp(-tau), with log-normal tau.
  std::vector<double> values = power_law(512, -2.9, 4);
  double squares = 0;
  for (const double value : values) squares += value * value;
  const double sigma = std::sqrt(squares / static_cast<double>(values.size()));
  std::vector<double> taus;
  for (double& value : values) {
    taus.push_back(0.3 * std::exp(0.5 * value / sigma));
    value = -std::expm1(-taus.back());
  }
  SpectrumOptions options = with_window(SpectrumWindow::none);
  const PowerSpectrum direct = power_spectrum(MemoryPlane(512, 512, taus), options, "tau", 1);
  options.opacity = true;
  const PowerSpectrum spectrum = power_spectrum(MemoryPlane(512, 512, values), options, "v", 1);
  EXPECT_NEAR(spectrum.fit.slope, direct.fit.slope, 1e-9);
  EXPECT_NEAR(spectrum.log_sigma, 0.5, 1e-9);
  EXPECT_NEAR(spectrum.sigma, direct.sigma, 1e-12);
  EXPECT_NEAR(spectrum.skewness, direct.skewness, 1e-9);
  options.logarithm = true;
  const PowerSpectrum logarithm = power_spectrum(MemoryPlane(512, 512, values), options, "v", 1);
  EXPECT_NEAR(logarithm.sigma, 0.5, 1e-9);
  EXPECT_NEAR(logarithm.mean, std::log(0.3), 1e-9);
  EXPECT_NEAR(logarithm.skewness, spectrum.log_skewness, 1e-9);
}

TEST(PowerSpectrum, OfExponentialsHasTheirSkewness) {
  std::mt19937_64 random(5);
  std::exponential_distribution<double> exponential;
  std::vector<double> values(1000 * 1000);
  for (double& value : values) value = exponential(random);
  const PowerSpectrum spectrum =
      power_spectrum(MemoryPlane(1000, 1000, values), SpectrumOptions(), "values", 1);
  // An exponential has the skewness 2; its logarithm is Gumbel's, with sigma pi/sqrt 6 and skewness
  // -1.1395.
  EXPECT_NEAR(spectrum.skewness, 2, 0.03);
  EXPECT_NEAR(spectrum.log_sigma, pi_value / std::sqrt(6), 0.005);
  EXPECT_NEAR(spectrum.log_skewness, -1.1395, 0.02);
}

TEST(PowerSpectrum, MissingPixelsBecomeTheMean) {
  std::vector<double> values(64 * 64, 2.0);
  values[100] = std::numeric_limits<double>::quiet_NaN();
  values[200] = std::numeric_limits<double>::infinity();
  const PowerSpectrum spectrum =
      power_spectrum(MemoryPlane(64, 64, values), SpectrumOptions(), "plane", 1);
  EXPECT_EQ(spectrum.missing, 2);
  EXPECT_EQ(spectrum.count, 64 * 64 - 2);
  for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) EXPECT_EQ(annulus.power, 0);
  EXPECT_TRUE(std::isnan(spectrum.fit.slope));
}

TEST(PowerSpectrum, Refuses) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(power_spectrum(MemoryPlane(5, 1, std::vector<double>(5)), {}, "plane", 1),
               InputError);
  EXPECT_THROW(power_spectrum(MemoryPlane(4, 4, std::vector<double>(16, nan)), {}, "plane", 1),
               InputError);
  class Huge final : public Plane {
   public:
    Huge() : Plane(2'000'000, 2'000'000) {}
    void read(const Area&, double*, std::ptrdiff_t) const override { FAIL() << "is read"; }
  };
  try {
    power_spectrum(Huge(), {}, "huge.fits", 1);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("huge.fits: the spectrum of 2000000 x 2000000 pixels "
                        "needs 29.1 TiB of memory"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace gamer::power_spectrum_test
