#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gamer/core/parallel_for.h"
#include "gamer/core/units.h"
#include "processing/galaxy_options.h"
#include "processing/measurement_table.h"
#include "processing/operation_groups.h"
#include "processing/petrosian.h"
#include "processing/polar_map.h"
#include "processing/spiral_fit.h"

namespace gamer {
namespace {

/// The disk and the range of radii, given or found.
struct Disk {
  DiskPlane plane;
  double position_angle = 0;  ///< of the line of nodes, deg
  double inner = 0, outer = 0;
};

Disk found_disk(const OperationCall& call, const GalaxyPlane& galaxy) {
  constexpr double inner_share = 0.25;  // of the Petrosian radius
  const ParameterSet& parameters = call.parameters;
  const PlanePtr plane = memory_plane(galaxy.image);
  const bool is_shaped = parameters.has("inclination") && parameters.has("position_angle");
  const bool is_round = parameters.has("inclination") && parameters.number("inclination") == 0;
  const bool is_found = galaxy.start && parameters.has("radius") && (is_shaped || is_round);
  Disk disk;
  EllipticalLight light{Ellipses(0, 0), 1, 0, 0};
  if (is_found) {
    disk.plane.x = galaxy.start->x;
    disk.plane.y = galaxy.start->y;
  } else {
    const PlanePoint centre = centre_of(galaxy, call.threads);
    light = elliptical_light(*plane, Ellipses(centre.x, centre.y), call.threads);
    disk.plane.x = centre.x;
    disk.plane.y = centre.y;
  }
  disk.plane.inclination = parameters.has("inclination") ? parameters.number("inclination") * degree
                                                         : std::acos(light.axis_ratio);
  disk.plane.angle = parameters.has("position_angle")
                         ? angle_of_position(galaxy, disk.plane.x, disk.plane.y,
                                             parameters.number("position_angle"))
                         : light.angle;
  disk.position_angle = position_angle_of(galaxy, disk.plane.x, disk.plane.y, disk.plane.angle);
  disk.inner = inner_share * light.petrosian;
  const Ellipses ellipses(disk.plane.x, disk.plane.y, std::cos(disk.plane.inclination),
                          disk.plane.angle);
  disk.outer = std::min(light.petrosian, largest_radius_within(*plane, ellipses) - 1);
  if (parameters.has("radius")) {
    disk.inner = parameters.numbers("radius")[0];
    disk.outer = parameters.numbers("radius")[1];
  }
  return disk;
}

/// Square cells in ln r, of the columns' width.
PolarGrid fit_grid(const Disk& disk, int columns) {
  PolarGrid grid{.inner = disk.inner, .outer = disk.outer, .columns = columns};
  const double rows = std::log(disk.outer / disk.inner) / grid.azimuth_step();
  grid.rows = std::max(1, static_cast<int>(std::lround(rows)));
  return grid;
}

void put_spiral(DataTable& table, const PlaneTask& task, const GalaxyPlane& galaxy,
                const Disk& disk, const SpiralFit& fit) {
  put_plane(table, task);
  put_count(table, "arms", fit.strongest.arms, "", "of the strongest mode");
  put(table, "pitch", fit.strongest.pitch / degree, "deg",
      "positive: arms turn counter-clockwise outwards");
  put(table, "pitch_error", fit.strongest.error / degree, "deg", "jackknife over radii");
  put(table, "amplitude", fit.strongest.amplitude, "", "|A(m, p)|");
  for (const SpiralMode& mode : fit.modes) {
    put(table, fmt::format("amplitude{}", mode.arms), mode.amplitude);
  }
  put_centre(table, galaxy, disk.plane.x, disk.plane.y);
  put(table, "inclination", disk.plane.inclination / degree, "deg");
  put(table, "position_angle", disk.position_angle, "deg", "of the line of nodes");
  put(table, "inner", disk.inner, "pixel", "range of the fit, along the line of nodes");
  put(table, "outer", disk.outer, "pixel");
}

void put_arms(DataTable& table, const PlaneTask& task, const std::vector<ArmsAtRadius>& arms) {
  for (const ArmsAtRadius& at : arms) {
    put_plane(table, task);
    put(table, "radius", at.radius, "pixel", "in the disk");
    put(table, "brightness", at.brightness, "", "mean, per pixel");
    put(table, "contrast", at.contrast, "mag", "arms against the light between them");
    put(table, "width", at.width, "pixel", "FWHM across the arms");
    put(table, "width_azimuth", at.width_azimuth / degree, "deg", "FWHM along the circle");
    put(table, "pitch", at.pitch / degree, "deg", "about this radius");
    for (std::size_t m = 0; m < at.amplitudes.size(); ++m) {
      put(table, fmt::format("a{}", m + 1), at.amplitudes[m], "", "2 |a_m|/a_0");
    }
  }
}

FitsHeader map_header(const PlaneTask& task, const Disk& disk, const PolarGrid& grid,
                      const SpiralFit& fit, const OperationCall& call) {
  FitsHeader header;
  if (!task.info.label.empty()) {
    header.set({"EXTNAME", task.info.label, "plane of the input"});
    header.set({"BAND", task.info.label, {}});
  }
  header.set({"BUNIT", task.info.unit, "of the input's pixels, not of these cells"});
  header.set({"CTYPE1", std::string("AZIMUTH"), "in the disk, from the line of nodes"});
  header.set({"CUNIT1", std::string("deg"), {}});
  header.set({"CRPIX1", 0.5, {}});
  header.set({"CRVAL1", 0.0, {}});
  header.set({"CDELT1", grid.azimuth_step() / degree, {}});
  const bool is_log = grid.is_logarithmic;
  header.set({"CTYPE2", std::string(is_log ? "LN_R" : "RADIUS"),
              is_log ? "natural logarithm of the radius in pixels" : "in the disk"});
  header.set({"CUNIT2", std::string(is_log ? "" : "pixel"), {}});
  header.set({"CRPIX2", 0.5, {}});
  header.set({"CRVAL2", is_log ? std::log(grid.inner) : grid.inner, {}});
  header.set({"CDELT2", grid.row_step(), {}});
  header.set({"XCENTER", disk.plane.x + 1, "pixel of the centre"});
  header.set({"YCENTER", disk.plane.y + 1, {}});
  header.set({"INCLIN", disk.plane.inclination / degree, "deg"});
  header.set({"POSANGLE", disk.position_angle, "deg, line of nodes"});
  header.set({"ARMS", static_cast<long long>(fit.strongest.arms), "of the strongest mode"});
  header.set({"PITCH", fit.strongest.pitch / degree, "deg"});
  header.set({"HISTORY", {}, call.history});
  return header;
}

int run_unwrap(const OperationCall& call) {
  check_table(call);
  check_radii(call, "radius");
  use_threads(call.threads);
  const FitsInput input(call.inputs.front());
  FitsOutput output({call.output, call.overwrite});
  DataTable spirals, arms;
  spirals.name = "spirals";
  arms.name = "arms";
  const bool is_log = call.parameters.text("axis") == "log";
  const int columns = static_cast<int>(call.parameters.integer("columns"));
  const int bins = static_cast<int>(call.parameters.integer("bins"));
  for (const PlaneTask& task : chosen_planes(call, input)) {
    const GalaxyPlane galaxy = galaxy_plane(call, task);
    try {
      const Disk disk = found_disk(call, galaxy);
      const PolarGrid grid = fit_grid(disk, columns);
      const Image map = polar_map(galaxy.image, disk.plane, grid);
      const SpiralFit fit = fit_spiral(map, grid);
      put_spiral(spirals, task, galaxy, disk, fit);
      put_arms(arms, task, arms_by_radius(map, grid, fit.strongest, bins));
      PolarGrid shown = grid;
      shown.is_logarithmic = is_log;
      if (!is_log) shown.rows = std::max(1, static_cast<int>(std::lround(disk.outer - disk.inner)));
      constexpr int float_bitpix = -32;
      output.write(map_header(task, disk, shown, fit, call),
                   {memory_plane(is_log ? map : polar_map(galaxy.image, disk.plane, shown))},
                   call.bitpix != 0 ? call.bitpix : float_bitpix, call.threads);
    } catch (const InputError& error) {
      throw wrong(call, "{}: {}", plane_label(task), error.what());
    }
  }
  output.finish();
  const bool prints = call.output != "-" || call.parameters.has("table");
  if (!prints) return 0;
  OperationCall quiet = call;
  if (call.output == "-") quiet.print = [](const std::string&) {};
  const std::vector<std::string> names = {"plane",         "radius", "contrast", "width",
                                          "width_azimuth", "pitch",  "a1",       "a2"};
  deliver(quiet, {spirals, printed_columns(call, arms, names)}, arms);
  return 0;
}

}  // namespace

Operation unwrap_operation() {
  return {
      .name = "unwrap",
      .summary = "Deproject a disk into polar coordinates; fit its spiral arms",
      .description =
          "The disk is taken as thin. --inclination is its inclination, and --position-angle that "
          "of its line of nodes. The output has azimuth, from the line of nodes and "
          "counter-clockwise, along x, and ln r or r along y, with linear world coordinates. A "
          "value is the mean brightness over its cell, per pixel of the input. Each plane becomes "
          "an HDU. Spirals are fitted in (ln r, azimuth) by A(m, p) = <I exp(i(p ln r - m "
          "azimuth))>, m = 1 to 8, where each radius is divided by its mean. The peak in p gives "
          "the pitch, tan P = m/p, and the strongest m the number of arms. The table of arms has "
          "the contrast 2.5 log10(peak/minimum), the mean of the arms, their FWHM, and the pitch "
          "by radius; docs/morphology.md defines them. Tables are printed unless the output is "
          "'-'. A plane is held in memory.",
      .result = Operation::Result::fits,
      .parameters = with_output(
          galaxy_parameters() +
          ParameterTable{
              Parameter::number(
                  "inclination", "deg", Interval::right_open(0, 90), std::nullopt,
                  "0: face-on (default: of the light's axis ratio within 1.5 Petrosian radii)"),
              Parameter::number("position_angle", "deg", Interval::any(), std::nullopt,
                                "line of nodes, from North towards East; without celestial "
                                "coordinates from +y towards -x (default: the light's major axis)"),
              Parameter::vector2(
                  "radius", "pixels", Interval::positive(), std::nullopt,
                  "inner,outer radius in the disk (default: 0.25 and 1 Petrosian radii)"),
              Parameter::choice("axis", {"log", "linear"}, "log", "rows even in ln r or in r"),
              Parameter::integer("columns", "", Interval::closed(16, 100000), 720,
                                 "steps of azimuth"),
              Parameter::integer("bins", "", Interval::closed(1, 1000), 12,
                                 "ranges of radius in the table of arms"),
          }),
      .example = "unwrap --planes 2 --inclination 40 --radius 3,16 in.fits out.fits",
      .run = run_unwrap};
}

}  // namespace gamer
