#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "gamer/core/resources.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"

namespace gamer {

/// One galaxy of a scene: its type and where it stands. A scene point p is, in the ball frame,
/// to_ball * (p - centre).
struct PlacedGalaxy {
  std::shared_ptr<const Galaxy> galaxy;
  std::string type;  ///< name of the galaxy file
  std::string id;
  glm::dvec3 centre;
  double radius = 1;  ///< scene units
  glm::dmat3 to_ball;
  std::uint64_t seed = 1;
  /// Radius of a sphere around `centre` that holds the stretched ball, scene units.
  double bounding_radius = 1;
};

struct Scene {
  std::vector<PlacedGalaxy> galaxies;
};

/// The declared columns of a scene list.
const ParameterTable& scene_columns();

/// Reads a scene list (FORMATS: '#' comments, a header row of column names, one galaxy per row; '-'
/// means the default). Orientation by ox oy oz and pa: the galaxy's +z points along o; before
/// that the galaxy is turned by pa about its own axis (counterclockwise seen from +z), and the turn
/// from +z to o is the shortest (about z x o; for o = -z about x). By inclination and pa:
/// inclination 0 is face-on to the camera; the line of nodes (the galaxy's x axis) lies at angle pa
/// from the image's +y towards -x; the axis is the direction to the camera turned about the node by
/// the inclination. Galaxies of the same type and seed share one Galaxy. Throws InputError with
/// line and column: unknown, repeated or missing columns, rows of wrong length, bad numbers, values
/// out of their interval, an empty scene, zero orientation, both ox.. and inclination, unknown
/// galaxies (with near names), a wavelength of `parameters` outside the range of an SED or
/// extinction curve in use.
Scene read_scene(std::string_view text, const std::string& label,
                 const RenderParameters& parameters, const Camera& camera, Resources& resources);

}  // namespace gamer
