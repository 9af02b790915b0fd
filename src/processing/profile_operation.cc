#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/message.h"
#include "core/no_value.h"
#include "gamer/core/parallel_for.h"
#include "processing/disk_breaks.h"
#include "processing/galaxy_options.h"
#include "processing/isophotes.h"
#include "processing/measurement_table.h"
#include "processing/operation_groups.h"
#include "processing/profile_plot.h"

namespace gamer {
namespace {

/// AB magnitude of one unit of the pixels, per pixel and per arcsec^2; NaN without calibration.
struct Calibration {
  double of_flux = no_value;
  double of_brightness = no_value;
};

Calibration calibration_of(const PlaneTask& task, const GalaxyPlane& galaxy) {
  if (!task.info.zero_point) return {};
  // A flux is per pixel; a brightness times the pixel's area is a flux.
  if (is_brightness(task.info.unit)) {
    return {*task.info.zero_point + magnitudes_of(galaxy.pixel_area), *task.info.zero_point};
  }
  return {*task.info.zero_point, *task.info.zero_point + magnitudes_of(1 / galaxy.pixel_area)};
}

double magnitude(double zero_point, double value) {
  return value > 0 ? zero_point + magnitudes_of(value) : no_value;
}

/// A plane with its isophotes.
struct PlaneProfile {
  PlaneTask task;
  GalaxyPlane galaxy;
  Calibration calibration;
  std::vector<Isophote> isophotes;
  std::optional<DiskFit> disk;
};

/// The fit of the disk over --range. By default the range runs from half the half-light radius to
/// the radius of 99 % of the light within the outermost ellipse.
std::optional<DiskFit> disk_of(const OperationCall& call, const std::vector<Isophote>& isophotes) {
  if (isophotes.empty() || !(isophotes.back().flux > 0)) return std::nullopt;
  double inner = 0, outer = std::numeric_limits<double>::infinity();
  if (call.parameters.has("range")) {
    inner = call.parameters.numbers("range")[0];
    outer = call.parameters.numbers("range")[1];
  } else {
    const auto holding = [&](double share) {
      const double flux = share * isophotes.back().flux;
      return std::ranges::find_if(isophotes, [&](const Isophote& one) { return one.flux >= flux; })
          ->radius;
    };
    inner = holding(0.5) / 2;
    outer = holding(0.99);
  }
  std::vector<ProfilePoint> points;
  for (const Isophote& one : isophotes) {
    if (one.radius >= inner && one.radius <= outer) points.push_back({one.radius, one.brightness});
  }
  return fit_disk(points);
}

/// Options of the isophotes, from the first plane.
IsophoteOptions isophote_options(const OperationCall& call, const GalaxyPlane& galaxy) {
  const ParameterSet& parameters = call.parameters;
  const PlanePtr plane = memory_plane(galaxy.image);
  const PlanePoint centre = centre_of(galaxy, call.threads);
  IsophoteOptions options;
  options.x = centre.x;
  options.y = centre.y;
  options.threads = call.threads;
  options.step = parameters.number("step");
  if (parameters.has("axis_ratio")) options.axis_ratio = parameters.number("axis_ratio");
  if (parameters.has("position_angle")) {
    options.angle =
        angle_of_position(galaxy, options.x, options.y, parameters.number("position_angle"));
  }
  const bool is_given = options.axis_ratio && options.angle;
  if (!is_given) {
    const EllipticalLight light =
        elliptical_light(*plane, Ellipses(centre.x, centre.y), call.threads);
    options.start_axis_ratio = light.axis_ratio;
    options.start_angle = light.angle;
  }
  const double width = std::hypot(galaxy.image.width(), galaxy.image.height());
  options.inner = 1;
  options.outer = width;
  if (parameters.has("radius")) {
    options.inner = parameters.numbers("radius")[0];
    options.outer = parameters.numbers("radius")[1];
  }
  return options;
}

void put_isophotes(DataTable& table, const PlaneProfile& profile, const PlaneProfile& first) {
  const double scale = std::sqrt(profile.galaxy.pixel_area);
  for (std::size_t i = 0; i < profile.isophotes.size(); ++i) {
    const Isophote& one = profile.isophotes[i];
    const double surface = magnitude(profile.calibration.of_brightness, one.brightness);
    const double reference =
        magnitude(first.calibration.of_brightness, first.isophotes[i].brightness);
    const double fall = first.isophotes[i].brightness / one.brightness;
    put_plane(table, profile.task);
    put(table, "radius", one.radius, "pixel", "semi-major axis");
    put(table, "radius_arcsec", one.radius * scale, "arcsec");
    put(table, "ellipticity", 1 - one.axis_ratio);
    put(table, "position_angle",
        position_angle_of(profile.galaxy, first.galaxy.start->x, first.galaxy.start->y, one.angle),
        "deg", "of the major axis, on the sky if known");
    put<std::string>(table, "fitted", one.is_fitted ? "yes" : "no", "", "the ellipse's shape");
    put(table, "brightness", one.brightness, "", "on the ellipse, per pixel");
    put(table, "error", one.error, "", "of brightness");
    put(table, "surface_brightness", surface, "mag/arcsec2", "AB");
    const bool is_calibrated = std::isfinite(reference) && std::isfinite(surface);
    put(table, "colour", is_calibrated ? reference - surface : magnitude(0, fall), "mag",
        "first plane less this one");
    put(table, "flux", one.flux, "", "within the ellipse, sum of the pixels");
    put(table, "magnitude", magnitude(profile.calibration.of_flux, one.flux), "mag", "AB");
  }
}

void put_disk(DataTable& table, const PlaneProfile& profile, const GalaxyPlane& centre) {
  const DiskFit none{DiskFit::Type::one, no_value, no_value, no_value, no_value, no_value};
  const DiskFit& disk = profile.disk ? *profile.disk : none;
  put_plane(table, profile.task);
  const auto types = {"", "I", "II", "III"};
  put<std::string>(table, "type", profile.disk ? types.begin()[static_cast<int>(disk.type)] : "",
                   "", "I: no break, II: down-bending, III: up-bending");
  put(table, "inner_scale", disk.inner_scale, "pixel", "scale length within the break");
  put(table, "outer_scale", disk.outer_scale, "pixel", "scale length beyond it");
  put(table, "break_radius", disk.break_radius, "pixel");
  put(table, "central", disk.central, "", "brightness of the inner disk at the centre");
  put(table, "central_surface_brightness",
      magnitude(profile.calibration.of_brightness, disk.central), "mag/arcsec2", "AB");
  const double break_brightness = disk.central * std::exp(-disk.break_radius / disk.inner_scale);
  put(table, "break_surface_brightness",
      magnitude(profile.calibration.of_brightness, break_brightness), "mag/arcsec2", "AB");
  put(table, "rms", disk.rms, "", "of ln(brightness) about the fit");
  put_centre(table, profile.galaxy, centre.start->x, centre.start->y);
  put(table, "sky", profile.galaxy.sky, "", "subtracted from each pixel");
}

std::vector<PlaneProfile> measured_profiles(const OperationCall& call,
                                            const std::vector<PlaneTask>& tasks) {
  std::vector<PlaneProfile> profiles;
  IsophoteOptions options;
  for (const PlaneTask& task : tasks) {
    GalaxyPlane galaxy = galaxy_plane(call, task);
    const Calibration calibration = calibration_of(task, galaxy);
    PlaneProfile profile{task, std::move(galaxy), calibration, {}, {}};
    const Image& image = profile.galaxy.image;
    try {
      if (profiles.empty()) {
        options = isophote_options(call, profile.galaxy);
        profile.galaxy.start = PlanePoint{options.x, options.y};
        profile.isophotes = isophotes(image, options);
        if (profile.isophotes.empty()) {
          throw input_error(
              "no galaxy: no ellipse about pixel ({:.6g}, {:.6g}) has light above its error",
              options.x + 1, options.y + 1);
        }
      } else {
        const Image& first = profiles.front().galaxy.image;
        if (image.width() != first.width() || image.height() != first.height()) {
          throw input_error("{} x {} pixels, but the first plane has {} x {}", image.width(),
                            image.height(), first.width(), first.height());
        }
        profile.isophotes = on_isophotes(image, options, profiles.front().isophotes);
      }
    } catch (const InputError& error) {
      throw wrong(call, "{}: {}", plane_label(task), error.what());
    }
    profile.disk = disk_of(call, profile.isophotes);
    profiles.push_back(std::move(profile));
  }
  return profiles;
}

void draw_profiles(const OperationCall& call, const std::vector<PlaneProfile>& profiles) {
  std::vector<ProfileCurve> curves;
  const PlaneProfile& first = profiles.front();
  const bool is_calibrated = std::ranges::all_of(profiles, [](const PlaneProfile& one) {
    return std::isfinite(one.calibration.of_brightness);
  });
  for (const PlaneProfile& profile : profiles) {
    const double zero_point = is_calibrated ? profile.calibration.of_brightness : 0;
    ProfileCurve curve{profile.task.info.label, profile.isophotes, {}, profile.disk, zero_point};
    for (const Isophote& one : profile.isophotes) {
      curve.magnitudes.push_back(magnitude(zero_point, one.brightness));
    }
    curves.push_back(std::move(curve));
  }
  std::vector<double> angles;
  for (const Isophote& one : first.isophotes) {
    angles.push_back(
        position_angle_of(first.galaxy, first.galaxy.start->x, first.galaxy.start->y, one.angle));
  }
  write_profile_plot(call.parameters.text("plot"), curves, angles,
                     is_calibrated ? "AB mag/arcsec²" : "-2.5 log10(brightness)", call.overwrite);
}

int run_profile(const OperationCall& call) {
  check_table(call);
  check_output(call, "plot", {".png"});
  check_radii(call, "radius");
  check_radii(call, "range");
  use_threads(call.threads);
  const FitsInput input(call.inputs.front());
  const std::vector<PlaneProfile> profiles = measured_profiles(call, chosen_planes(call, input));
  DataTable disks, table;
  disks.name = "disks";
  table.name = "profile";
  for (const PlaneProfile& profile : profiles) {
    put_disk(disks, profile, profiles.front().galaxy);
    put_isophotes(table, profile, profiles.front());
  }
  if (call.parameters.has("plot")) draw_profiles(call, profiles);
  const bool is_calibrated = std::isfinite(profiles.front().calibration.of_brightness);
  const std::vector<std::string> names = {"plane",
                                          "radius",
                                          "ellipticity",
                                          "position_angle",
                                          "colour",
                                          "flux",
                                          is_calibrated ? "surface_brightness" : "brightness"};
  deliver(call, {disks, printed_columns(call, table, names)}, table);
  return 0;
}

}  // namespace

Operation profile_operation() {
  return {
      .name = "profile",
      .summary = "Isophotes by radius: surface brightness, shape, colour, growth, disk breaks",
      .description =
          "Ellipses about one centre, by default the nucleus, are fitted to the first plane. The "
          "fit removes the second harmonic of the brightness along them (Jedrzejewski 1987). "
          "--axis-ratio and --position-angle give ellipses instead. All planes are measured on "
          "these ellipses. magnitude needs MAGZERO; surface_brightness needs MAGZERO and celestial "
          "coordinates. colour is the first plane's surface brightness less the plane's, in "
          "magnitudes. flux is the sum within the ellipse, with exact fractions of pixels. fitted "
          "says whether the shape was found. Where the light is too faint for a fit, the ellipse "
          "keeps the shape of its neighbour. The table of disks has an exponential fit, type I. "
          "Where a broken exponential has significantly smaller residuals, the table has this fit "
          "and the radius of the break: type II (down) or III (up). The fit covers --range, by "
          "default from half the half-light radius to the radius of 99 % of the light. "
          "docs/morphology.md has the details. Planes are held in memory.",
      .result = Operation::Result::text,
      .parameters = with_output(
          galaxy_parameters() +
          ParameterTable{
              Parameter::number("axis_ratio", "", Interval::closed(0.05, 1), std::nullopt,
                                "of all ellipses (default: fitted)"),
              Parameter::number("position_angle", "deg", Interval::any(), std::nullopt,
                                "of all ellipses, from North towards East; without celestial "
                                "coordinates from +y towards -x (default: fitted)"),
              Parameter::vector2("radius", "pixels", Interval::positive(), std::nullopt,
                                 "inner,outer semi-major axis (default: 1, and the last within the "
                                 "image with light above its error)"),
              Parameter::number("step", "", Interval::closed(0.01, 1), 0.1,
                                "each semi-major axis is 1 + step times the one before"),
              Parameter::vector2("range", "pixels", Interval::at_least(0), std::nullopt,
                                 "inner,outer semi-major axis of the disk's fit"),
              Parameter::text("plot", std::nullopt, "write a plot: .png"),
          }),
      .example = "profile --planes sdss_g,sdss_r --plot profile.png in.fits",
      .run = run_profile};
}

}  // namespace gamer
