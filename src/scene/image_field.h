#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "gamer/scene/camera.h"

namespace gamer {

/// Tests whether places on the sky are inside a part of an image.
class ImageField {
 public:
  ImageField(const Camera& camera, const ImageRegion& part);

  /// Whether the whole image's middle shows sky.
  bool has_center() const { return has_center_; }
  const glm::dvec3& center() const { return center_; }

  /// Whether something of angular radius `radius` (rad) may touch the part.
  bool holds(const glm::dvec3& direction, double radius) const;

 private:
  double pixel_angle() const { return camera_.pixel_size(center_); }

  const Camera& camera_;
  ImageRegion part_;
  bool has_center_ = false;
  glm::dvec3 center_{1, 0, 0};
  glm::dvec3 middle_{1, 0, 0};    ///< of the part
  std::optional<double> radius_;  ///< angular radius around its middle; none for a wide part
};

}  // namespace gamer
