#include "gamer/scene/camera_settings.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double largest_nside = 65536;
constexpr double largest_supersample = 16;
// Below this sine of the angle between them, two directions count as parallel.
constexpr double smallest_sine = 1e-9;

/// Interval of pixel scales, arcsec. Rounding of directions spoils finer pixels; one pixel of the
/// largest scale shows the whole sky.
Interval pixel_scales() { return Interval::closed(1e-7, 360 * 3600); }

glm::dvec3 vector(const std::vector<double>& values) { return {values[0], values[1], values[2]}; }

void check_view(const ParameterSet& camera) {
  const glm::dvec3 up = vector(camera.numbers("up"));
  const glm::dvec3 view = vector(camera.numbers("target")) - vector(camera.numbers("position"));
  const double distance = glm::length(view);
  const auto text = [&](std::string_view key) {
    return fmt::format("camera.{} = {}", key, value_text(camera.value(key)));
  };
  if (!(distance > 0)) {
    throw input_error(place_of(camera, {"target", "position"}),
                      "{} is camera.position: the view has no direction", text("target"));
  }
  if (!std::isfinite(distance)) {
    throw input_error(place_of(camera, {"target", "position"}), "{} is too far from {}",
                      text("target"), text("position"));
  }
  const double length = glm::length(up);
  if (!(length > 0) || !std::isfinite(length)) {
    throw input_error(camera.where("up"), "{} is no direction", text("up"));
  }
  if (glm::length(glm::cross(up / length, view / distance)) < smallest_sine) {
    throw input_error(place_of(camera, {"up", "target", "position"}),
                      "{} is parallel to the view from {} to {}", text("up"), text("position"),
                      text("target"));
  }
}

BoundTable view_keys(CameraSettings& p) {
  return {choice(p.projection, "projection",
                 {{"perspective", Projection::perspective},
                  {"orthographic", Projection::orthographic},
                  {"sky", Projection::sky},
                  {"fisheye", Projection::fisheye},
                  {"equirectangular", Projection::equirectangular},
                  {"cubemap", Projection::cubemap},
                  {"healpix", Projection::healpix}},
                 "kind of camera"),
          Parameter::vector3("position", "scene units", Interval::any(),
                             std::vector<double>{0, -3, 0}, "place of the camera"),
          Parameter::vector3("target", "scene units", Interval::any(), std::vector<double>{0, 0, 0},
                             "point in the middle of the image"),
          Parameter::vector3("up", "scene units", Interval::any(), std::vector<double>{0, 0, 1},
                             "direction that is up in the image"),
          {p.fov, "fov", "deg", Interval::left_open(0, 360).usual_logarithmic(1, 180),
           "full angle across the image's width (perspective: below 180; fisheye: 180 by default)"},
          {p.width, "width", "scene units", Interval::positive().usual_logarithmic(0.05, 50),
           "full width across the image (orthographic)"},
          Parameter::integer(
              "nside", "", Interval::closed(1, largest_nside), 128,
              "pixels along a side of each of the twelve base pixels, a power of 2 (healpix)"),
          choice(p.is_nested, "ordering", {{"ring", false}, {"nested", true}},
                 "order of the map's pixels in the file (healpix)"),
          choice(p.frame, "frame",
                 {{"galactic", SphereFrame::galactic},
                  {"equatorial", SphereFrame::equatorial},
                  {"ecliptic", SphereFrame::ecliptic}},
                 "name of the file's longitudes and latitudes; the target is at (0, 0), and up is "
                 "the North pole (fisheye, equirectangular, cubemap, healpix)")};
}

BoundTable sky_keys(CameraSettings& p) {
  return {
      Parameter::vector2("center", "deg", Interval::any(), std::vector<double>{0, 0},
                         "right ascension and declination of the image's middle (sky)"),
      Parameter::text("instrument", std::nullopt,
                      "name in `instruments/`, or a file; gives the default of pixel_scale (sky)"),
      Parameter::number("pixel_scale", "arcsec", pixel_scales().usual_logarithmic(0.01, 10), 0.2,
                        "size of a pixel in the image's middle (sky)"),
      {p.sky.rotation, "rotation", "deg", Interval::any().usual(-180, 180),
       "position angle of the image's +y, East of North (sky)"},
      {p.sky.projection, "sky_projection",
       "projection of the FITS standard, by its three letters (sky)"},
      {p.sky.parameters, "projection_parameters", "", Interval::any(),
       "PV2_1, PV2_2, ... of the projection (sky)"},
      without_default(
          {p.header, "header",
           "FITS file that gives the image's size and WCS, instead of the keys above (sky)"})};
}

BoundTable common_keys(CameraSettings& p) {
  return {Parameter::vector2(
              "shear", "", Interval::open(-1, 1), std::vector<double>{0, 0},
              "weak lensing: reduced shear `g1 g2` of the galaxies whose rows give neither"),
          {p.supersample, "supersample", "", Interval::closed(1, largest_supersample),
           "sub-pixels per side; by default 1 for relative pixels, otherwise chosen by "
           "sampling.tolerance"}};
}

/// Which projections have which parameters.
std::vector<KeyCondition> conditions() {
  const std::vector<std::string> sphere = {"fisheye", "equirectangular", "cubemap", "healpix"};
  std::vector<std::string> with_target = sphere;
  with_target.insert(with_target.begin(), {"perspective", "orthographic"});
  return {
      {"position", "projection", with_target},   {"target", "projection", with_target},
      {"up", "projection", with_target},         {"fov", "projection", {"perspective", "fisheye"}},
      {"width", "projection", {"orthographic"}}, {"nside", "projection", {"healpix"}},
      {"ordering", "projection", {"healpix"}},   {"frame", "projection", sphere},
      {"center", "projection", {"sky"}},         {"instrument", "projection", {"sky"}},
      {"pixel_scale", "projection", {"sky"}},    {"rotation", "projection", {"sky"}},
      {"sky_projection", "projection", {"sky"}}, {"projection_parameters", "projection", {"sky"}},
      {"header", "projection", {"sky"}}};
}

}  // namespace

std::span<const std::string_view> CameraSettings::header_keys() {
  static constexpr std::string_view keys[] = {
      "center", "pixel_scale", "instrument", "rotation", "sky_projection", "projection_parameters"};
  return keys;
}

ParameterSection CameraSettings::section() {
  return {"camera", "The view.",
          declarations(view_keys) + declarations(sky_keys) + declarations(common_keys),
          conditions()};
}

CameraSettings CameraSettings::read(const ParameterSet& values) {
  CameraSettings result = read_object(values, view_keys);
  put_values(values, sky_keys(result));
  put_values(values, common_keys(result));
  if (result.projection != Projection::sky) check_view(values);
  result.position = vector(values.numbers("position"));
  result.target = vector(values.numbers("target"));
  result.up = vector(values.numbers("up"));
  if (result.projection == Projection::perspective && !(result.fov < 180)) {
    throw input_error(values.where("fov"),
                      "fov = {} is outside ]0, 180[ (deg) of a perspective view; projection = "
                      "\"fisheye\" shows more",
                      result.fov);
  }
  const std::vector<double>& center = values.numbers("center");
  if (std::abs(center[1]) > 90) {
    throw input_error(values.where("center"),
                      "center = {}: the declination is outside [-90, 90] (deg)",
                      value_text(values.value("center")));
  }
  result.sky.center = {center[0], center[1]};
  result.sky.pixel_scale = values.number("pixel_scale");
  result.header_where = values.where("header");
  const std::vector<double>& shear = values.numbers("shear");
  result.shear = {shear[0], shear[1]};
  if (!(std::hypot(shear[0], shear[1]) < 1)) {
    throw InputError(values.where("shear"), "shear: the reduced shear is not below 1");
  }
  return result;
}

}  // namespace gamer
