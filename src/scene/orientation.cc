#include "scene/orientation.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

namespace gamer {
namespace {

/// The shortest turn from +z to the unit vector o:
/// R = 1 + [v] + [v]^2 / (1 + o.z), v = z x o, [v] its cross product matrix.
glm::dmat3 turn_from_z(const glm::dvec3& o) {
  const double sine2 = o.x * o.x + o.y * o.y;
  if (sine2 == 0) return o.z > 0 ? glm::dmat3(1) : glm::dmat3({1, 0, 0}, {0, -1, 0}, {0, 0, -1});
  // 1 / (1 + o.z), without cancellation near o = -z.
  const double f = o.z > 0 ? 1 / (1 + o.z) : (1 - o.z) / sine2;
  return {{1 - f * o.x * o.x, -f * o.x * o.y, -o.x},
          {-f * o.x * o.y, 1 - f * o.y * o.y, -o.y},
          {o.x, o.y, o.z}};
}

}  // namespace

glm::dmat3 orientation_along(const glm::dvec3& direction, double pa) {
  // Scaled first, since squares of very long or short vectors overflow or underflow.
  const glm::dvec3 size = glm::abs(direction);
  const double largest = std::max({size.x, size.y, size.z});
  const double angle = glm::radians(pa);
  const double c = std::cos(angle), s = std::sin(angle);
  return turn_from_z(glm::normalize(direction / largest)) *
         glm::dmat3({c, s, 0}, {-s, c, 0}, {0, 0, 1});
}

double turn_about_axis(const glm::dmat3& axes) {
  const glm::dvec3 x = glm::transpose(turn_from_z(axes[2])) * axes[0];
  return glm::degrees(std::atan2(x.y, x.x));
}

SkyAxes sky_axes(const Camera& camera, const glm::dvec3& centre) {
  const glm::dvec3 towards = camera.towards(centre);
  // For a galaxy straight above or below the camera, the image's up is undefined there, but its
  // right is not.
  const glm::dvec3 across = glm::cross(camera.up_at(centre), towards);
  constexpr double smallest_sine = 1e-9;
  const glm::dvec3 right =
      glm::length(across) > smallest_sine
          ? glm::normalize(across)
          : glm::normalize(camera.right() - glm::dot(camera.right(), towards) * towards);
  return {towards, glm::cross(towards, right), right};
}

glm::dmat3 orientation_on_sky(const Camera& camera, const glm::dvec3& centre, double inclination,
                              double pa) {
  const auto [towards, up, right] = sky_axes(camera, centre);
  const double a = glm::radians(pa), i = glm::radians(inclination);
  const glm::dvec3 node = std::cos(a) * up - std::sin(a) * right;
  const glm::dvec3 axis = std::cos(i) * towards + std::sin(i) * glm::cross(node, towards);
  return {node, glm::cross(axis, node), axis};
}

}  // namespace gamer
