#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gamer/image/plane.h"
#include "gamer/image/wcs.h"
#include "processing/statistics.h"

namespace gamer {

/// Concentric ellipses of one axis ratio and angle on a plane of pixels. Pixel (x, y), counted from
/// 0, is the square of side 1 around (x, y). For an offset d from the centre, (u, v) = A d has u
/// along the major and v along the minor axis. A stretches v so that u^2 + v^2 = r^2 is the ellipse
/// of semi-major axis r.
class Ellipses {
 public:
  /// Ellipses with semi-major axes in pixels; `angle` of the major axis in rad from +x towards +y.
  /// Throws std::invalid_argument unless 0 < axis_ratio <= 1 and all numbers are finite.
  Ellipses(double x, double y, double axis_ratio = 1, double angle = 0);
  /// Ellipses on the sky, with semi-major axes in arcsec; `position_angle` in rad from North
  /// towards East. The sky coordinates are linearised at (x, y). Throws InputError where that pixel
  /// shows no sky.
  Ellipses(const CelestialWcs& wcs, double x, double y, double axis_ratio, double position_angle);

  double x() const { return x_; }
  double y() const { return y_; }
  Ellipses moved_to(double x, double y) const;

  /// Semi-major axis of the ellipse through (x, y).
  double radius(double x, double y) const;
  double area(double radius) const;  ///< pixels
  /// Half-width of the square box around the ellipse, pixels.
  double half_width(double radius) const;
  double half_height(double radius) const;
  /// Fraction of a pixel's area within the ellipse, in [0, 1], from the exact overlap of a
  /// parallelogram and a circle. The absolute error is below 1e-10.
  double overlap(int x, int y, double radius) const;
  /// Largest difference between radius() within a pixel and at its centre.
  double pixel_reach() const { return pixel_reach_; }

 private:
  void set(double ux, double uy, double vx, double vy);

  double x_, y_;
  double ux_ = 1, uy_ = 0, vx_ = 0, vy_ = 1;
  double determinant_ = 1;
  double pixel_reach_ = 0;
};

/// Converts between position angles on the sky (from North towards East, rad, [0, pi[) and angles
/// on the pixels (from +x towards +y, rad) at (x, y). Both throw InputError where that pixel shows
/// no sky.
double position_angle_on_sky(const CelestialWcs& wcs, double x, double y, double angle);
double angle_on_pixels(const CelestialWcs& wcs, double x, double y, double position_angle);
struct LightMoments;
/// Position angle on the sky of the major axis of light with these moments on the pixels at (x, y).
/// Where pixels are not square on the sky, the major axis there differs from that on the pixels.
double position_angle_on_sky(const CelestialWcs& wcs, double x, double y,
                             const LightMoments& light);

/// The light within one ellipse. Pixels that are not finite are missing and add nothing.
struct ApertureSum {
  double flux = 0;           ///< sum of (v - background) * overlap
  double area = 0;           ///< covered area without missing pixels, pixels
  std::int64_t missing = 0;  ///< pixels that are not finite, wholly or partly inside
};

/// One sum for each of `radii`, in any order. The box around the largest ellipse is read once.
std::vector<ApertureSum> aperture_sums(const Plane& plane, const Ellipses& ellipses,
                                       std::span<const double> radii, double background,
                                       int threads);

/// The smallest semi-major axis whose ellipse contains `flux`, from the exact growth curve. The
/// curve is sampled at 64 radii up to `largest`, then again within the first step that reaches
/// `flux`, until few pixels remain. The root is then found to 1e-12. NaN where no step reaches
/// `flux`.
double radius_of_flux(const Plane& plane, const Ellipses& ellipses, double flux, double largest,
                      double background, int threads);

enum class BackgroundMethod { median, mean, clipped };

/// Background from pixels whose centres lie between two ellipses: median and mad_sigma, mean and
/// sigma, or clipped_background() at 3 sigma. NaN where there are no such pixels.
Background annulus_background(const Plane& plane, const Ellipses& ellipses, double inner,
                              double outer, BackgroundMethod method, int threads);

/// Second moments of light in pixels^2, about its centroid (counted from 0). The finite size of
/// pixels adds 1/12 to xx and yy.
struct LightMoments {
  double flux = 0;
  double x = 0, y = 0;
  double xx = 0, yy = 0, xy = 0;

  double size() const;  ///< sqrt(xx + yy)
  double e1() const { return (xx - yy) / (xx + yy); }
  double e2() const { return 2 * xy / (xx + yy); }
  /// Angle of the major axis, rad from +x towards +y, ]-pi/2, pi/2].
  double angle() const;
  /// Square root of the minor principal moment over the major; NaN where one is negative.
  double axis_ratio() const;
};

/// Moments of the light within an ellipse, with pixels weighted by their overlap. Unless the flux
/// is positive, all other values are NaN.
LightMoments moments(const Plane& plane, const Ellipses& ellipses, double radius, double background,
                     int threads);

/// The ellipses, moved repeatedly to the centroid of the light within `radius`, until a step is
/// below 1e-6 pixels (at most 50 steps). Throws InputError where the flux is not positive.
Ellipses recentered(const Plane& plane, const Ellipses& ellipses, double radius, double background,
                    int threads);

/// LightMoments weighted with the Gaussian ellipse that they describe (Bernstein & Jarvis 2002, AJ
/// 123, 583, section 3.1): w = exp(-d M^-1 d / 2), M = 2 sum(w v d d) / sum(w v), about the
/// centroid sum(w v d) = 0. The iteration starts from a circle of `sigma` pixels at the centre of
/// `ellipses` and ends when M changes by less than 1e-9. Pixels beyond 6 sigma or beyond the
/// ellipse of semi-major axis `radius` do not count. `flux` is that of the Gaussian, 2 sum(w v).
/// The result is empty if 200 steps do not converge.
std::optional<LightMoments> adaptive_moments(const Plane& plane, const Ellipses& ellipses,
                                             double radius, double sigma, double background,
                                             int threads);

}  // namespace gamer
