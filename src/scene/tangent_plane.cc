#include "scene/tangent_plane.h"

#include <array>

#include <glm/geometric.hpp>

#include "gamer/scene/camera.h"

namespace gamer {

std::optional<TangentPlane> TangentPlane::of(const CelestialWcs& wcs) {
  const std::optional<PixelPosition> tangent_point = wcs.tangent_point();
  if (!tangent_point) return std::nullopt;
  const auto direction_at = [&](double right, double up) -> std::optional<glm::dvec3> {
    const auto sky = wcs.sky({tangent_point->x + right, tangent_point->y + up});
    if (!sky) return std::nullopt;
    return direction_of(*sky);
  };
  const std::optional<glm::dvec3> middle = direction_at(0, 0);
  if (!middle) return std::nullopt;
  std::array<glm::dvec3, 2> steps;
  for (int axis = 0; axis < 2; ++axis) {
    // The first pass finds the length of a pixel on the plane. The second measures the step over a
    // long way, to rounding.
    double way = 1;
    for (const double length : {0.0, 0.5}) {
      if (length > 0) way = length / glm::length(steps[axis]);
      const double end = (axis == 0 ? tangent_point->x : tangent_point->y) + way;
      way = end - (axis == 0 ? tangent_point->x : tangent_point->y);
      const auto there = direction_at(axis == 0 ? way : 0, axis == 0 ? 0 : way);
      if (!there) return std::nullopt;
      const glm::dvec3 across = *there / glm::dot(*there, *middle) - *middle;
      steps[axis] = (across - glm::dot(across, *middle) * *middle) / way;
    }
  }
  // Camera counts pixels from 0.
  return TangentPlane({tangent_point->x - 1, tangent_point->y - 1}, *middle, steps[0], steps[1]);
}

TangentPlane::TangentPlane(const glm::dvec2& tangent_point, const glm::dvec3& middle,
                           const glm::dvec3& step_x, const glm::dvec3& step_y)
    : tangent_point_(tangent_point), middle_(middle), step_x_(step_x), step_y_(step_y) {
  inverse_x_ = glm::cross(step_y, middle);
  inverse_y_ = glm::cross(middle, step_x);
  inverse_x_ /= glm::dot(inverse_x_, step_x);
  inverse_y_ /= glm::dot(inverse_y_, step_y);
}

glm::dvec3 TangentPlane::direction(double x, double y) const {
  return glm::normalize(middle_ + (x - tangent_point_.x) * step_x_ +
                        (y - tangent_point_.y) * step_y_);
}

std::optional<glm::dvec2> TangentPlane::pixel(const glm::dvec3& point) const {
  const double along = glm::dot(point, middle_);
  if (!(along > 0)) return std::nullopt;
  // The small difference keeps digits that dot products with the point would lose.
  const glm::dvec3 away = point / along - middle_;
  return tangent_point_ + glm::dvec2(glm::dot(away, inverse_x_), glm::dot(away, inverse_y_));
}

glm::dvec3 TangentPlane::inward(int axis, double place) const {
  return axis == 0 ? inverse_x_ - (place - tangent_point_.x) * middle_
                   : inverse_y_ - (place - tangent_point_.y) * middle_;
}

}  // namespace gamer
