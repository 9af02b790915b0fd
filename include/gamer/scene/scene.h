#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "gamer/core/resources.h"
#include "gamer/core/shared_text.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene_columns.h"
#include "gamer/scene/spectrum.h"

namespace gamer {

class GalaxyLibrary;

/// One galaxy of a scene: its type and where it stands. A scene point p is, in the ball frame,
/// to_ball * (p - centre).
struct PlacedGalaxy {
  std::shared_ptr<const Galaxy> galaxy;
  SharedText type;  ///< name of the galaxy file
  SharedText sed;   ///< where it replaces those of the components
  std::string id;
  std::size_t object = 0;  ///< its place among the scene's objects
  glm::dvec3 centre;
  double radius = 1;  ///< scene units
  glm::dmat3 to_ball;
  std::uint64_t seed = 1;
  double redshift = 0;
  /// What a unit of its light (SpectralBasis::weights() times the integral of the emissivity along
  /// a ray, galaxy radii) is in an image: see Scene::unit.
  double brightness = 1;
  bool is_absolute = false;  ///< its magnitude
  /// Radius of a sphere around `centre` that holds the stretched ball, scene units.
  double bounding_radius = 1;
};

/// A point source.
struct PlacedStar {
  std::string id;
  std::size_t object = 0;
  glm::dvec3 direction;      ///< in a sky view
  glm::dvec2 pixel;          ///< from 0
  std::vector<double> flux;  ///< nJy, of each plane
  /// Camera::solid_angle() over it is in sr where the unit is one of surface brightness.
  double area_scale = 1;
};

/// A scene's objects, those that a sky view shows.
struct Scene {
  std::vector<PlacedGalaxy> galaxies;
  std::vector<PlacedStar> stars;
  /// Unit of the pixels. In `relative` images brightness times c F_nu is in Angstrom^2, to be
  /// divided by the plane's wavelength^2. Else brightness gives nJy/sr; in orthographic views with
  /// a unit of flux, nJy per scene unit^2.
  PixelUnit unit = PixelUnit::relative;
  std::size_t objects = 0;  ///< galaxies and stars
  std::size_t rows = 0;     ///< of the catalogue
  /// The objects of rows as a scene list, in the order of their numbers, behind which field stars
  /// ([stars]) have theirs: reads back to the same scene with the same parameters.
  SharedText list;
};

/// Reads a scene. Orientation by ox oy oz and pa: the galaxy's +z points along o; before that the
/// galaxy is turned by pa about its own axis (counterclockwise seen from +z), and the turn from +z
/// to o is the shortest (about z x o; for o = -z about x). By inclination and pa: inclination 0 is
/// face-on to the camera; the line of nodes (the galaxy's x axis) lies at angle pa from the image's
/// +y towards -x (a sky view: from North towards East); the axis is the direction to the camera
/// turned about the node by the inclination. The camera of a film is that of its first frame: the
/// scene's list has ox oy oz and pa instead, which frames share.
///
/// In a sky view positions are ra dec, or dx dy (in the plane that touches the sky in the image's
/// middle), or px py. Galaxies stand at the comoving distance of their redshift, or at
/// distance/(1+z); those with neither at 1000 Mpc, unredshifted. What does not touch the image is
/// left out. SkyMaker's pa, which counts in the image, is turned by the image's direction there.
/// Galaxies of the same type, SED and seed share one Galaxy; so do those of any seed without noise.
/// Where there are magnitudes every object has one, but for galaxies of dust alone.
///
/// Throws InputError with the place of the cell: unknown, repeated or missing columns, units that
/// do not fit, bad numbers, values out of their interval, an empty scene (a sky view may be empty),
/// zero orientation, both ox.. and inclination, incomplete or repeated positions, sizes and
/// magnitudes, what needs a distance and has none, unknown galaxies (with near names), planes
/// outside the range of an SED or extinction curve at the galaxy's redshift.
Scene read_scene(const Catalogue& catalogue, const RenderParameters& parameters,
                 const Spectrum& spectrum, const Camera& camera, Resources& resources);
/// With galaxies of a library, which gets those that it lacks; it is the same scene once they are
/// measured.
Scene read_scene(const Catalogue& catalogue, const RenderParameters& parameters,
                 const Spectrum& spectrum, const Camera& camera, Resources& resources,
                 GalaxyLibrary& library);
/// Reads a scene from a text, in the format of the parameters.
Scene read_scene(std::string_view text, const std::string& label,
                 const RenderParameters& parameters, const Spectrum& spectrum, const Camera& camera,
                 Resources& resources);

}  // namespace gamer
