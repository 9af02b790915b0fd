#include "scene/image_field.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace gamer {

ImageField::ImageField(const Camera& camera, const ImageRegion& part)
    : camera_(camera), part_(part) {
  if (const auto ray = camera.ray(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1))) {
    has_center_ = true;
    center_ = ray->direction;
  }
  const std::optional<Ray> middle =
      camera.ray(part.left + 0.5 * (part.width - 1), part.bottom + 0.5 * (part.height - 1));
  if (!middle) return;
  middle_ = middle->direction;
  const double left = part.left - 0.5, bottom = part.bottom - 0.5;
  // Places along the border, pixel edges included.
  constexpr int samples = 128;
  double least = 1;
  for (int i = 0; i <= samples; ++i) {
    const double share = static_cast<double>(i) / samples;
    const double x = left + share * part.width, y = bottom + share * part.height;
    for (const auto& ray : {camera.ray(x, bottom), camera.ray(x, part.top() - 0.5),
                            camera.ray(left, y), camera.ray(part.right() - 0.5, y)}) {
      if (!ray) return;
      least = std::min(least, glm::dot(ray->direction, middle_));
    }
  }
  // A wider field may contain the pole or the whole sky.
  constexpr double widest = std::numbers::pi / 6;
  const double angle = std::acos(std::clamp(least, -1.0, 1.0));
  if (angle < widest) radius_ = angle * (1 + 1e-3) + 2 * pixel_angle();
}

bool ImageField::holds(const glm::dvec3& direction, double radius) const {
  if (!radius_) return true;
  const double reach = *radius_ + radius;
  if (reach < std::numbers::pi && glm::dot(direction, middle_) < std::cos(reach)) return false;
  const std::optional<glm::dvec2> pixel = camera_.pixel(direction);
  // In a narrow field distortions stay well below a factor of 1.5.
  const double margin = 1.5 * radius / (camera_.pixel_aspect() * pixel_angle()) + 2;
  return !pixel || (pixel->x > part_.left - margin && pixel->x < part_.right() - 1 + margin &&
                    pixel->y > part_.bottom - margin && pixel->y < part_.top() - 1 + margin);
}

}  // namespace gamer
