#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "gamer/core/batch.h"

namespace gamer {

/// Sample points in a galaxy's ball frame (the ball of radius 1, disk plane z = 0), with quantities
/// that its components share.
struct SampleBatch {
  std::size_t size = 0;
  BatchArray x, y, z;
  BatchArray r;        ///< sqrt(x^2 + y^2)
  BatchArray azimuth;  ///< atan2(y, x); only where some component has arms
  BatchArray winding;  ///< theta(r); only where some component has arms or twirl
  BatchArray shear;    ///< r dtheta/dr; only with footprints and where some component has twirl
  BatchArray taper;    ///< 1 inside, falling smoothly to 0 at the ball's surface
};

/// The rays that see the points of a batch.
struct RayBatch {
  BatchArray footprint;  ///< width of the area that the ray represents, galaxy radii
  BatchArray obliquity;  ///< ln of the ray's path per height above the plane
  /// Whether Phi of components that emit is divided by its mean over the component. Phi of dust
  /// always is.
  bool divides_light = true;
};

/// Footprint below which rays resolve every texture.
inline constexpr float smallest_footprint = 1e-10f;

/// The taper falls from 1 at this radius to 0 at the ball's surface, as the quintic smoothstep
/// 6u^5 - 15u^4 + 10u^3, which is twice continuously differentiable.
inline constexpr double taper_start = 0.7;

/// Largest stretch by a shear gamma: gamma/2 + sqrt(1 + gamma^2/4).
inline double stretch_of(double shear) {
  const double half = 0.5 * std::abs(shear);
  return half + std::sqrt(1 + half * half);
}

/// The taper at a distance from the centre.
inline double taper_at(double radius) {
  const double u = std::clamp((1 - radius) / (1 - taper_start), 0.0, 1.0);
  return u * u * u * (u * (6 * u - 15) + 10);
}

}  // namespace gamer
