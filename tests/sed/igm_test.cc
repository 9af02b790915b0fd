#include "gamer/sed/igm.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gamer::igm_test {
namespace {

// The values are the sum in the header's comment, in 30-digit arithmetic.
TEST(Madau95, CheckValues) {
  struct Row {
    double wavelength, redshift, transmission;
  };
  const std::vector<Row> rows = {{4800, 3, 0.659406150497},   {4050, 3, 0.651832328123},
                                 {3850, 3, 0.607052900902},   {3700, 3, 0.584085116002},
                                 {3000, 3, 0.0520788196354},  {2000, 3, 0.024668826337},
                                 {900, 2, 0.215381255165},    {3000, 2, 0.859404768522},
                                 {1300, 0.5, 0.899899437318}, {6500, 5, 0.304583422944}};
  for (const Row& row : rows) {
    EXPECT_NEAR(madau95_transmission(row.wavelength, row.redshift) / row.transmission, 1, 3e-12)
        << row.wavelength << " at " << row.redshift;
  }
}

double line_transmission(double wavelength, double redshift) {
  struct Line {
    double wavelength, coefficient;
  };
  const std::vector<Line> lines = {{1216, 0.0036}, {1026, 0.0017}, {973, 0.0012}, {950, 0.00093}};
  double depth = 0;
  for (const Line& line : lines) {
    const double x = wavelength / line.wavelength;
    if (x > 1 && x <= 1 + redshift) depth += line.coefficient * std::pow(x, 3.46);
  }
  return std::exp(-depth);
}

// The double integral over redshift and column density N of 1 - exp(-N sigma) with the paper's
// distribution: 2.4e7 N^-1.5 (1+z)^2.46 from 2e12 to 1.59e17 cm^-2, 1.9e8 N^-1.5 (1+z)^0.68 from
// there to 1e20; sigma = 6.3e-18 cm^2 (lambda/912 Angstrom)^3.
TEST(Madau95, ContinuumIsTheIntegralOverClouds) {
  struct Row {
    double rest_wavelength, redshift, depth;
  };
  const std::vector<Row> rows = {
      {900, 1, 0.04922}, {700, 1, 0.65606}, {500, 1, 0.88638}, {300, 1, 0.52284},
      {100, 1, 0.07675}, {900, 2, 0.12755}, {700, 2, 1.57670}, {500, 2, 1.97486},
      {300, 2, 1.54972}, {100, 2, 0.25719}, {900, 3, 0.27068}, {700, 3, 3.14750},
      {500, 3, 3.67281}, {300, 3, 2.70606}, {100, 3, 0.53856}, {900, 4, 0.50686},
      {700, 4, 5.62526}, {500, 4, 6.17659}, {300, 4, 4.24415}, {100, 4, 0.91814},
      {900, 5, 0.86814}, {700, 5, 9.30347}, {500, 5, 9.71415}, {300, 5, 6.25345},
      {100, 5, 1.39456}};
  for (const Row& row : rows) {
    const double wavelength = row.rest_wavelength * (1 + row.redshift);
    const double continuum = madau95_transmission(wavelength, row.redshift) /
                             line_transmission(wavelength, row.redshift);
    EXPECT_NEAR(continuum, std::exp(-row.depth), 0.02)
        << row.rest_wavelength << " at " << row.redshift;
    EXPECT_NEAR(-std::log(continuum) / row.depth, 1, 0.06)
        << row.rest_wavelength << " at " << row.redshift;
  }
}

TEST(Madau95, OneWhereNothingAbsorbs) {
  for (const double redshift : {0.0, 0.1, 1.0, 3.0, 6.0}) {
    EXPECT_EQ(madau95_transmission(1216.001 * (1 + redshift), redshift), 1) << redshift;
    EXPECT_EQ(madau95_transmission(1e6, redshift), 1) << redshift;
  }
  for (const double wavelength : {91.0, 500.0, 912.0, 950.0, 1216.0, 5500.0}) {
    EXPECT_EQ(madau95_transmission(wavelength, 0), 1) << wavelength;
  }
}

// With the approximate continuum, transmission falls with redshift only above 74 Angstrom in the
// rest frame.
TEST(Madau95, WithinZeroAndOneAndFallsWithRedshift) {
  for (double wavelength = 10; wavelength < 12000; wavelength *= 1.01) {
    double nearer = 1;
    for (double redshift = 0; redshift < 9; redshift += 0.05) {
      const double transmission = madau95_transmission(wavelength, redshift);
      EXPECT_GE(transmission, 0);
      EXPECT_LE(transmission, 1);
      if (wavelength / (1 + redshift) < 74) continue;
      EXPECT_LE(transmission, nearer) << wavelength << " at " << redshift;
      nearer = transmission;
    }
  }
}

TEST(Madau95, StepsOnlyAtTheLines) {
  constexpr double redshift = 3;
  constexpr double offset = 1e-9;
  const auto step = [](double wavelength) {
    return std::log(madau95_transmission(wavelength * (1 + offset), redshift) /
                    madau95_transmission(wavelength, redshift));
  };
  // The depth of a single line ends here: A_j (1+z)^3.46.
  EXPECT_NEAR(step(1216 * 4), 0.0036 * std::pow(4, 3.46), 3e-9);
  EXPECT_NEAR(step(1026 * 4), 0.0017 * std::pow(4, 3.46), 3e-9);
  EXPECT_NEAR(step(973 * 4), 0.0012 * std::pow(4, 3.46), 3e-9);
  EXPECT_NEAR(step(950 * 4), 0.00093 * std::pow(4, 3.46), 3e-9);
  // The continuum starts from 0, and the transmission has no step where absorbers reach the
  // observer.
  EXPECT_NEAR(step(912 * 4), 0, 4e-9);
  EXPECT_NEAR(step(912), 0, 4e-9);
}

// The transmission is smooth between kinks: three points predict the fourth.
TEST(Madau95, KinksAreAllWhereItBends) {
  for (const double z : {0.0, 0.2, 3.0, 6.0}) {
    const auto kinks = madau95_kinks(z);
    EXPECT_TRUE(std::is_sorted(kinks.begin(), kinks.end()));
    constexpr double step = 0.05;
    std::size_t jumps = 0;
    for (double w = 800; w < 1300 * (1 + z); w += step) {
      const auto at = [&](int k) { return madau95_transmission(w + k * step, z); };
      const double bend = at(0) - 3 * at(1) + 3 * at(2) - at(3);
      const bool has_kink = std::any_of(kinks.begin(), kinks.end(), [&](double kink) {
        return kink >= w && kink <= w + 3 * step;
      });
      EXPECT_TRUE(has_kink || std::abs(bend) < 1e-7) << w << " at " << z;
      jumps += std::abs(bend) > 1e-7;
    }
    EXPECT_EQ(jumps > 0, z > 0);
  }
}

}  // namespace
}  // namespace gamer::igm_test
