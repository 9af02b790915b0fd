#include "processing/galaxy_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/capitals.h"
#include "gamer/core/units.h"
#include "processing/aperture.h"
#include "processing/measurement_table.h"

namespace gamer {
namespace {

bool is_named(const PlaneTask& task, const std::string& word) {
  return word == fmt::format("{}", task.index + 1) ||
         (!task.info.label.empty() && in_capitals(word) == in_capitals(task.info.label));
}

std::optional<PlanePoint> given_centre(const OperationCall& call, const PlaneTask& task,
                                       const std::optional<CelestialWcs>& wcs) {
  const ParameterSet& parameters = call.parameters;
  PlanePoint place;
  if (parameters.has("center")) {
    place = {parameters.numbers("center")[0] - 1, parameters.numbers("center")[1] - 1};
  } else if (parameters.has("position")) {
    const double ra = parameters.numbers("position")[0], dec = parameters.numbers("position")[1];
    const auto pixel = wcs->pixel({ra, dec});
    if (!pixel) throw wrong(call, "--position {:g},{:g} has no pixel in {}", ra, dec, task.label);
    place = {pixel->x - 1, pixel->y - 1};
  } else {
    return std::nullopt;
  }
  const Plane& plane = *task.plane;
  if (!(place.x >= -0.5 && place.x <= plane.width() - 0.5 && place.y >= -0.5 &&
        place.y <= plane.height() - 0.5)) {
    throw wrong(call, "the centre ({:.6g}, {:.6g}) lies outside {}, which has {} x {} pixels",
                place.x + 1, place.y + 1, task.label, plane.width(), plane.height());
  }
  return place;
}

void check_options(const OperationCall& call) {
  const ParameterSet& parameters = call.parameters;
  if (parameters.has("center") && parameters.has("position")) {
    throw wrong(call, "--center and --position both say where; give one");
  }
  if (parameters.has("annulus") && parameters.is_given("sky")) {
    throw wrong(call, "--sky and --annulus both say what the sky is; give one");
  }
  check_radii(call, "annulus");
}

double sky_level(const OperationCall& call, const PlaneTask& task, const GalaxyPlane& galaxy) {
  if (!call.parameters.has("annulus")) return call.parameters.number("sky");
  const std::vector<double>& annulus = call.parameters.numbers("annulus");
  const PlanePoint centre = galaxy.start ? *galaxy.start : brightest_place(galaxy.image);
  const Background background =
      annulus_background(*memory_plane(galaxy.image), Ellipses(centre.x, centre.y), annulus[0],
                         annulus[1], BackgroundMethod::clipped, call.threads);
  if (background.count == 0) {
    throw wrong(call, "--annulus {:g},{:g} holds no finite pixel of {}", annulus[0], annulus[1],
                task.label);
  }
  return background.level;
}

}  // namespace

ParameterTable galaxy_parameters() {
  return {
      Parameter::text("planes", std::nullopt,
                      "numbers (from 1) or labels of planes, as 2 or sdss_g,sdss_r (default: all)"),
      Parameter::vector2("center", "pixels", Interval::any(), std::nullopt,
                         "x,y as FITS counts (default: found)"),
      Parameter::vector2("position", "deg", Interval::any(), std::nullopt,
                         "ra,dec, instead of --center"),
      Parameter::number("sky", "unit of the pixels", Interval::any(), 0.0,
                        "sky to subtract from each pixel"),
      Parameter::vector2("annulus", "pixels", Interval::at_least(0), std::nullopt,
                         "inner,outer radius; subtract the mean within 3 sigma there, instead of "
                         "--sky"),
  };
}

std::vector<PlaneTask> chosen_planes(const OperationCall& call, const FitsInput& input) {
  std::vector<PlaneTask> all;
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    if (task.info.role == PlaneRole::light) all.push_back(task);
  });
  if (!call.parameters.has("planes")) return all;
  const std::vector<std::string> words = split_at_commas(call.parameters.text("planes"));
  std::vector<std::string> names;
  for (const PlaneTask& task : all) {
    names.push_back(task.info.label.empty()
                        ? fmt::format("{}", task.index + 1)
                        : fmt::format("{} ({})", task.index + 1, task.info.label));
  }
  for (const std::string& word : words) {
    bool is_found = false;
    for (const PlaneTask& task : all) is_found = is_found || is_named(task, word);
    if (!is_found) {
      throw wrong(call, "--planes {}: {} has no plane '{}'; there are {}",
                  call.parameters.text("planes"), input.name(), word, fmt::join(names, ", "));
    }
  }
  std::vector<PlaneTask> chosen;
  for (const PlaneTask& task : all) {
    for (const std::string& word : words) {
      if (!is_named(task, word)) continue;
      chosen.push_back(task);
      break;
    }
  }
  return chosen;
}

GalaxyPlane galaxy_plane(const OperationCall& call, const PlaneTask& task) {
  check_options(call);
  refuse_magnitudes(call.operation, task.label, task.info.unit);
  GalaxyPlane galaxy;
  try {
    galaxy.wcs = celestial_wcs(task.header, task.label);
  } catch (const InputError& error) {
    if (call.parameters.has("position")) {
      throw wrong(call, "--position needs celestial coordinates: {}", error.what());
    }
  }
  galaxy.start = given_centre(call, task, galaxy.wcs);
  galaxy.image = evaluate(*task.plane, call.threads);
  galaxy.sky = sky_level(call, task, galaxy);
  const auto size = static_cast<std::ptrdiff_t>(galaxy.image.width()) * galaxy.image.height();
  double* values = galaxy.image.plane(0);
  for (std::ptrdiff_t i = 0; i < size; ++i) values[i] -= galaxy.sky;
  galaxy.pixel_area = no_value;
  if (galaxy.wcs) {
    const double side = pixel_scale(task.header, task.label);
    galaxy.pixel_area = side * side;
  }
  return galaxy;
}

PlanePoint centre_of(const GalaxyPlane& galaxy, int threads) {
  if (galaxy.start) return *galaxy.start;
  return nucleus_of(*memory_plane(galaxy.image), brightest_place(galaxy.image), threads);
}

std::string plane_label(const PlaneTask& task) {
  if (task.info.planes == 1) return task.label;
  return fmt::format("{} (plane {})", task.label, task.info.plane + 1);
}

double position_angle_of(const GalaxyPlane& galaxy, double x, double y, double angle) {
  constexpr double half_turn = 180;
  if (galaxy.wcs) return position_angle_on_sky(*galaxy.wcs, x, y, angle) / degree;
  const double from_y = std::fmod(angle / degree - 90, half_turn);
  const double turned = from_y < 0 ? from_y + half_turn : from_y;
  return turned < half_turn ? turned : 0;
}

double angle_of_position(const GalaxyPlane& galaxy, double x, double y, double position_angle) {
  if (galaxy.wcs) return angle_on_pixels(*galaxy.wcs, x, y, position_angle * degree);
  return position_angle * degree + std::numbers::pi / 2;
}

DataTable printed_columns(const OperationCall& call, const DataTable& table,
                          const std::vector<std::string>& names) {
  if (call.parameters.boolean("json")) return table;
  DataTable printed;
  printed.name = table.name;
  for (const DataColumn& column : table.columns) {
    if (std::ranges::find(names, column.name) != names.end()) printed.columns.push_back(column);
  }
  return printed;
}

void put_centre(DataTable& table, const GalaxyPlane& galaxy, double x, double y) {
  const std::optional<SkyPosition> sky =
      galaxy.wcs ? galaxy.wcs->sky({x + 1, y + 1}) : std::nullopt;
  put(table, "x", x + 1, "pixel", "centre");
  put(table, "y", y + 1, "pixel");
  put(table, "ra", sky ? sky->ra : no_value, "deg");
  put(table, "dec", sky ? sky->dec : no_value, "deg");
}

}  // namespace gamer
