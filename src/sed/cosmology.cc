#include "gamer/sed/cosmology.h"

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cassert>
#include <cmath>
#include <stdexcept>

namespace gamer {
namespace {

constexpr double speed_of_light_km_s = 299792.458;
constexpr double largest_redshift = 1e4;
constexpr double parsec_per_megaparsec = 1e6;
constexpr double modulus_distance = 10;  // pc

// The quadrature overestimates its error, so this gives 1e-9 easily.
constexpr double quadrature_tolerance = 1e-10;
constexpr unsigned quadrature_depth = 15;

double expansion_rate(double omega_m, double one_plus_z) {
  return std::sqrt(omega_m * one_plus_z * one_plus_z * one_plus_z + (1 - omega_m));
}

}  // namespace

Cosmology::Cosmology(double h0, double omega_m) : h0_(h0), omega_m_(omega_m) {
  if (!(h0 > 0 && std::isfinite(h0))) throw std::invalid_argument("H0 is outside ]0, inf[");
  if (!(omega_m >= 0 && omega_m <= 1)) throw std::invalid_argument("Omega_m is outside [0, 1]");
}

double Cosmology::hubble_distance() const { return speed_of_light_km_s / h0_; }

double Cosmology::comoving_distance(double redshift) const {
  assert(redshift >= 0 && redshift < largest_redshift);
  if (redshift == 0) return 0;
  // In x = ln(1+z) the integrand is smooth up to the largest redshift.
  const auto integrand = [this](double x) {
    const double one_plus_z = std::exp(x);
    return one_plus_z / expansion_rate(omega_m_, one_plus_z);
  };
  return hubble_distance() *
         boost::math::quadrature::gauss_kronrod<double, 15>::integrate(
             integrand, 0.0, std::log1p(redshift), quadrature_depth, quadrature_tolerance);
}

double Cosmology::luminosity_distance(double redshift) const {
  return (1 + redshift) * comoving_distance(redshift);
}

double Cosmology::distance_modulus(double redshift) const {
  return 5 * std::log10(luminosity_distance(redshift) * parsec_per_megaparsec / modulus_distance);
}

}  // namespace gamer
