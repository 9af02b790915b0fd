#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "gamer/image/plane.h"

namespace gamer {

/// A model of a CCD. A pixel of value v collects on average
///
///     mu = (electron_rate max(v, 0) + sky_rate + dark_rate) exposure
///
/// electrons, and reads N = Poisson(mu) + Normal(0, read_noise sqrt(exposures)), at most full_well
/// for each exposure. The output is N per_electron + offset. Negative v, such as the ringing of
/// kernels, count as 0. NaN stays NaN.
///
/// The sum over n pixels of a source of S electrons/s follows the CCD equation, S/N = S t / sqrt(S
/// t + n (B t + D t + R^2)).
struct Detector {
  double electron_rate = 1;  ///< electrons/s of a pixel of value 1
  double sky_rate = 0;       ///< electrons/s
  double dark_rate = 0;      ///< electrons/s
  double exposure = 1;       ///< total of all exposures, s
  int exposures = 1;
  double read_noise = 0;                                       ///< rms of one exposure, electrons
  double full_well = std::numeric_limits<double>::infinity();  ///< of one exposure, electrons
  double per_electron = 1;                                     ///< output units
  double offset = 0;                                           ///< output units

  /// Mean number of electrons of a pixel from sky and dark current.
  double background() const { return (sky_rate + dark_rate) * exposure; }
  /// Output value of a full pixel.
  double saturation() const { return full_well * exposures * per_electron + offset; }
};

/// Key of a plane's random numbers. It follows from the seed, the plane's label (band or
/// wavelength, see PlaneInfo) and `occurrence`. The occurrence is the plane's number, from 0, among
/// planes with equal labels in a file. A band thus has equal noise in a cube, in any order of
/// planes and alone in a file. Bands of one seed have different noise. Noise is a function of this
/// key and the pixel's place.
std::uint64_t noise_key(std::uint64_t seed, std::string_view label, int occurrence = 0);

/// The plane as the detector reads it.
PlanePtr observed(PlanePtr source, const Detector& detector, std::uint64_t key);

/// The variance of `observed` around its mean, in output units squared: (mu + exposures
/// read_noise^2) per_electron^2. Saturation is neglected.
PlanePtr observed_variance(PlanePtr source, const Detector& detector);

/// The source plus noise of Normal(0, sigma).
PlanePtr with_gaussian_noise(PlanePtr source, double sigma, std::uint64_t key);

/// sigma^2 where the source has a value; elsewhere NaN.
PlanePtr gaussian_variance(PlanePtr source, double sigma);

/// sqrt(sum v^2) over pixels that are not NaN. Divided by the sigma of a pixel it is the
/// signal-to-noise ratio of the flux with a matched filter, the largest of all weightings.
double signal_norm(const Plane& plane, int threads = 1);

}  // namespace gamer
