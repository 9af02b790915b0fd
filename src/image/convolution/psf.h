#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

enum class PsfKind { gaussian, moffat, airy, kolmogorov };

/// Shape of a PSF. Lengths are pixels. A PSF that is not round has the isophotes r^2 = q u^2 +
/// v^2/q = const, u along the major axis. These ellipses have the area of the round PSF's circles,
/// so that the peak is equal.
struct PsfModel {
  PsfKind kind = PsfKind::gaussian;
  double fwhm = 2;            ///< of the round PSF of equal area, ]0, inf[
  double beta = 3;            ///< exponent of the Moffat profile, ]1, inf[
  double obscuration = 0;     ///< of the Airy pattern: inner diameter over outer, [0, 1[
  double axis_ratio = 1;      ///< q, minor over major axis, ]0, 1]
  double position_angle = 0;  ///< of the major axis, deg, from +y towards -x
};

struct Stamp;
struct StampOptions;

/// A PSF of flux 1 over the whole plane, as a function of the r of PsfModel:
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

  /// Flux per square pixel at radius r.
  double density(double r) const;
  /// Flux per square pixel at (x, y) from the centre.
  double density(double x, double y) const;
  /// Share of the flux within r.
  double encircled_energy(double r) const;

  /// A scale-free profile: radii in units of the FWHM, flux 1.
  class Profile;

 private:
  friend Stamp make_stamp(const Psf& psf, const StampOptions& options);
  /// Highest spatial frequency along the minor axis, rad per pixel; 0 for none.
  double band_limit() const;
  /// This PSF with a table up to r for quick evaluation.
  Psf tabulated(double r) const;

  PsfModel model_;
  double sine_ = 0, cosine_ = 1;  ///< of the position angle
  std::shared_ptr<const Profile> profile_;
};

/// FWHM of an Airy pattern, in lambda/D.
double airy_fwhm(double obscuration);

/// A PSF sampled on pixels: `width` x `height` values, both odd, bottom row first. The PSF's centre
/// is the centre of the middle pixel.
struct Stamp {
  int width = 1;
  int height = 1;
  std::vector<double> values = {1.0};

  /// The value at (dx, dy) from the middle pixel.
  double at(int dx, int dy) const {
    return values[static_cast<std::size_t>(dy + height / 2) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(dx + width / 2)];
  }
  double sum() const;
};

/// Longest side of a stamp whose size is automatic, and of a stamp of given size or from a file.
inline constexpr int largest_chosen_stamp = 1023;
inline constexpr int largest_stamp = 4095;

struct StampOptions {
  int size = 0;           ///< side: odd, [1, largest_stamp]; 0: stamp_size() of `energy`
  double energy = 0.999;  ///< ]0, 1[
  /// Whether pixels are integrals over their area, to 1e-8 of the value; otherwise they are
  /// densities at their centres. Gaussians along the pixels' axes use the error function, other
  /// PSFs Gauss-Legendre quadrature.
  bool integrated = true;
  /// Whether flux beyond the stamp stays missing; otherwise the sum becomes 1.
  bool keep_missing_flux = false;
};

/// The smallest odd side whose square contains the isophote with the share `energy` of the flux; at
/// most largest_chosen_stamp.
int stamp_size(const Psf& psf, double energy);

/// Throws std::invalid_argument for options outside their intervals, or a stamp whose sum is zero
/// in double precision.
Stamp make_stamp(const Psf& psf, const StampOptions& options = {});

/// A PSF from an image, centred on the middle pixel, with the sum scaled to 1 unless `keep_flux`.
/// `label` begins messages. Throws InputError for sides that are even or above largest_stamp,
/// pixels that are not finite, and a sum that is not positive.
Stamp read_stamp(const Plane& image, const std::string& label, bool keep_flux = false);

}  // namespace gamer
