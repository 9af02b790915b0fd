#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

enum class PsfKind { gaussian, moffat, airy, kolmogorov };

/// What a point source looks like. Lengths are pixels. A PSF that is not round has the ellipses
/// r^2 = q u^2 + v^2/q = const as isophotes, u along the major axis: its area, and with it the
/// peak, is that of the round one.
struct PsfModel {
  PsfKind kind = PsfKind::gaussian;
  double fwhm = 2;            ///< of the round PSF of the same area, ]0, inf[
  double beta = 3;            ///< exponent of the Moffat profile, ]1, inf[
  double obscuration = 0;     ///< of the Airy pattern: inner over outer diameter, [0, 1[
  double axis_ratio = 1;      ///< q, minor over major axis, ]0, 1]
  double position_angle = 0;  ///< of the major axis, deg, from +y towards -x
};

struct Stamp;
struct StampOptions;

/// A PSF with the flux 1 over the whole plane, as a function of r (above):
///
/// - Gaussian: exp(-r^2/(2 s^2)) / (2 pi s^2), FWHM = 2 sqrt(2 ln 2) s.
/// - Moffat 1969 (A&A 3, 455): (beta-1)/(pi a^2) (1 + r^2/a^2)^-beta,
///   FWHM = 2 a sqrt(2^(1/beta) - 1).
/// - Airy pattern of an aperture with the central obscuration e (Born & Wolf 1999, section 8.6.2):
///   I ~ {[2 J1(x)/x - e^2 2 J1(e x)/(e x)] / (1 - e^2)}^2, x = pi D r/lambda.
/// - Kolmogorov turbulence, long exposure (Fried 1966, JOSA 56, 1372): the Hankel transform of
///   exp(-3.4419 f^(5/3)), r in units of lambda/r0, f in units of r0/lambda. Tabulated up to
///   r = 6 lambda/r0 and its series in r^(-5/3) beyond; relative error below 1e-9.
class Psf {
 public:
  /// Throws std::invalid_argument for values outside the model's intervals.
  explicit Psf(const PsfModel& model);

  const PsfModel& model() const { return model_; }

  /// Flux per square pixel at the radius r.
  double density(double r) const;
  /// Density of the flux at (x, y) from the centre.
  double density(double x, double y) const;
  /// The share of the flux within r.
  double encircled_energy(double r) const;
  /// The radius that has the share `energy`, ]0, 1[, of the flux.
  double energy_radius(double energy) const;

  /// A scale-free profile: radii in units of the FWHM, flux 1.
  class Profile;

 private:
  friend Stamp make_stamp(const Psf& psf, const StampOptions& options);
  /// Rad per pixel along the minor axis, 0 for none.
  double band_limit() const;
  /// This PSF with a table up to r, which makes it quicker.
  Psf tabulated(double r) const;

  PsfModel model_;
  double sine_ = 0, cosine_ = 1;  ///< of the position angle
  std::shared_ptr<const Profile> profile_;
};

/// FWHM of an Airy pattern in units of lambda/D.
double airy_fwhm(double obscuration);

/// A PSF on pixels: `width` x `height` values, both odd, bottom row first, the PSF's centre on the
/// centre of the middle pixel.
struct Stamp {
  int width = 1;
  int height = 1;
  std::vector<double> values = {1.0};

  /// At (dx, dy) from the middle pixel.
  double at(int dx, int dy) const {
    return values[static_cast<std::size_t>(dy + height / 2) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(dx + width / 2)];
  }
  double sum() const;
};

/// Longest side of a stamp whose size is chosen, and of one that is asked for or read.
inline constexpr int kLargestChosenStamp = 1023;
inline constexpr int kLargestStamp = 4095;

struct StampOptions {
  int size = 0;           ///< odd, [1, kLargestStamp]; 0: stamp_size() of `energy`
  double energy = 0.999;  ///< ]0, 1[
  /// Pixels are integrals over their area, to 1e-8 of the value: Gaussians along the pixels' axes
  /// by the error function, others by Gauss-Legendre quadrature. Otherwise the density at
  /// their centres.
  bool integrated = true;
  /// Keep what lies beyond the stamp missing. Otherwise the sum becomes 1.
  bool keep_missing_flux = false;
};

/// The smallest odd side whose square holds the isophote with the share `energy` of the flux; at
/// most kLargestChosenStamp.
int stamp_size(const Psf& psf, double energy);

/// Throws std::invalid_argument for options outside their intervals, or a stamp whose sum is zero
/// in double precision.
Stamp make_stamp(const Psf& psf, const StampOptions& options = {});

/// A PSF from an image, its centre on the centre of the middle pixel, scaled to the sum 1 unless
/// `keep_flux`. `label` opens messages. Throws InputError: sides that are even or above
/// kLargestStamp, pixels that are not finite, a sum that is not positive.
Stamp read_stamp(const Plane& image, const std::string& label, bool keep_flux = false);

}  // namespace gamer
