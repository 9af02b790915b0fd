#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "gamer/scene/camera.h"

namespace gamer {

/// Unit vectors at a place: towards the camera, the image's up (+y, in sky views North), and the
/// image's right (+x, in sky views West).
struct SkyAxes {
  glm::dvec3 towards, up, right;
};
SkyAxes sky_axes(const Camera& camera, const glm::dvec3& centre);

/// Orientation matrices of galaxies: the columns are the galaxy's x, y and z axes in the scene.
/// Angles are in degrees.

/// The galaxy is turned by `pa` about its axis, counterclockwise seen from +z. Then the shortest
/// turn (about z x direction; for direction = -z about x) points its +z along `direction`, a vector
/// of any length but 0.
glm::dmat3 orientation_along(const glm::dvec3& direction, double pa);

/// The `pa` for which orientation_along(z axis, pa) gives these axes.
double turn_about_axis(const glm::dmat3& axes);

/// Orientation of a galaxy at `centre` relative to the camera. Its x axis is the line of nodes, in
/// the plane of the sky at the angle `pa` from the image's +y towards -x. Its z axis is the
/// direction to the camera, turned about the node by `inclination`.
glm::dmat3 orientation_on_sky(const Camera& camera, const glm::dvec3& centre, double inclination,
                              double pa);

}  // namespace gamer
