#pragma once

#include <cstdint>
#include <memory>
#include <optional>
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
#include "gamer/scene/spectral_probes.h"
#include "gamer/scene/spectrum.h"

namespace gamer {

class GalaxyLibrary;

/// One galaxy of a scene: its type, place and orientation. A scene point p has the coordinates
/// to_ball * (p - centre) in the ball frame.
struct PlacedGalaxy {
  std::shared_ptr<const Galaxy> galaxy;
  SharedText type;  ///< name of the galaxy file
  SharedText sed;   ///< name of the SED that replaces the components' SEDs; empty for none
  std::string id;
  std::size_t object = 0;  ///< index among the scene's objects
  glm::dvec3 centre;
  double radius = 1;         ///< scene units
  glm::dmat3 to_ball;        ///< lensing included
  glm::dvec3 pole;           ///< direction of its +z axis in the scene, without lensing
  double magnification = 1;  ///< of its flux by lensing
  /// Largest stretch from the image to the source by lensing.
  double source_stretch = 1;
  std::uint64_t seed = 1;
  double redshift = 0;
  /// Factor from the galaxy's light to pixel values (see Scene::unit). The light is the weight of
  /// SpectralBasis::weights() times the integral of the emissivity along a ray, in galaxy radii.
  double brightness = 1;
  bool is_absolute = false;  ///< whether its magnitude is absolute
  /// Whether its brightness was set so that its rays in this image add up to its magnitude.
  bool has_fixed_flux = false;
  /// A factor on the light of each emitting component; empty where all factors are 1. The factors
  /// make the rays of a galaxy of fixed flux give each component its share of the light without
  /// dust.
  std::vector<double> light_factors = {};
  double light_factor(std::size_t emitter) const {
    return light_factors.empty() ? 1 : light_factors[emitter];
  }
  /// Whether the galaxy is rendered alone, and then laid over the objects behind it (GalaxyLayer),
  /// in all its pixels. Other galaxies are rendered alone only in pixels that they share with such
  /// galaxies. Every galaxy of fixed flux is a layer.
  bool is_layer = false;
  /// Whether the stars of its star fields may be drawn one by one. Otherwise they are smooth light.
  bool draws_stars = true;
  /// Radius of a sphere around `centre` that holds the stretched ball, scene units.
  double bounding_radius = 1;
  /// Half-light radius along the major axis, lensing included, scene units; 0 unless the sizes of
  /// stamps need it.
  double half_light_radius = 0;
};

/// A point source.
struct PlacedStar {
  std::string id;
  std::size_t object = 0;
  glm::dvec3 direction;      ///< in a sky view
  glm::dvec2 pixel;          ///< pixel coordinates, from 0
  std::vector<double> flux;  ///< nJy, one per plane
  /// Divisor that converts Camera::solid_angle() to sr where the unit is one of surface brightness.
  double area_scale = 1;
};

/// Name of the column in Scene::others that holds the row of the catalogue.
inline constexpr const char* row_column = "row";
/// Prefix that a column in Scene::others gets if its name is that of a scene's column.
inline constexpr const char* clash_prefix = "cat_";

/// The objects of a scene; in a sky view only those that it shows.
struct Scene {
  std::vector<PlacedGalaxy> galaxies;
  std::vector<PlacedStar> stars;
  /// Unit of the pixels. In `relative` images, brightness times c F_nu is in Angstrom^2 and is then
  /// divided by the plane's wavelength^2. In other units, brightness gives nJy/sr; in orthographic
  /// views with a unit of flux, nJy per scene unit^2.
  PixelUnit unit = PixelUnit::relative;
  std::size_t objects = 0;  ///< galaxies and stars
  std::size_t rows = 0;     ///< rows of the catalogue
  std::size_t flagged = 0;  ///< rows of the catalogue that catalogue.skip_flagged left out
  /// Galaxies whose apparent magnitude is outside 5 to 40, and the first of them.
  struct Unlikely {
    std::size_t number = 0;
    double magnitude = 0;
    SourceLocation where;
  };
  Unlikely unlikely = {};
  std::vector<std::string> remarks = {};  ///< warnings about the catalogue's columns
  /// The objects of rows as a scene list, by object number; field stars ([stars]) have higher
  /// numbers. Read with equal parameters, the list gives an equal scene.
  SharedText list;
  std::vector<std::size_t> kept = {};  ///< [row of the list]: row of the catalogue, from 0
  /// The catalogue's columns that the list lacks, by row of the list. The first, `row`, is the row
  /// of the catalogue, from 1. See other_columns().
  DataTable others = {};
  /// In a region of a sky view, the probes of the whole image, so that the region has the image's
  /// spectral nodes. Without these probes the scene's own galaxies are probes.
  std::optional<SpectralProbes> probes = std::nullopt;
  /// Number of rows at the end of the list that are probes beyond the region, not objects.
  std::size_t extra_rows = 0;
};

/// Reads a scene. A row gives a galaxy's orientation in one of two ways.
/// - ox oy oz and pa: the galaxy is turned by pa about its axis (counterclockwise seen from +z),
///   then by the shortest turn (about z x o; for o = -z about x) that brings its +z to o.
/// - inclination and pa: inclination 0 is face-on to the camera. The line of nodes (the galaxy's x
///   axis) lies at angle pa from the image's +y towards -x; in a sky view from North towards East.
///   The axis is the direction to the camera, turned about the node by the inclination. In an
///   animation the first frame's camera counts; its scene list has ox oy oz and pa.
///
/// With axis_ratio, the inclination follows from the axis ratio of the light on the sky, by second
/// moments. With half_light_radius, the ball's size follows from the type's light without noise and
/// dust, seen face on (LightProfile).
///
/// g1, g2 and kappa distort a galaxy's image about its centre. The image at theta shows the source
/// at A theta, A = (1 - kappa) [[1 - g1, -g2], [-g2, 1 + g1]]. Coordinates are (North, East) in sky
/// views, otherwise the image's (+y, -x). Surface brightness is conserved, so that the flux grows
/// by 1/det A.
///
/// In a sky view positions are ra dec, or dx dy (in the tangent plane at the image's middle), or px
/// py. A galaxy stands at the comoving distance of its redshift or at distance/(1+z); with neither
/// it stands at 1000 Mpc, unredshifted. Objects that do not touch the image, or its region, are
/// left out. SkyMaker's pa, counted in the image, is turned by the image's direction there.
/// Galaxies of one type, SED and seed share one Galaxy. In galaxies without noise the seed has no
/// effect. If any object has a magnitude, all have one, except galaxies of dust alone.
///
/// Throws InputError with the place of the cell. Columns: unknown, repeated or missing; wrong
/// units. Values: bad numbers, out of their interval, zero orientation, unknown galaxies (with near
/// names). Rows: both ox.. and inclination; incomplete or repeated positions, sizes and magnitudes;
/// a missing distance; planes outside the range of an SED or extinction curve. Scenes: empty (a sky
/// view may be empty).
Scene read_scene(const Catalogue& catalogue, const RenderParameters& parameters,
                 const Spectrum& spectrum, const Camera& camera, Resources& resources);
/// Reads a scene with the galaxies of a library, and adds those that the library lacks. Once they
/// are measured, the scene equals that of the function above.
Scene read_scene(const Catalogue& catalogue, const RenderParameters& parameters,
                 const Spectrum& spectrum, const Camera& camera, Resources& resources,
                 GalaxyLibrary& library);
/// Reads a scene from a text, in the format of the parameters.
Scene read_scene(std::string_view text, const std::string& label,
                 const RenderParameters& parameters, const Spectrum& spectrum, const Camera& camera,
                 Resources& resources);

/// A text with the catalogue column and units for each scene column, one per line, then the unused
/// columns. Throws InputError as read_scene() does for columns.
std::string column_mapping(const Catalogue& catalogue, const RenderParameters& parameters);

}  // namespace gamer
