#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "gamer/scene/camera.h"

namespace gamer {

/// How a galaxy is turned: the columns are its x, y and z axes in the scene. Angles in degrees.

/// The galaxy's +z points along `direction` (any length but 0); before that it is turned by `pa`
/// about its own axis, counterclockwise seen from +z. The turn from +z to `direction` is the
/// shortest: about z x direction; for direction = -z about x.
glm::dmat3 orientation_along(const glm::dvec3& direction, double pa);

/// The `pa` with which orientation_along() of their z axis gives these axes.
double turn_about_axis(const glm::dmat3& axes);

/// As the camera sees a galaxy at `centre`: its x axis is the line of nodes, in the plane of the
/// sky at the angle `pa` from the image's +y towards -x; its z axis is the direction to the camera
/// turned about the node by `inclination`.
glm::dmat3 orientation_on_sky(const Camera& camera, const glm::dvec3& centre, double inclination,
                              double pa);

}  // namespace gamer
