#pragma once

#include "gamer/image/plane.h"
#include "processing/aperture.h"

namespace gamer {

/// The value of eta, the brightness at r over the mean brightness within r, at the Petrosian radius
/// (Petrosian 1976, ApJ 210, L53). The value is that of Conselice 2003 (ApJS 147, 1).
inline constexpr double petrosian_eta = 0.2;

/// The smallest semi-major axis r, in pixels, at which eta(r) = I(r)/<I>(<r) falls below
/// petrosian_eta. I(r) is the mean between the ellipses r - 1/2 and r + 1/2, with exact fractions
/// of pixels. The search begins at 1.5 pixels and ends at `largest`. Throws InputError where there
/// is no light within an ellipse, or eta stays above petrosian_eta.
double petrosian_radius(const Plane& plane, const Ellipses& ellipses, double largest, int threads);

/// The largest semi-major axis whose ellipse lies within the plane.
double largest_radius_within(const Plane& plane, const Ellipses& ellipses);

}  // namespace gamer
