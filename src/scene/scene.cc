#include "gamer/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <numbers>
#include <utility>

#include "core/message.h"
#include "gamer/core/cancellation.h"
#include "gamer/core/near.h"
#include "gamer/core/units.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"
#include "scene/column_remarks.h"
#include "scene/field_stars.h"
#include "scene/made_galaxy.h"
#include "scene/orientation.h"
#include "scene/other_columns.h"
#include "scene/row_errors.h"
#include "scene/row_overrides.h"
#include "scene/scene_reader.h"

namespace gamer {
namespace {

constexpr const char* star_sed = "flat_fnu";
/// A galaxy whose row gives the share of its bulge.
constexpr std::string_view two_parts = "bulge+disk";

constexpr double kiloparsec = 1e-3;  // Mpc

// Largest number of stars in an image, since they are kept in memory.
constexpr std::size_t most_stars = 20'000'000;
// Factor by which the expected number of stars may err.
constexpr double surely = 2;

// Smaller redshifts (a few parsecs) give no useful distance; 0 means light that is not shifted.
constexpr double smallest_redshift = 1e-9;

/// The orientation of the selected row, as the galaxy's axes in the scene. `inclined` is its
/// inclination, if the row tells it.
glm::dmat3 read_axes(const SceneRow& row, const std::optional<double>& inclined,
                     const glm::dvec3& centre, const Camera& camera) {
  using namespace column;
  std::optional<Column> given, missing;
  for (const Column c : {ox, oy, oz}) {
    std::optional<Column>& first = row.is_given(c) ? given : missing;
    if (!first) first = c;
  }
  const bool is_sky = camera.projection() == Projection::sky;
  if (is_sky || inclined) {
    if (given) row.fail(inclination, "inclination excludes ox oy oz; give one or the other");
    return orientation_on_sky(camera, centre, inclined.value_or(0), row.number(pa));
  }
  if (given && missing) {
    row.fail(*given, "{} needs ox, oy and oz; {} has no value", scene_columns()[*given].name,
             scene_columns()[*missing].name);
  }
  const glm::dvec3 direction{row.number(ox), row.number(oy), row.number(oz)};
  if (direction == glm::dvec3(0)) row.fail(ox, "ox oy oz = 0 0 0 is no direction");
  return orientation_along(direction, row.number(pa));
}

/// Sets to_ball, pole and bounding_radius from radius, axes and stretch.
void place(PlacedGalaxy& placed, const glm::dmat3& axes, const SceneRow& row) {
  const std::vector<double>& stretch = placed.galaxy->axis();
  for (int i = 0; i < 3; ++i) {
    const double semi_axis = placed.radius * stretch[static_cast<std::size_t>(i)];
    // glm stores columns: row i of to_ball is galaxy axis i over its semi-axis.
    for (int k = 0; k < 3; ++k) placed.to_ball[k][i] = axes[i][k] / semi_axis;
    if (!std::isfinite(1 / semi_axis) || !std::isfinite(semi_axis)) {
      row.fail(column::size, "size = {} is too {}", placed.radius,
               semi_axis < 1 ? "small" : "large");
    }
  }
  placed.pole = axes[2];
  placed.bounding_radius = placed.radius * *std::ranges::max_element(stretch);
}

/// Distorts a placed galaxy's image.
void distort(PlacedGalaxy& placed, const Lensing& lensing, const Camera& camera) {
  if (lensing.is_none()) return;
  placed.to_ball = placed.to_ball * lensing.to_source(sky_axes(camera, placed.centre));
  placed.magnification = lensing.magnification();
  placed.source_stretch = lensing.source_stretch();
  placed.bounding_radius *= std::max(lensing.image_stretch(), 1.0);
  placed.half_light_radius *= std::max(lensing.image_stretch(), 1.0);
}

}  // namespace

glm::dvec3 SceneReader::read_direction(const ImageField& field) const {
  using namespace column;
  constexpr std::pair<Column, Column> ways[] = {{ra, dec}, {dx, dy}, {px, py}};
  const std::pair<Column, Column>* way = nullptr;
  for (const auto& pair : ways) {
    const bool first = row_.is_given(pair.first), second = row_.is_given(pair.second);
    const auto& names = scene_columns();
    if (first != second) {
      row_.fail_without(first ? pair.first : pair.second, {first ? pair.second : pair.first},
                        fmt::format("{} without {}", names[first ? pair.first : pair.second].name,
                                    names[first ? pair.second : pair.first].name));
    }
    if (!first) continue;
    if (way != nullptr) {
      row_.fail(pair.first, "both {} {} and {} {}; give one position", names[way->first].name,
                names[way->second].name, names[pair.first].name, names[pair.second].name);
    }
    way = &pair;
  }
  if (way == nullptr) {
    row_.fail_without(galaxy, {ra, dec, dx, dy, px, py},
                      "no position: give ra and dec, dx and dy, or px and py");
  }
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
  if (!ray) row_.fail(px, "pixel {}, {} shows no sky", a, b);
  return ray->direction;
}

SceneReader::Position SceneReader::read_position(const ImageField* field) const {
  Position position;
  position.redshift = row_.number(column::redshift);
  if (position.redshift > 0 && position.redshift < smallest_redshift) {
    row_.fail(column::redshift, "redshift = {} is neither 0 nor at least {}", position.redshift,
              smallest_redshift);
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

double SceneReader::read_angular_radius(const Position& position) {
  using namespace column;
  constexpr Column sizes[] = {size_kpc, size_arcsec, half_light_radius, half_light_radius_kpc};
  std::optional<Column> given;
  for (const Column size : sizes) {
    if (!row_.is_given(size)) continue;
    const auto& names = scene_columns();
    if (given) row_.fail(size, "both {} and {}; give one", names[*given].name, names[size].name);
    given = size;
  }
  if (!given) {
    row_.fail_without(galaxy, {size_kpc, size_arcsec, half_light_radius, half_light_radius_kpc},
                      "no size: give size_kpc, size_arcsec or half_light_radius");
  }
  const bool is_length = given == size_kpc || given == half_light_radius_kpc;
  if (is_length && !position.luminosity_distance) {
    row_.fail(*given, "{} without a distance; give redshift or distance",
              scene_columns()[*given].name);
  }
  const double angle = is_length ? row_.number(*given) * kiloparsec * (1 + position.redshift) /
                                       position.comoving_distance
                                 : row_.number(*given) * arcsecond;
  const bool is_half_light = given == half_light_radius || given == half_light_radius_kpc;
  return is_half_light ? angle / profile().half_light_radius() : angle;
}

const SharedText& SceneReader::shared(const std::string& name) {
  return names_.try_emplace(name, name).first->second;
}

std::string SceneReader::read_type() const {
  return join_type({read_plain_type(), row_.text(column::overrides)});
}

std::string SceneReader::read_plain_type() const {
  using namespace column;
  std::string name = row_.text(galaxy);
  const bool has_index = row_.is_given(sersic_index), is_two = name == two_parts;
  if (name == "sersic" && !has_index) row_.fail(galaxy, "galaxy 'sersic' needs sersic_index");
  if (name != "sersic" && !is_two && has_index) {
    row_.fail(sersic_index, "sersic_index belongs to galaxies 'sersic' and '{}', not {}", two_parts,
              in_quotes(name));
  }
  for (const Column column : {bulge_fraction, bulge_radius_ratio}) {
    if (is_two || !row_.is_given(column)) continue;
    row_.fail(column, "{} belongs to galaxy '{}', not {}", scene_columns()[column].name, two_parts,
              in_quotes(name));
  }
  if (is_two && !row_.is_given(bulge_fraction)) {
    row_.fail(galaxy, "galaxy '{}' needs bulge_fraction", two_parts);
  }
  const auto index =
      sersic_index_of(name, has_index ? std::optional(row_.number(sersic_index)) : std::nullopt);
  if (!index && !is_two) return name;
  constexpr double thinnest = 0.05;
  const double flattening = row_.is_given(axis_ratio) ? row_.number(axis_ratio) : 1;
  if (flattening < thinnest) {
    row_.fail(axis_ratio, "axis_ratio = {} of galaxy '{}' is below {}", flattening, name, thinnest);
  }
  if (!is_two) return sersic_galaxy(*index, flattening);
  constexpr double bulge_index = 4, ratio = 0.12;
  return bulge_and_disk(
      row_.number(bulge_fraction), has_index ? row_.number(sersic_index) : bulge_index,
      row_.is_given(bulge_radius_ratio) ? row_.number(bulge_radius_ratio) : ratio, flattening);
}

std::optional<double> SceneReader::read_inclination() {
  using namespace column;
  if (row_.is_given(axis_ratio) && is_made()) {
    if (row_.is_given(inclination)) return row_.number(inclination);
    return row_.is_given(ox) ? std::nullopt : std::optional(90.0);
  }
  if (!row_.is_given(axis_ratio)) {
    return row_.is_given(inclination) ? std::optional(row_.number(inclination)) : std::nullopt;
  }
  if (row_.is_given(inclination)) {
    row_.fail(axis_ratio, "both inclination and axis_ratio; give one");
  }
  const double ratio = row_.number(axis_ratio), edge_on = profile().edge_on_ratio();
  if (ratio < edge_on) {
    row_.fail(axis_ratio, "axis_ratio = {} is below {:.3g}, that of galaxy {} edge on", ratio,
              edge_on, in_quotes(row_.text(galaxy)));
  }
  const double cosine2 = (ratio * ratio - edge_on * edge_on) / (1 - edge_on * edge_on);
  return glm::degrees(std::acos(std::sqrt(std::min(cosine2, 1.0))));
}

Lensing SceneReader::read_lensing() const {
  using namespace column;
  Lensing lensing{row_.number(g1), row_.number(g2), row_.number(kappa)};
  if (!row_.is_given(g1) && !row_.is_given(g2) && !row_.is_star()) {
    lensing.g1 = parameters_.camera.shear[0];
    lensing.g2 = parameters_.camera.shear[1];
  }
  if (!(lensing.shear() < 1)) {
    row_.fail(g1, "g1 g2: the reduced shear {:.4g} is not below 1", lensing.shear());
  }
  return lensing;
}

LightProfile SceneReader::profile() {
  return library_.light_profile(read_type(), row_.text(column::sed),
                                static_cast<std::uint64_t>(row_.integer(column::seed)),
                                row_.number(column::redshift), reference_.get(), row_);
}

glm::dmat3 SceneReader::orient(const glm::dvec3& centre) {
  const std::optional<double> inclined = read_inclination();
  if (!first_camera_) return read_axes(row_, inclined, centre, camera_);
  const glm::dmat3 axes = read_axes(row_, inclined, centre, *first_camera_);
  if (!inclined) return axes;
  // The list of an animation gives orientations that do not depend on the camera.
  if (!is_made()) row_.leave_out(column::axis_ratio);
  const double turn = turn_about_axis(axes);
  row_.replace(column::ox, axes[2].x);
  row_.replace(column::oy, axes[2].y);
  row_.replace(column::oz, axes[2].z);
  row_.replace(column::pa, turn);
  return orientation_along(axes[2], turn);
}

void SceneReader::read_galaxy(const Position& position, double radius) {
  PlacedGalaxy placed;
  placed.type = shared(read_type());
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
  if (parameters_.image.output.layout == ImageLayout::stamps &&
      parameters_.stamps.radius == StampSettings::Radius::half_light) {
    placed.half_light_radius = radius * profile().half_light_radius();
  }
  distort(placed, read_lensing(), camera_);
  check_planes(placed);
  placed.is_absolute = row_.is_given(column::magnitude);
  placed.brightness = brightness(placed, position);
  scene_.galaxies.push_back(std::move(placed));
}

bool SceneReader::read_star(const Position& position) {
  if (scene_.unit == PixelUnit::relative) {
    row_.fail(column::galaxy, "a star needs a magnitude: relative images show galaxies only");
  }
  if (!read_lensing().is_none()) {
    row_.fail(column::g1, "a star has no image to distort; leave g1, g2 and kappa out");
  }
  if (row_.is_given(column::overrides)) {
    row_.fail(column::overrides, "a star has no parameters to override");
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
      throw input_error(
          row_.where(column::sed),
          "plane '{}', {:.6g} to {:.6g} A, is outside the range {:.6g} to {:.6g} A of SED '{}'",
          plane.label, seen.low, seen.high, known.low, known.high, sed->name());
    }
    star.flux.push_back(scale * plane.flux(*sed, 0, Igm::none));
  }
  scene_.stars.push_back(std::move(star));
  return true;
}

std::optional<glm::dvec2> SceneReader::star_pixel(const glm::dvec3& direction) const {
  // Margin around the image, pixels, within which a star still touches it.
  const double margin = parameters_.draws_star_discs() ? parameters_.stars.reach() : 1;
  const std::optional<glm::dvec2> pixel = camera_.pixel(direction);
  const ImageRegion& window = camera_.window();
  const bool touches = pixel && pixel->x > window.left - margin &&
                       pixel->x < window.right() - 1 + margin &&
                       pixel->y > window.bottom - margin && pixel->y < window.top() - 1 + margin;
  return touches ? pixel : std::nullopt;
}

void SceneReader::add_field_stars(const ImageField& field) {
  const FieldStarParameters& field_stars = parameters_.stars.field;
  if (!(field_stars.number > 0)) return;
  if (scene_.unit == PixelUnit::relative) {
    throw input_error(field_stars.number_where,
                      "field stars need magnitudes: {} has no column 'magnitude' or "
                      "'apparent_magnitude', so that the image is relative",
                      catalogue_.label());
  }
  const auto refuse = [&] {
    throw input_error(field_stars.number_where, "more than {} stars would be in the image",
                      most_stars);
  };
  // The number of stars is checked before they are made, with the middle pixel's size for all
  // pixels.
  const double square_degrees =
      static_cast<double>(camera_.window().width) * camera_.window().height *
      camera_.solid_angle(0.5 * (camera_.width() - 1), 0.5 * (camera_.height() - 1)) *
      std::pow(180 / std::numbers::pi, 2);
  if (field_stars.number * square_degrees > surely * static_cast<double>(most_stars)) refuse();
  // Fluxes of a star of magnitude 0, by temperature.
  std::map<double, std::vector<double>> fluxes;
  for (int i = 0; i < field_temperatures; ++i) {
    const double temperature = field_temperature(field_stars, i);
    const auto sed = blackbody_sed(temperature);
    const double scale = nanojansky(0) / band_flux(*sed, *reference_, 0);
    for (const SpectralPlane& plane : spectrum_.planes) {
      fluxes[temperature].push_back(scale * plane.flux(*sed, 0, Igm::none));
    }
  }
  std::size_t number = 0;
  visit_field_stars(
      field_stars,
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

void SceneReader::keep(std::size_t row) {
  list_ += row_.line();
  scene_.kept.push_back(row);
}

bool SceneReader::read_object(const ImageField* field) {
  const bool is_star = row_.is_star();
  const Position position = read_position(field);
  double radius = 0;
  if (field != nullptr) {
    const double angle = is_star ? 0 : read_angular_radius(position);
    const double stretch = std::max(read_lensing().image_stretch(), 1.0);
    // Longest axis of a galaxy, in units of its radius.
    constexpr double most_stretch = 10;
    const glm::dvec3 direction = position.centre / position.comoving_distance;
    if (!field->holds(direction, most_stretch * stretch * angle)) return false;
    radius = angle * position.comoving_distance;
    if (catalogue_.format() == CatalogueFormat::skymaker && row_.is_given(column::pa)) {
      turn_to_north();
    }
  } else if (!is_star) {
    radius = row_.number(column::size);
  }
  if (is_star) return read_star(position);
  read_galaxy(position, radius);
  const PlacedGalaxy& placed = scene_.galaxies.back();
  if (field != nullptr && !field->holds(position.centre / position.comoving_distance,
                                        placed.bounding_radius / position.comoving_distance)) {
    scene_.galaxies.pop_back();
    return false;
  }
  return true;
}

std::optional<PlacedGalaxy> SceneReader::probe_row(std::size_t row, const ImageField& whole) {
  row_.select(row);
  if (row_.is_star()) return std::nullopt;
  const Scene::Unlikely unlikely = scene_.unlikely;
  std::optional<PlacedGalaxy> placed;
  if (read_object(&whole)) {
    placed = std::move(scene_.galaxies.back());
    scene_.galaxies.pop_back();
  }
  scene_.unlikely = unlikely;
  return placed;
}

SpectralProbes SceneReader::find_probes(const SuspiciousValues& suspicious) {
  const ImageField whole(camera_, {0, 0, camera_.width(), camera_.height()});
  ProbeChooser chooser;
  RowErrors errors(catalogue_.label());
  for (std::size_t row = 0; row < catalogue_.rows(); ++row) {
    check_cancelled();
    if (parameters_.catalogue.skip_flagged && suspicious.is_flagged(row)) continue;
    errors.is_read(row, [&] {
      if (const auto placed = probe_row(row, whole)) {
        chooser.add(placed->galaxy, placed->redshift, row);
      }
    });
  }
  errors.refuse();
  return chooser.choose();
}

SpectralProbes SceneReader::recorded_probes_of(const Resources::Text& text) {
  const ImageField whole(camera_, {0, 0, camera_.width(), camera_.height()});
  SpectralProbes probes;
  for (const RecordedProbe& recorded : read_probes(text.content, text.label)) {
    std::optional<PlacedGalaxy> placed;
    if (recorded.row < catalogue_.rows()) placed = probe_row(recorded.row, whole);
    const std::size_t component = recorded.component.value_or(0);
    if (!placed || component >= placed->galaxy->components().size() ||
        (recorded.component && !placed->galaxy->components()[component]->absorbs())) {
      throw input_error({text.label, 0, 0}, "row {} of the scene is no such galaxy",
                        recorded.row + 1);
    }
    if (recorded.component) {
      probes.dust.push_back({placed->galaxy, placed->redshift, component, recorded.row});
    } else {
      probes.farthest = {placed->galaxy, placed->redshift, recorded.row};
    }
  }
  return probes;
}

void SceneReader::keep_probes(SpectralProbes probes) {
  const ImageField whole(camera_, {0, 0, camera_.width(), camera_.height()});
  const std::size_t objects = scene_.kept.size();
  for (const std::size_t row : probes.rows()) {
    if (std::binary_search(scene_.kept.begin(),
                           scene_.kept.begin() + static_cast<std::ptrdiff_t>(objects), row)) {
      continue;
    }
    probe_row(row, whole);
    keep(row);
  }
  scene_.extra_rows = scene_.kept.size() - objects;
  scene_.probes = std::move(probes);
}

Scene SceneReader::read() {
  if (catalogue_.rows() == 0 && !is_sky_) {
    throw InputError(row_.name_where(column::galaxy),
                     "the scene is empty: there is no row below the names of the columns");
  }
  choose_unit();
  std::optional<ImageField> field;
  if (is_sky_) field.emplace(camera_, camera_.window());
  scene_.rows = catalogue_.rows();
  scene_.remarks = column_remarks(catalogue_, row_.sources(), parameters_);
  list_ = row_.header_line();
  const SuspiciousValues suspicious(catalogue_, row_);
  const bool skips = parameters_.catalogue.skip_flagged;
  if (!skips) suspicious.refuse();
  if (skips) scene_.flagged = suspicious.rows();
  const bool is_region = is_sky_ && parameters_.image.region;
  SpectralProbes probes;
  if (is_region) {
    const Resources::Text* recorded = resources_.recorded(recorded_probes);
    probes = recorded != nullptr ? recorded_probes_of(*recorded) : find_probes(suspicious);
  }
  RowErrors errors(catalogue_.label());
  for (std::size_t i = 0; i < catalogue_.rows(); ++i) {
    check_cancelled();
    row_.select(i);
    if (skips && suspicious.is_flagged(i)) continue;
    bool touches = false;
    const auto read_row = [&] { touches = read_object(field ? &*field : nullptr); };
    if (!errors.is_read(i, read_row)) continue;
    if (!touches) {
      // A star outside may be in another frame.
      if (parameters_.animation.frames > 0 && !is_sky_) keep(i);
      continue;
    }
    ++scene_.objects;
    keep(i);
  }
  errors.refuse();
  if (is_region) keep_probes(std::move(probes));
  scene_.list = std::move(list_);
  scene_.others = other_columns(catalogue_, row_.sources(), scene_.kept);
  if (field) add_field_stars(*field);
  return std::move(scene_);
}

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
  return read_scene(Catalogue::parse(text, label, parameters.catalogue.format), parameters,
                    spectrum, camera, resources);
}

}  // namespace gamer
