#pragma once

#include <boost/math/tools/roots.hpp>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>

#include "image/convolution/psf.h"

namespace gamer {

/// A profile with radii in units of the FWHM.
class Psf::Profile {
 public:
  virtual ~Profile() = default;
  virtual double density(double r) const = 0;
  virtual double energy(double r) const = 0;
  /// Highest spatial frequency in the density, rad per FWHM; 0 where there is no limit.
  virtual double band_limit() const { return 0; }
  /// A table of the density up to the radius `last`, for quick evaluation; null where the density
  /// itself is quick.
  virtual std::shared_ptr<const Profile> tabulated(double last) const {
    static_cast<void>(last);
    return nullptr;
  }
};

/// The zero of `f`, whose signs differ at both ends, to the last bits.
template <class Function>
double root(Function f, double low, double high) {
  constexpr int bit_count = std::numeric_limits<double>::digits - 3;
  constexpr std::uintmax_t most_steps = 200;
  std::uintmax_t steps = most_steps;
  const auto [a, b] = boost::math::tools::toms748_solve(
      f, low, high, boost::math::tools::eps_tolerance<double>(bit_count), steps);
  return std::midpoint(a, b);
}

/// exp(-k r^2) k/pi is a Gaussian of FWHM 1.
inline constexpr double gaussian_exponent = 4 * std::numbers::ln2;

/// The profile of a model.
std::shared_ptr<const Psf::Profile> make_profile(const PsfModel& model);

}  // namespace gamer
