#include "gamer/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <numbers>
#include <optional>
#include <unordered_map>
#include <utility>

#include "gamer/core/units.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"
#include "gamer/scene/animation.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/sed/igm.h"
#include "scene/field_stars.h"
#include "scene/orientation.h"
#include "scene/scene_row.h"

namespace gamer {
namespace {

constexpr std::string_view star_type = "star";
constexpr const char* star_sed = "flat_fnu";

// Distance of a sky view's galaxies for which none is given, Mpc.
constexpr double nominal_distance = 1000;
constexpr double ten_parsec = 1e-5;  // Mpc
constexpr double kiloparsec = 1e-3;  // Mpc

// Largest number of stars in an image: they are kept in memory.
constexpr std::size_t most_stars = 20'000'000;
// Factor within which the number of stars is known beforehand.
constexpr double surely = 2;

// A smaller redshift (a few parsecs) gives no useful distance; 0 means light that is not shifted.
constexpr double smallest_redshift = 1e-9;
// Largest flux (nJy) and pi times the brightness (nJy/sr) of a galaxy. Its peaks then fit a pixel
// in any unit; pixel values end at 3e38.
constexpr double largest_flux = 1e28;
constexpr double largest_brightness = 1e35;

/// The orientation of the selected row, as the galaxy's axes in the scene.
glm::dmat3 read_axes(const SceneRow& row, const glm::dvec3& centre, const Camera& camera) {
  using namespace column;
  std::optional<Column> given, missing;
  for (const Column c : {ox, oy, oz}) {
    std::optional<Column>& first = row.is_given(c) ? given : missing;
    if (!first) first = c;
  }
  const bool is_sky = camera.projection() == Projection::sky;
  if (is_sky || row.is_given(inclination)) {
    if (given) row.fail(inclination, "inclination excludes ox oy oz; give one or the other");
    const double angle = row.is_given(inclination) ? row.number(inclination) : 0;
    return orientation_on_sky(camera, centre, angle, row.number(pa));
  }
  if (given && missing) {
    row.fail(*given, fmt::format("{} needs ox, oy and oz; {} has no value",
                                 scene_columns()[*given].name, scene_columns()[*missing].name));
  }
  const glm::dvec3 direction{row.number(ox), row.number(oy), row.number(oz)};
  if (direction == glm::dvec3(0)) row.fail(ox, "ox oy oz = 0 0 0 is no direction");
  return orientation_along(direction, row.number(pa));
}

/// Sets to_ball and bounding_radius from radius, axes and stretch.
void place(PlacedGalaxy& placed, const glm::dmat3& axes, const SceneRow& row) {
  const std::vector<double>& stretch = placed.galaxy->axis();
  for (int i = 0; i < 3; ++i) {
    const double semi_axis = placed.radius * stretch[static_cast<std::size_t>(i)];
    // glm stores columns: row i of to_ball is galaxy axis i over its semi-axis.
    for (int k = 0; k < 3; ++k) placed.to_ball[k][i] = axes[i][k] / semi_axis;
    if (!std::isfinite(1 / semi_axis) || !std::isfinite(semi_axis)) {
      row.fail(column::size, fmt::format("size = {} is too {}", placed.radius,
                                         semi_axis < 1 ? "small" : "large"));
    }
  }
  placed.bounding_radius = placed.radius * *std::max_element(stretch.begin(), stretch.end());
}

/// Tests whether places on the sky are inside an image.
class ImageField {
 public:
  explicit ImageField(const Camera& camera) : camera_(camera) {
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

  /// Whether the image's middle shows sky.
  bool has_center() const { return has_center_; }
  const glm::dvec3& center() const { return center_; }

  /// Whether something of angular radius `radius` (rad) may touch the image.
  bool holds(const glm::dvec3& direction, double radius) const {
    if (!radius_) return true;
    const double reach = *radius_ + radius;
    if (reach < std::numbers::pi && glm::dot(direction, center_) < std::cos(reach)) return false;
    const std::optional<glm::dvec2> pixel = camera_.pixel(direction);
    // In a narrow field distortions stay well below a factor of 1.5.
    const double margin = 1.5 * radius / (camera_.pixel_aspect() * pixel_angle()) + 2;
    return !pixel || (pixel->x > -margin && pixel->x < camera_.width() - 1 + margin &&
                      pixel->y > -margin && pixel->y < camera_.height() - 1 + margin);
  }

 private:
  double pixel_angle() const { return camera_.pixel_size(center_); }

  const Camera& camera_;
  bool has_center_ = false;
  glm::dvec3 center_{1, 0, 0};
  std::optional<double> radius_;
};

/// Reads the rows of one catalogue.
class SceneReader {
 public:
  SceneReader(const Catalogue& catalogue, const RenderParameters& parameters,
              const Spectrum& spectrum, const Camera& camera, Resources& resources,
              GalaxyLibrary& library)
      : catalogue_(catalogue),
        parameters_(parameters),
        spectrum_(spectrum),
        camera_(camera),
        resources_(resources),
        row_(catalogue, parameters),
        library_(library),
        is_sky_(camera.projection() == Projection::sky) {
    if (parameters.frames == 0) return;
    first_camera_.emplace(frame_parameters(parameters, CameraPath(parameters), 0));
    if (row_.has(column::inclination)) row_.fix_orientation();
  }

  Scene read();

 private:
  /// Place of the selected row's object, and its distances in Mpc.
  struct Position {
    glm::dvec3 centre;
    double redshift = 0;
    std::optional<double> luminosity_distance;
    double comoving_distance = nominal_distance;
  };
  void choose_unit();
  Position read_position(const ImageField* field) const;
  glm::dvec3 read_direction(const ImageField& field) const;
  double read_angular_radius(const Position& position) const;
  void turn_to_north();
  /// Orientation of the selected row; in an animation, that of the first frame.
  glm::dmat3 orient(const glm::dvec3& centre);
  void read_galaxy(const Position& position, double radius);
  /// False for a star that does not touch the image.
  bool read_star(const Position& position);
  /// The stars of [stars], which follow the rows' objects.
  void add_field_stars(const ImageField& field);
  /// Pixel coordinates of a star that touches the image; nothing for others.
  std::optional<glm::dvec2> star_pixel(const glm::dvec3& direction) const;
  /// Flux (nJy) of the row's magnitude over that of a unit source. In the reference band that
  /// source has the flux `rest` unredshifted at 10 pc, and `observed` as it is seen.
  double flux_scale(const Position& position, double rest, double observed) const;
  double brightness(const PlacedGalaxy& placed, const Position& position);
  /// One shared text for all galaxies with a name.
  const SharedText& shared(const std::string& name);
  /// Distance from the camera, scene units; 1 at a galaxy's very centre. There any distance will
  /// do: seen from within, a galaxy's flux is meaningless, and its brightness does not depend on
  /// distance.
  double distance_of(const glm::dvec3& centre) const {
    const double distance = camera_.distance(centre);
    return distance > 0 ? distance : 1;
  }
  /// Angle of a scene unit at the row's distance, rad; an orthographic view does not show it.
  double angle_of_unit(const Position& position) const;
  void check_band(const Sed& sed, const Bandpass& band, double redshift, const std::string& what,
                  const SourceLocation& where) const;
  void check_planes(const PlacedGalaxy& placed);

  const Catalogue& catalogue_;
  const RenderParameters& parameters_;
  const Spectrum& spectrum_;
  const Camera& camera_;
  std::optional<Camera> first_camera_;  ///< of an animation
  Resources& resources_;
  SceneRow row_;
  GalaxyLibrary& library_;
  bool is_sky_;
  std::shared_ptr<const Bandpass> reference_;
  /// Least and greatest redshift at which a galaxy's spectra were found to cover all planes.
  std::unordered_map<const Galaxy*, std::pair<double, double>> checked_;
  std::map<std::string, SharedText, std::less<>> names_;
  Scene scene_;
  std::string list_;
};

void SceneReader::choose_unit() {
  const bool has_magnitudes = row_.has(column::magnitude) || row_.has(column::apparent_magnitude);
  scene_.unit =
      parameters_.pixel_unit.value_or(has_magnitudes ? PixelUnit::nanojansky : PixelUnit::relative);
  // Pixels of relative images are a grid of rays.
  if (scene_.unit == PixelUnit::relative) library_.keep_closures_apart();
  if (has_magnitudes && scene_.unit == PixelUnit::relative) {
    throw InputError(parameters_.pixel_unit_where,
                     fmt::format("unit = \"relative\", but the objects of {} have magnitudes",
                                 catalogue_.label()));
  }
  if (!has_magnitudes && scene_.unit != PixelUnit::relative) {
    throw InputError(
        parameters_.pixel_unit_where,
        fmt::format("unit = {} needs magnitudes; {} has no column 'magnitude' or "
                    "'apparent_magnitude'",
                    value_text(parameters_.section("image").value("unit")), catalogue_.label()));
  }
  if (has_magnitudes) reference_ = load_reference_band(parameters_, resources_);
}

glm::dvec3 SceneReader::read_direction(const ImageField& field) const {
  using namespace column;
  constexpr std::pair<Column, Column> ways[] = {{ra, dec}, {dx, dy}, {px, py}};
  const std::pair<Column, Column>* way = nullptr;
  for (const auto& pair : ways) {
    const bool first = row_.is_given(pair.first), second = row_.is_given(pair.second);
    const auto& names = scene_columns();
    if (first != second) {
      row_.fail(first ? pair.first : pair.second,
                fmt::format("{} without {}", names[first ? pair.first : pair.second].name,
                            names[first ? pair.second : pair.first].name));
    }
    if (!first) continue;
    if (way != nullptr) {
      row_.fail(pair.first, fmt::format("both {} {} and {} {}; give one position",
                                        names[way->first].name, names[way->second].name,
                                        names[pair.first].name, names[pair.second].name));
    }
    way = &pair;
  }
  if (way == nullptr) row_.fail(galaxy, "no position: give ra and dec, dx and dy, or px and py");
  const double a = row_.number(way->first), b = row_.number(way->second);
  if (way == &ways[0]) return direction_of({a, b});
  if (way == &ways[1]) {
    if (!field.has_center()) row_.fail(dx, "dx dy: the image's middle shows no sky");
    const glm::dvec3 north = camera_.up_at(field.center());
    const glm::dvec3 east = glm::cross(north, field.center());
    return glm::normalize(field.center() + std::tan(a * arcsecond) * east +
                          std::tan(b * arcsecond) * north);
  }
  const std::optional<Ray> ray = camera_.ray(a - 1, b - 1);
  if (!ray) row_.fail(px, fmt::format("pixel {}, {} shows no sky", a, b));
  return ray->direction;
}

SceneReader::Position SceneReader::read_position(const ImageField* field) const {
  Position position;
  position.redshift = row_.number(column::redshift);
  if (position.redshift > 0 && position.redshift < smallest_redshift) {
    row_.fail(column::redshift, fmt::format("redshift = {} is neither 0 nor at least {}",
                                            position.redshift, smallest_redshift));
  }
  if (row_.is_given(column::distance)) {
    position.luminosity_distance = row_.number(column::distance);
    position.comoving_distance = *position.luminosity_distance / (1 + position.redshift);
  } else if (position.redshift > 0) {
    position.comoving_distance = parameters_.cosmology.comoving_distance(position.redshift);
    position.luminosity_distance = (1 + position.redshift) * position.comoving_distance;
  }
  if (field == nullptr) {
    position.centre = {row_.number(column::x), row_.number(column::y), row_.number(column::z)};
    // Where the camera has a position, the scene itself gives the distances.
    if (const std::optional<double> unit = parameters_.megaparsec();
        unit && has_place(camera_.projection())) {
      const double stretch = 1 + position.redshift;
      position.luminosity_distance = distance_of(position.centre) * *unit * stretch * stretch;
    }
    return position;
  }
  position.centre = position.comoving_distance * read_direction(*field);
  return position;
}

/// Converts the selected row's pa from the image's frame (from +y towards -x at the object's place)
/// to the sky's (from North towards East).
void SceneReader::turn_to_north() {
  using namespace column;
  const double x = row_.number(px) - 1, y = row_.number(py) - 1;
  const double angle = glm::radians(row_.number(pa));
  constexpr double step = 0.5;  // pixels
  const std::optional<Ray> here = camera_.ray(x, y);
  const std::optional<Ray> ahead =
      camera_.ray(x - step * std::sin(angle), y + step * std::cos(angle));
  if (!here || !ahead) row_.fail(pa, "the image shows no sky where the object's pa points");
  const glm::dvec3 north = camera_.up_at(here->direction);
  const glm::dvec3 east = glm::cross(north, here->direction);
  row_.replace(pa, glm::degrees(std::atan2(glm::dot(ahead->direction, east),
                                           glm::dot(ahead->direction, north))));
}

double SceneReader::read_angular_radius(const Position& position) const {
  using namespace column;
  const bool has_kpc = row_.is_given(size_kpc), has_arcsec = row_.is_given(size_arcsec);
  if (has_kpc && has_arcsec) row_.fail(size_arcsec, "both size_kpc and size_arcsec; give one");
  if (has_arcsec) return row_.number(size_arcsec) * arcsecond;
  if (!has_kpc) row_.fail(galaxy, "no size: give size_kpc or size_arcsec");
  if (!position.luminosity_distance) {
    row_.fail(size_kpc, "size_kpc without a distance; give redshift or distance");
  }
  return row_.number(size_kpc) * kiloparsec * (1 + position.redshift) / position.comoving_distance;
}

double SceneReader::flux_scale(const Position& position, double rest, double observed) const {
  using namespace column;
  const bool is_absolute = row_.is_given(magnitude);
  if (is_absolute && row_.is_given(apparent_magnitude)) {
    row_.fail(apparent_magnitude, "both magnitude and apparent_magnitude; give one");
  }
  if (!is_absolute && !row_.is_given(apparent_magnitude)) {
    row_.fail(galaxy, "no magnitude: objects with and without cannot be mixed");
  }
  const auto checked = [&](double flux, Column given) {
    if (flux <= largest_flux) return flux;
    row_.fail(given, fmt::format("{} = {} makes it of apparent magnitude {:.1f}, too bright for "
                                 "the numbers of an image: above {:.1f} is right",
                                 scene_columns()[given].name, row_.number(given),
                                 ab_magnitude(flux), ab_magnitude(largest_flux)));
  };
  if (!is_absolute) {
    return checked(nanojansky(row_.number(apparent_magnitude)), apparent_magnitude) / observed;
  }
  if (!position.luminosity_distance) {
    row_.fail(magnitude,
              is_sky_ ? "magnitude without a distance; give redshift or distance, or "
                        "apparent_magnitude"
              : has_place(camera_.projection())
                  ? "magnitude without a distance: scene.unit is arbitrary"
                  : "magnitude without a distance: an orthographic view has none; give redshift "
                    "or distance, or apparent_magnitude");
  }
  const double ratio = ten_parsec / *position.luminosity_distance;
  return checked(nanojansky(row_.number(magnitude)) * ratio * ratio, magnitude) / rest;
}

void SceneReader::check_band(const Sed& sed, const Bandpass& band, double redshift,
                             const std::string& what, const SourceLocation& where) const {
  if (covers(sed, band, redshift)) return;
  const Sed::Range seen = band.range(), known = sed.range();
  throw InputError(where, fmt::format("{} ({:.6g} to {:.6g} A) is outside the range of SED '{}' at "
                                      "redshift {}, {:.6g} to {:.6g} A",
                                      what, seen.low, seen.high, sed.name(), redshift,
                                      known.low * (1 + redshift), known.high * (1 + redshift)));
}

void SceneReader::check_planes(const PlacedGalaxy& placed) {
  // Spectra that cover the planes at two redshifts cover them at all redshifts between.
  const auto [known, is_new] =
      checked_.try_emplace(placed.galaxy.get(), placed.redshift, placed.redshift);
  auto& [least, greatest] = known->second;
  if (!is_new && placed.redshift >= least && placed.redshift <= greatest) return;
  const double stretch = 1 + placed.redshift;
  for (const auto& component : placed.galaxy->components()) {
    const Sed* sed = component->sed();
    const Sed::Range range = sed != nullptr ? sed->range() : component->extinction()->range();
    for (const SpectralPlane& plane : spectrum_.planes) {
      const Sed::Range seen = plane.range();
      // Dust needs no curve shortward of the Lyman limit, where no light is left to absorb.
      const bool is_fine =
          (seen.low >= range.low * stretch ||
           (sed == nullptr && plane.band != nullptr && range.low <= lyman_limit)) &&
          seen.high <= range.high * stretch;
      if (is_fine) continue;
      const std::string what =
          plane.band != nullptr
              ? fmt::format("band '{}', {:.6g} to {:.6g} A,", plane.label, seen.low, seen.high)
              : fmt::format("wavelength {} A", plane.wavelength);
      const std::string whose =
          sed != nullptr ? fmt::format("SED '{}'", sed->name()) : "the extinction curve";
      const std::string at =
          placed.redshift > 0 ? fmt::format(" at redshift {}", placed.redshift) : "";
      throw InputError(
          plane.band != nullptr ? parameters_.bands_where : parameters_.wavelengths_where,
          fmt::format("{} is outside the range {:.6g} to {:.6g} A of {}{} (galaxy '{}', component "
                      "'{}')",
                      what, range.low * stretch, range.high * stretch, whose, at, placed.type.str(),
                      component->name()));
    }
  }
  least = std::min(least, placed.redshift);
  greatest = std::max(greatest, placed.redshift);
}

double SceneReader::angle_of_unit(const Position& position) const {
  const std::optional<double> unit = parameters_.megaparsec();
  if (!unit || !position.luminosity_distance) {
    row_.fail(column::galaxy,
              fmt::format("image.unit is one of surface brightness: an orthographic view needs {}",
                          unit ? "the redshift or distance" : "scene.unit"));
  }
  const double stretch = 1 + position.redshift;
  return *unit * stretch * stretch / *position.luminosity_distance;
}

double SceneReader::brightness(const PlacedGalaxy& placed, const Position& position) {
  const double stretch = 1 + position.redshift;
  if (scene_.unit == PixelUnit::relative) return 1 / std::pow(stretch, 4);
  double rest = 0, observed = 0;
  const auto components = placed.galaxy->components();
  const bool is_absolute = row_.is_given(column::magnitude);
  const bool has_light = std::any_of(components.begin(), components.end(), [](const auto& c) {
    return std::as_const(*c).sed() != nullptr;
  });
  // A galaxy of dust alone needs no magnitude.
  if (!has_light && !is_absolute && !row_.is_given(column::apparent_magnitude)) return 1;
  for (std::size_t c = 0; c < components.size(); ++c) {
    const Sed* sed = components[c]->sed();
    if (sed == nullptr) continue;
    check_band(*sed, *reference_, is_absolute ? 0 : position.redshift,
               fmt::format("reference_band '{}'", reference_->name()),
               row_.where(is_absolute ? column::magnitude : column::apparent_magnitude));
    const double light = placed.galaxy->luminosity(c);
    if (is_absolute) {
      rest += light * band_flux(*sed, *reference_, 0);
    } else {
      observed += light * band_flux(*sed, *reference_, position.redshift, spectrum_.igm);
    }
  }
  if (!(rest + observed > 0)) {
    row_.fail(column::galaxy, fmt::format("galaxy '{}' has no light in {} that a magnitude could "
                                          "give",
                                          placed.type.str(), reference_->name()));
  }
  const double scale = flux_scale(position, rest, observed);
  double angle = placed.radius;
  if (camera_.projection() != Projection::orthographic) {
    angle /= is_sky_ ? position.comoving_distance : distance_of(placed.centre);
  } else if (!counts_flux(scene_.unit)) {
    angle *= angle_of_unit(position);
  }
  if (!(scale * (rest + observed) <= largest_brightness * angle * angle)) {
    row_.fail(
        column::galaxy,
        fmt::format("galaxy '{}' is too bright for its size, {:g} {}: pixels would overflow",
                    placed.type.str(), angle,
                    camera_.projection() == Projection::orthographic ? "scene units" : "rad"));
  }
  return scale / (angle * angle);
}

const SharedText& SceneReader::shared(const std::string& name) {
  return names_.try_emplace(name, name).first->second;
}

glm::dmat3 SceneReader::orient(const glm::dvec3& centre) {
  if (!first_camera_) return read_axes(row_, centre, camera_);
  const glm::dmat3 axes = read_axes(row_, centre, *first_camera_);
  if (!row_.is_given(column::inclination)) return axes;
  // The list of an animation gives orientations that do not depend on the camera.
  const double turn = turn_about_axis(axes);
  row_.replace(column::ox, axes[2].x);
  row_.replace(column::oy, axes[2].y);
  row_.replace(column::oz, axes[2].z);
  row_.replace(column::pa, turn);
  return orientation_along(axes[2], turn);
}

void SceneReader::read_galaxy(const Position& position, double radius) {
  PlacedGalaxy placed;
  placed.type = shared(row_.text(column::galaxy));
  placed.id = row_.text(column::id);
  placed.sed = shared(row_.text(column::sed));
  placed.object = scene_.objects;
  placed.centre = position.centre;
  placed.radius = radius;
  placed.redshift = position.redshift;
  placed.seed = static_cast<std::uint64_t>(row_.integer(column::seed));
  const glm::dmat3 axes = orient(placed.centre);
  placed.galaxy = library_.find(placed.type, placed.sed, placed.seed, row_);
  place(placed, axes, row_);
  check_planes(placed);
  placed.is_absolute = row_.is_given(column::magnitude);
  placed.brightness = brightness(placed, position);
  scene_.galaxies.push_back(std::move(placed));
}

bool SceneReader::read_star(const Position& position) {
  if (scene_.unit == PixelUnit::relative) {
    row_.fail(column::galaxy, "a star needs a magnitude: relative images show galaxies only");
  }
  PlacedStar star;
  star.id = row_.text(column::id);
  star.object = scene_.objects;
  star.direction = position.centre;
  const std::optional<glm::dvec2> pixel = star_pixel(position.centre);
  if (!pixel) return false;
  star.pixel = *pixel;
  const std::string name = row_.text(column::sed);
  const auto sed = library_.find_sed_of(name.empty() ? star_sed : name, row_);
  check_band(*sed, *reference_, 0, fmt::format("reference_band '{}'", reference_->name()),
             row_.where(column::sed));
  const double unit_flux = band_flux(*sed, *reference_, 0);
  const double scale = flux_scale(position, unit_flux, unit_flux);
  if (camera_.projection() == Projection::orthographic && !counts_flux(scene_.unit)) {
    star.area_scale = 1 / (angle_of_unit(position) * angle_of_unit(position));
  }
  for (const SpectralPlane& plane : spectrum_.planes) {
    const Sed::Range seen = plane.range(), known = sed->range();
    if (seen.low < known.low || seen.high > known.high) {
      throw InputError(
          row_.where(column::sed),
          fmt::format("plane '{}', {:.6g} to {:.6g} A, is outside the range {:.6g} to {:.6g} A of "
                      "SED '{}'",
                      plane.label, seen.low, seen.high, known.low, known.high, sed->name()));
    }
    star.flux.push_back(scale * plane.flux(*sed, 0, Igm::none));
  }
  scene_.stars.push_back(std::move(star));
  return true;
}

std::optional<glm::dvec2> SceneReader::star_pixel(const glm::dvec3& direction) const {
  // Margin around the image, pixels, within which a star still touches it.
  const double margin = parameters_.white_point ? parameters_.largest_star + 1 : 1;
  const std::optional<glm::dvec2> pixel = camera_.pixel(direction);
  const bool touches = pixel && pixel->x > -margin && pixel->x < camera_.width() - 1 + margin &&
                       pixel->y > -margin && pixel->y < camera_.height() - 1 + margin;
  return touches ? pixel : std::nullopt;
}

void SceneReader::add_field_stars(const ImageField& field) {
  const FieldStarParameters& own = parameters_.field_stars;
  if (!(own.number > 0)) return;
  if (scene_.unit == PixelUnit::relative) {
    throw InputError(own.number_where,
                     fmt::format("field stars need magnitudes: {} has no column 'magnitude' or "
                                 "'apparent_magnitude', so that the image is relative",
                                 catalogue_.label()));
  }
  const auto refuse = [&] {
    throw InputError(own.number_where,
                     fmt::format("more than {} stars would be in the image", most_stars));
  };
  // The stars' number is checked before they are made. Other pixels are about as large as the
  // middle one.
  const double square_degrees =
      static_cast<double>(camera_.width()) * camera_.height() *
      camera_.solid_angle(0.5 * (camera_.width() - 1), 0.5 * (camera_.height() - 1)) *
      std::pow(180 / std::numbers::pi, 2);
  if (own.number * square_degrees > surely * static_cast<double>(most_stars)) refuse();
  // Fluxes of a star of magnitude 0, by temperature.
  std::map<double, std::vector<double>> fluxes;
  for (int i = 0; i < field_temperatures; ++i) {
    const double temperature = field_temperature(own, i);
    const auto sed = blackbody_sed(temperature);
    const double scale = nanojansky(0) / band_flux(*sed, *reference_, 0);
    for (const SpectralPlane& plane : spectrum_.planes) {
      fluxes[temperature].push_back(scale * plane.flux(*sed, 0, Igm::none));
    }
  }
  std::size_t number = 0;
  visit_field_stars(
      own,
      [&](const glm::dvec3& direction, double radius) { return field.holds(direction, radius); },
      [&](const FieldStar& found) {
        const std::optional<glm::dvec2> pixel = star_pixel(found.direction);
        if (!pixel) return;
        if (scene_.stars.size() == most_stars) refuse();
        PlacedStar star;
        star.id = fmt::format("field{}", ++number);
        star.object = scene_.objects++;
        star.direction = found.direction;
        star.pixel = *pixel;
        star.flux = fluxes.at(found.temperature);
        for (double& flux : star.flux) flux *= std::pow(10, -0.4 * found.magnitude);
        scene_.stars.push_back(std::move(star));
      });
}

Scene SceneReader::read() {
  if (catalogue_.rows() == 0 && !is_sky_) {
    throw InputError(row_.name_where(column::galaxy),
                     "the scene is empty: there is no row below the names of the columns");
  }
  choose_unit();
  std::optional<ImageField> field;
  if (is_sky_) field.emplace(camera_);
  scene_.rows = catalogue_.rows();
  list_ = row_.header_line();
  for (std::size_t i = 0; i < catalogue_.rows(); ++i) {
    row_.select(i);
    const bool is_star = row_.text(column::galaxy) == star_type;
    Position position = read_position(field ? &*field : nullptr);
    double radius = 0;
    if (is_sky_) {
      const double angle = is_star ? 0 : read_angular_radius(position);
      // Longest axis of a galaxy, in units of its radius.
      constexpr double most_stretch = 10;
      const glm::dvec3 direction = position.centre / position.comoving_distance;
      if (!field->holds(direction, most_stretch * angle)) continue;
      radius = angle * position.comoving_distance;
      if (catalogue_.format() == CatalogueFormat::skymaker && row_.is_given(column::pa)) {
        turn_to_north();
      }
    } else if (!is_star) {
      radius = row_.number(column::size);
    }
    if (is_star) {
      if (!read_star(position)) {
        // Another frame may show the object.
        if (parameters_.frames > 0) list_ += row_.line();
        continue;
      }
    } else {
      read_galaxy(position, radius);
      const PlacedGalaxy& placed = scene_.galaxies.back();
      if (is_sky_ && !field->holds(position.centre / position.comoving_distance,
                                   placed.bounding_radius / position.comoving_distance)) {
        scene_.galaxies.pop_back();
        continue;
      }
    }
    ++scene_.objects;
    list_ += row_.line();
  }
  scene_.list = std::move(list_);
  if (field) add_field_stars(*field);
  return std::move(scene_);
}

}  // namespace

Scene read_scene(const Catalogue& catalogue, const RenderParameters& parameters,
                 const Spectrum& spectrum, const Camera& camera, Resources& resources,
                 GalaxyLibrary& library) {
  return SceneReader(catalogue, parameters, spectrum, camera, resources, library).read();
}

Scene read_scene(const Catalogue& catalogue, const RenderParameters& parameters,
                 const Spectrum& spectrum, const Camera& camera, Resources& resources) {
  GalaxyLibrary library(parameters, catalogue.label(), resources);
  Scene scene = read_scene(catalogue, parameters, spectrum, camera, resources, library);
  for (const auto& galaxy : library.take_unmeasured(scene)) GalaxyStatistics(*galaxy).measure_all();
  return scene;
}

Scene read_scene(std::string_view text, const std::string& label,
                 const RenderParameters& parameters, const Spectrum& spectrum, const Camera& camera,
                 Resources& resources) {
  return read_scene(Catalogue::parse(text, label, parameters.catalogue_format), parameters,
                    spectrum, camera, resources);
}

}  // namespace gamer
