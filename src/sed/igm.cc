#include "gamer/sed/igm.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace gamer {
namespace {

struct Line {
  double wavelength;  ///< Angstrom
  double coefficient;
};
/// Lyman alpha to delta: tau = A_j (lambda/lambda_j)^3.46 (Eqs. 12 and 15).
constexpr std::array<Line, 4> lyman_series = {
    {{1216, 0.0036}, {1026, 0.0017}, {973, 0.0012}, {950, 0.00093}}};
constexpr double line_exponent = 3.46;

/// Absorption needs an absorber, at redshift lambda/lambda_j - 1, between observer and source.
double line_depth(double wavelength, double emission) {
  double depth = 0;
  for (const Line& line : lyman_series) {
    const double absorber = wavelength / line.wavelength;
    if (absorber > 1 && absorber <= emission) {
      depth += line.coefficient * std::pow(absorber, line_exponent);
    }
  }
  return depth;
}

/// Footnote 3 of the paper. Differences of powers are integrals over the redshifts of absorbers up
/// to the source. The integrals begin where the light has the wavelength of the Lyman limit, or at
/// the observer.
double continuum_depth(double wavelength, double emission) {
  const double limit = wavelength / lyman_limit;
  if (limit >= emission) return 0;
  const double nearest = std::max(limit, 1.0);
  const auto rise = [&](double exponent) {
    return std::pow(emission, exponent) - std::pow(nearest, exponent);
  };
  const double cube = limit * limit * limit;
  const double depth = 0.25 * cube * rise(0.46) + 9.4 * limit * std::sqrt(limit) * rise(0.18) +
                       0.7 * cube * rise(-1.32) - 0.023 * rise(1.68);
  // The last term treats the thickest clouds as opaque, which they are not in the extreme
  // ultraviolet.
  return std::max(depth, 0.0);
}

}  // namespace

double madau95_transmission(double wavelength, double redshift) {
  assert(wavelength > 0 && redshift >= 0);
  const double emission = 1 + redshift;
  return std::exp(-line_depth(wavelength, emission) - continuum_depth(wavelength, emission));
}

std::array<double, 10> madau95_kinks(double redshift) {
  std::array<double, 10> result = {lyman_limit, lyman_limit * (1 + redshift)};
  static_assert(std::size(result) == 2 + 2 * lyman_series.size());
  auto* place = result.begin() + 2;
  for (const Line& line : lyman_series) {
    *place++ = line.wavelength;
    *place++ = line.wavelength * (1 + redshift);
  }
  std::ranges::sort(result);
  return result;
}

}  // namespace gamer
