#include "gamer/sed/cosmology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace gamer::cosmology_test {
namespace {

// docs/facts.md section 4; each tolerance is half a unit of the last place given.
TEST(Cosmology, CheckValues) {
  struct Row {
    double z, comoving, luminosity, modulus;
  };
  const std::vector<Row> rows = {{0.1, 418.454, 460.300, 38.3152},
                                 {0.5, 1888.625, 2832.938, 42.2612},
                                 {1, 3303.829, 6607.658, 44.1002},
                                 {2, 5179.862, 15539.586, 45.9572},
                                 {3, 6355.685, 25422.742, 47.0261}};
  const Cosmology cosmology;
  EXPECT_NEAR(cosmology.hubble_distance(), 4282.749, 0.5e-3);
  for (const Row& row : rows) {
    EXPECT_NEAR(cosmology.comoving_distance(row.z), row.comoving, 0.51e-3) << row.z;
    EXPECT_NEAR(cosmology.luminosity_distance(row.z), row.luminosity, 0.51e-3) << row.z;
    EXPECT_NEAR(cosmology.distance_modulus(row.z), row.modulus, 0.51e-4) << row.z;
  }
}

// The values are those of FlatLambdaCDM(H0, Om0, Tcmb0=0) of Astropy 5.2.1, to the ten digits
// printed.
TEST(Cosmology, AgreesWithAstropy) {
  struct Row {
    double h0, omega_m, z, comoving, luminosity, modulus;
  };
  const std::vector<Row> rows = {{70, 0.3, 0.01, 42.73092581, 43.15823507, 33.17531838},
                                 {70, 0.3, 1, 3303.828806, 6607.657612, 44.10023766},
                                 {70, 0.3, 7, 8627.602323, 69020.81859, 49.19490053},
                                 {70, 0.3, 1100, 13683.51051, 15065545.07, 60.88992425},
                                 {67.4, 0.315, 0.1, 434.1109946, 477.5220941, 38.39496735},
                                 {67.4, 0.315, 2, 5312.075392, 15936.22618, 46.01192742}};
  // The unit is the tenth digit of a number that starts with 1.
  constexpr double digits = 5e-10;
  for (const Row& row : rows) {
    const Cosmology cosmology(row.h0, row.omega_m);
    EXPECT_NEAR(cosmology.comoving_distance(row.z) / row.comoving, 1, digits) << row.z;
    EXPECT_NEAR(cosmology.luminosity_distance(row.z) / row.luminosity, 1, digits) << row.z;
    EXPECT_NEAR(cosmology.distance_modulus(row.z) / row.modulus, 1, digits) << row.z;
  }
}

// Einstein-de Sitter: D_C = 2 c/H0 (1 - (1+z)^-1/2); without matter: c z/H0.
TEST(Cosmology, ClosedForms) {
  const Cosmology matter(100, 1);
  const Cosmology empty(73, 0);
  for (const double z : {1e-12, 1e-3, 0.1, 1.0, 10.0, 1100.0, 9999.0}) {
    const double root = std::sqrt(1 + z);
    const double expected = 2 * matter.hubble_distance() * z / (root * (1 + root));
    EXPECT_NEAR(matter.comoving_distance(z) / expected, 1, 5e-16) << z;
    EXPECT_NEAR(empty.comoving_distance(z) / (empty.hubble_distance() * z), 1, 2.5e-15) << z;
  }
}

TEST(Cosmology, Limits) {
  const Cosmology cosmology;
  EXPECT_EQ(cosmology.comoving_distance(0), 0);
  EXPECT_EQ(cosmology.luminosity_distance(0), 0);
  EXPECT_EQ(cosmology.distance_modulus(0), -std::numeric_limits<double>::infinity());
  // Hubble's law, with q0 = 3/2 Omega_m - 1: D_L = c/H0 (z + (1 - q0) z^2/2 + O(z^3)).
  constexpr double z = 1e-3;
  constexpr double q0 = 1.5 * 0.3 - 1;
  EXPECT_NEAR(cosmology.luminosity_distance(z) / cosmology.hubble_distance(),
              z + (1 - q0) * z * z / 2, 0.6 * z * z * z);
}

TEST(Cosmology, RefusesOtherParameters) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double h0 : {0.0, -70.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(Cosmology(h0, 0.3), std::invalid_argument) << h0;
  }
  for (const double omega_m : {-0.1, 1.1, nan}) {
    EXPECT_THROW(Cosmology(70, omega_m), std::invalid_argument) << omega_m;
  }
}

}  // namespace
}  // namespace gamer::cosmology_test
