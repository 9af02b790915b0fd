#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "gamer/scene/camera.h"

namespace gamer {

/// Tests whether places on the sky are inside an image.
class ImageField {
 public:
  explicit ImageField(const Camera& camera);

  /// Whether the image's middle shows sky.
  bool has_center() const { return has_center_; }
  const glm::dvec3& center() const { return center_; }

  /// Whether something of angular radius `radius` (rad) may touch the image.
  bool holds(const glm::dvec3& direction, double radius) const;

 private:
  double pixel_angle() const { return camera_.pixel_size(center_); }

  const Camera& camera_;
  bool has_center_ = false;
  glm::dvec3 center_{1, 0, 0};
  std::optional<double> radius_;
};

}  // namespace gamer
