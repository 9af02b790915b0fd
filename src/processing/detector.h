#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "gamer/image/plane.h"

namespace gamer {

/// What a CCD makes of light. A pixel of value v collects
///
///     mu = (electron_rate max(v, 0) + sky_rate + dark_rate) exposure
///
/// electrons in the mean, and reads N = Poisson(mu) + Normal(0, read_noise sqrt(exposures)), at
/// most full_well for each exposure. The output is N per_electron + offset. Negative v, which the
/// ringing of kernels leaves, count as 0: no light is less than none. NaN stays NaN.
///
/// For the sum over n pixels of a source of S electrons/s this is the CCD equation,
/// S/N = S t / sqrt(S t + n (B t + D t + R^2)).
struct Detector {
  double electron_rate = 1;  ///< electrons/s of a pixel of value 1
  double sky_rate = 0;       ///< electrons/s
  double dark_rate = 0;      ///< electrons/s
  double exposure = 1;       ///< s, of all exposures together
  int exposures = 1;
  double read_noise = 0;                                       ///< electrons rms, of one exposure
  double full_well = std::numeric_limits<double>::infinity();  ///< electrons, of one exposure
  double per_electron = 1;                                     ///< output units
  double offset = 0;                                           ///< output units

  /// Electrons in the mean that are no light of the source.
  double background() const { return (sky_rate + dark_rate) * exposure; }
  /// The output where the counts are at their most.
  double saturation() const { return full_well * exposures * per_electron + offset; }
};

/// Where the random numbers of a plane come from: its label (band or wavelength, see PlaneInfo)
/// and, where several planes of a file have one label, which of them it is, from 0. So a band has
/// the same noise in a cube, in any order of planes and alone in its file, and bands of separate
/// files differ although the seed is one. Noise is a function of this key and the pixel's place.
std::uint64_t noise_key(std::uint64_t seed, std::string_view label, int occurrence = 0);

/// The plane as the detector reads it.
PlanePtr observed(PlanePtr source, const Detector& detector, std::uint64_t key);

/// The variance that `observed` has around its mean, in output units squared:
/// (mu + exposures read_noise^2) per_electron^2. Saturation does not count.
PlanePtr observed_variance(PlanePtr source, const Detector& detector);

/// Plus Normal(0, sigma).
PlanePtr with_gaussian_noise(PlanePtr source, double sigma, std::uint64_t key);

/// sigma^2 where the source has a value.
PlanePtr gaussian_variance(PlanePtr source, double sigma);

/// sqrt(sum v^2) of the pixels that are no NaN. Divided by the sigma of a pixel, this is the
/// signal-to-noise ratio of the flux in a matched filter, and so the largest that any weights give.
double signal_norm(const Plane& plane, int threads = 1);

}  // namespace gamer
