#pragma once

#include "gamer/image/plane.h"
#include "processing/aperture.h"

namespace gamer {

/// The radius at which a galaxy ends, Petrosian radii.
inline constexpr double galaxy_extent = 1.5;

/// A point of an image; pixels count from 0.
struct PlanePoint {
  double x = 0, y = 0;
};

/// The middle of the pixel where the mean over a square of 1/32 of the image's longer side (at
/// least 3 pixels) is largest. Missing pixels count as 0. Throws InputError where the mean is not
/// above 0.
PlanePoint brightest_place(const Image& image);

/// Circles about a galaxy's centroid, and its Petrosian radius.
struct CentredLight {
  Ellipses circles;
  double petrosian = 0;
};
/// The centroid of the light within 1.5 Petrosian radii. The circle is moved from `start` to the
/// centroid until a step is below 0.1 pixels, at most 10 times. Throws what petrosian_radius()
/// throws.
CentredLight centre_of_light(const Plane& plane, const PlanePoint& start, int threads);

/// The nucleus: the centroid of the light within a tenth of the Petrosian radius, whose circle
/// moves from `start` as recentered() does. Throws what recentered() and petrosian_radius() throw.
PlanePoint nucleus_of(const Plane& plane, const PlanePoint& start, int threads);

/// Ellipses that follow a galaxy's light, and their Petrosian radius.
struct EllipticalLight {
  Ellipses ellipses;
  double axis_ratio = 1;
  double angle = 0;  ///< of the major axis, rad from +x towards +y
  double petrosian = 0;
};
/// Ellipses with the centre of `start`, and the axis ratio and angle of the light's moments within
/// the ellipse of 1.5 Petrosian radii. The measurement is repeated in the new ellipse until axis
/// ratio and angle no longer change, at most 20 times. Throws what petrosian_radius() throws.
EllipticalLight elliptical_light(const Plane& plane, const Ellipses& start, int threads);

}  // namespace gamer
