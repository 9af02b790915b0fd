#pragma once

#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "gamer/image/wcs.h"

namespace gamer {

/// A gnomonic projection (TAN of Calabretta & Greisen 2002, section 5.1.3): a plane touches the
/// celestial sphere, and the pixels are a grid on this plane. Pixel (x, y) looks along
///     middle + (x - x0) step_x + (y - y0) step_y,
/// where the tangent point (x0, y0) looks along the unit vector `middle`, at right angles to both
/// steps. The class gives the directions of CelestialWcs to rounding, without trigonometric
/// functions.
class TangentPlane {
 public:
  /// The plane of a WCS; nothing for other projections and for distorted images.
  static std::optional<TangentPlane> of(const CelestialWcs& wcs);

  /// Unit vector of a place, in the pixel coordinates of Camera.
  glm::dvec3 direction(double x, double y) const;
  /// The place where a point is seen; nothing where the point is not in front of the observer.
  std::optional<glm::dvec2> pixel(const glm::dvec3& point) const;
  /// A vector whose dot product with the points that are seen right of x (axis 0) or above y (axis
  /// 1) is positive.
  glm::dvec3 inward(int axis, double place) const;

 private:
  TangentPlane(const glm::dvec2& tangent_point, const glm::dvec3& middle, const glm::dvec3& step_x,
               const glm::dvec3& step_y);

  glm::dvec2 tangent_point_;
  glm::dvec3 middle_, step_x_, step_y_;
  glm::dvec3 inverse_x_, inverse_y_;  ///< their dot products with the steps are 1 (own step) and 0
};

}  // namespace gamer
