#include "scene/image_field.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace gamer {

ImageField::ImageField(const Camera& camera) : camera_(camera) {
  const std::optional<Ray> middle =
      camera.ray(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  if (!middle) return;
  has_center_ = true;
  center_ = middle->direction;
  // The border, pixel edges included.
  constexpr int samples = 128;
  double least = 1;
  for (int i = 0; i <= samples; ++i) {
    const double share = static_cast<double>(i) / samples;
    const double x = share * camera.width() - 0.5, y = share * camera.height() - 0.5;
    for (const auto& ray : {camera.ray(x, -0.5), camera.ray(x, camera.height() - 0.5),
                            camera.ray(-0.5, y), camera.ray(camera.width() - 0.5, y)}) {
      if (!ray) return;
      least = std::min(least, glm::dot(ray->direction, center_));
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
  if (reach < std::numbers::pi && glm::dot(direction, center_) < std::cos(reach)) return false;
  const std::optional<glm::dvec2> pixel = camera_.pixel(direction);
  // In a narrow field distortions stay well below a factor of 1.5.
  const double margin = 1.5 * radius / (camera_.pixel_aspect() * pixel_angle()) + 2;
  return !pixel || (pixel->x > -margin && pixel->x < camera_.width() - 1 + margin &&
                    pixel->y > -margin && pixel->y < camera_.height() - 1 + margin);
}

}  // namespace gamer
