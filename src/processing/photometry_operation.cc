#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/no_value.h"
#include "gamer/core/units.h"
#include "gamer/image/wcs.h"
#include "processing/aperture.h"
#include "processing/measurement_table.h"
#include "processing/operation_groups.h"
#include "processing/position_table.h"

namespace gamer {
namespace {

constexpr double least_axis_ratio = 1e-6;  ///< of apertures; its square does not underflow

/// The centre of apertures: the middle of the image, a pixel or a sky position.
struct Target {
  enum class Kind { middle, pixel, sky };
  Kind kind = Kind::middle;
  double x = 0, y = 0;      ///< FITS pixel, or ra and dec
  std::int64_t number = 0;  ///< from 1
  bool is_of_table = false;
  bool is_numbered = false;  ///< one of several, or of a table
};

/// All places, in their order.
std::vector<Target> places_of(const OperationCall& call) {
  const ParameterSet& parameters = call.parameters;
  std::vector<std::string> given;
  for (const char* name : {"center", "position", "positions"}) {
    if (parameters.has(name)) given.push_back(option_name(name));
  }
  if (given.size() > 1) throw wrong(call, "{} and {} both say where; give one", given[0], given[1]);
  std::vector<Target> places;
  const auto add = [&](bool is_sky, double x, double y, bool is_of_table) {
    places.push_back({is_sky ? Target::Kind::sky : Target::Kind::pixel, x, y,
                      static_cast<std::int64_t>(places.size()) + 1, is_of_table});
  };
  for (const char* name : {"center", "position"}) {
    if (!parameters.has(name)) continue;
    const std::vector<double>& numbers = parameters.numbers(name);
    if (numbers.empty() || numbers.size() % 2 != 0) {
      throw wrong(call, "{} has {} numbers; each place has two", option_name(name), numbers.size());
    }
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      add(name == std::string_view("position"), numbers[i], numbers[i + 1], false);
    }
  }
  if (parameters.has("positions")) {
    PositionTable table;
    try {
      table = read_positions(parameters.text("positions"));
    } catch (const InputError& error) {
      throw wrong(call, "--positions {}", error.what());
    }
    for (std::size_t i = 0; i < table.x.size(); ++i)
      add(table.is_sky, table.x[i], table.y[i], true);
    if (places.empty()) throw wrong(call, "--positions: the table has no rows");
  }
  if (places.empty()) places.push_back({});
  for (Target& place : places) place.is_numbered = place.is_of_table || places.size() > 1;
  return places;
}

/// Place and parameters of the measurement of one plane.
class Photometry {
 public:
  Photometry(const OperationCall& call, const PlaneTask& task, const Target& place)
      : call_(call), parameters_(call.parameters), task_(task), plane_(*task.plane), place_(place) {
    in_arcsec_ = parameters_.text("unit") == "arcsec";
    const bool needs_sky = in_arcsec_ || place.kind == Target::Kind::sky;
    try {
      wcs_ = celestial_wcs(task.header, task.label);
    } catch (const InputError& error) {
      if (needs_sky) {
        throw wrong(call, "--{} needs celestial coordinates: {}",
                    in_arcsec_ ? "unit arcsec" : "position", error.what());
      }
    }
    try {
      ellipses_ = shape();
      if (ellipses_) measure();
    } catch (const Unmeasurable& error) {
      const std::string at =
          place.is_numbered ? fmt::format(", position {}", place.number) : std::string();
      throw wrong(call, "{}{}: {}", task.label, at, error.message);
    }
  }

  /// False for a place of a table that the image does not show.
  bool is_there() const { return ellipses_.has_value(); }

  void put_apertures(DataTable& table) const {
    for (std::size_t i = 0; i < radii_.size(); ++i) put_aperture(table, i);
  }

  void put_aperture(DataTable& table, std::size_t i) const {
    const ApertureSum& sum = sums_[i];
    put_place(table);
    put<std::string>(table, "unit", task_.info.unit, "", "of the pixels");
    put(table, "radius", radii_[i], parameters_.text("unit"), "semi-major axis");
    put(table, "flux", sum.flux, "", "sum of the pixels, background subtracted");
    put(table, "magnitude", magnitude(is_brightness(task_.info.unit) ? pixel_area_ : 1, sum.flux),
        "mag", "AB");
    put(table, "mean", sum.flux / sum.area, "", "flux per pixel");
    put(table, "surface_brightness",
        magnitude(is_brightness(task_.info.unit) ? 1 : 1 / pixel_area_, sum.flux / sum.area),
        "mag/arcsec2", "AB");
    put(table, "area", sum.area, "pixel2", "of the pixels that are there");
    put_count(table, "missing", sum.missing, "", "pixels that are not finite");
  }

  void put_shape(DataTable& table) const {
    put_place(table);
    put_shape_values(table);
  }

  void put_shape_values(DataTable& table) const {
    const std::optional<SkyPosition> sky =
        wcs_ ? wcs_->sky({ellipses_->x() + 1, ellipses_->y() + 1}) : std::nullopt;
    put(table, "x", ellipses_->x() + 1, "pixel", "centre");
    put(table, "y", ellipses_->y() + 1, "pixel");
    put(table, "ra", sky ? sky->ra : no_value, "deg");
    put(table, "dec", sky ? sky->dec : no_value, "deg");
    put(table, "background", background_.level, "", "per pixel");
    put(table, "background_sigma", background_.sigma);
    put(table, "image_flux", image_flux_, "", "of all pixels");
    put(table, "total_flux", total_, "", "of which half_light_radius holds half");
    put(table, "half_light_radius", half_light_radius_, parameters_.text("unit"),
        "semi-major axis");
    put(table, "centroid_x", moments_.x + 1, "pixel");
    put(table, "centroid_y", moments_.y + 1, "pixel");
    put(table, "ixx", moments_.xx, "pixel2");
    put(table, "iyy", moments_.yy, "pixel2");
    put(table, "ixy", moments_.xy, "pixel2");
    put(table, "size", moments_.size(), "pixel", "sqrt(ixx + iyy)");
    put(table, "e1", moments_.e1(), "", "(ixx - iyy)/(ixx + iyy)");
    put(table, "e2", moments_.e2(), "", "2 ixy/(ixx + iyy)");
    put(table, "axis_ratio", moments_.axis_ratio(), "", "of the moments");
    put(table, "position_angle", position_angle_, "deg",
        "of the moments' major axis, on the sky if known");
  }

  std::size_t apertures() const { return radii_.size(); }

 private:
  struct Unmeasurable {
    std::string message;
  };

  /// Runs a function; its errors lack the file's name, which the caller adds.
  template <class Function>
  static auto or_unmeasurable(Function function) {
    try {
      return function();
    } catch (const InputError& error) {
      throw Unmeasurable{error.what()};
    }
  }

  void put_place(DataTable& table) const {
    put_plane(table, task_);
    if (place_.is_numbered) {
      put_count(table, "position", place_.number, "", "place or row of the table, from 1");
    }
  }

  /// Coordinates of the centre, from 0; nothing for a place of a table outside the image.
  std::optional<std::pair<double, double>> center() const {
    double x = (plane_.width() - 1) / 2.0, y = (plane_.height() - 1) / 2.0;
    if (place_.kind == Target::Kind::pixel) {
      x = place_.x - 1;
      y = place_.y - 1;
    } else if (place_.kind == Target::Kind::sky) {
      const bool is_number = std::isfinite(place_.x) && std::isfinite(place_.y);
      const auto pixel = is_number ? wcs_->pixel({place_.x, place_.y}) : std::nullopt;
      if (!pixel && place_.is_of_table) return std::nullopt;
      if (!pixel) {
        throw wrong(call_, "--position {:g},{:g} has no pixel in {}", place_.x, place_.y,
                    task_.label);
      }
      x = pixel->x - 1;
      y = pixel->y - 1;
    }
    if (!(x >= -0.5 && x <= plane_.width() - 0.5 && y >= -0.5 && y <= plane_.height() - 0.5)) {
      if (place_.is_of_table) return std::nullopt;
      throw wrong(call_, "the centre ({:.6g}, {:.6g}) lies outside {}, which has {} x {} pixels",
                  x + 1, y + 1, task_.label, plane_.width(), plane_.height());
    }
    return std::pair(x, y);
  }

  std::optional<Ellipses> shape() {
    const auto middle = center();
    if (!middle) return std::nullopt;
    const auto [x, y] = *middle;
    const double ratio = parameters_.number("axis_ratio");
    const double position_angle = parameters_.number("position_angle") * degree;
    if (!wcs_) return Ellipses(x, y, ratio, position_angle + std::numbers::pi / 2);
    return or_unmeasurable([&, x_pixel = x, y_pixel = y] {
      pixel_area_ = std::numbers::pi / Ellipses(*wcs_, x_pixel, y_pixel, 1, 0).area(1);
      if (in_arcsec_) return Ellipses(*wcs_, x_pixel, y_pixel, ratio, position_angle);
      return Ellipses(x_pixel, y_pixel, ratio,
                      angle_on_pixels(*wcs_, x_pixel, y_pixel, position_angle));
    });
  }

  /// The inner radius of the annulus, or without one the radius of the largest ellipse within the
  /// image.
  double default_radius() const {
    const double inner = parameters_.has("annulus") ? parameters_.numbers("annulus").front() : 0;
    if (inner > 0) return inner;
    const double x = std::min(ellipses_->x() + 0.5, plane_.width() - 0.5 - ellipses_->x());
    const double y = std::min(ellipses_->y() + 0.5, plane_.height() - 0.5 - ellipses_->y());
    return std::min(x / ellipses_->half_width(1), y / ellipses_->half_height(1));
  }

  void measure_background() {
    if (!parameters_.has("annulus")) return;
    const std::string& name = parameters_.text("background");
    const BackgroundMethod method = name == "mean"     ? BackgroundMethod::mean
                                    : name == "median" ? BackgroundMethod::median
                                                       : BackgroundMethod::clipped;
    const std::vector<double>& annulus = parameters_.numbers("annulus");
    background_ =
        annulus_background(plane_, *ellipses_, annulus[0], annulus[1], method, call_.threads);
    if (background_.count == 0) {
      throw wrong(call_, "--annulus {:g},{:g} holds no finite pixel of {}", annulus[0], annulus[1],
                  task_.label);
    }
  }

  void measure() {
    const int threads = call_.threads;
    measure_background();
    const auto largest = [&] { return *std::ranges::max_element(radii_); };
    const auto set_radii = [&] {
      radii_ = parameters_.has("radius") ? parameters_.numbers("radius")
                                         : std::vector<double>{default_radius()};
    };
    set_radii();
    if (parameters_.boolean("recenter")) {
      ellipses_ = or_unmeasurable(
          [&] { return recentered(plane_, *ellipses_, largest(), background_.level, threads); });
      measure_background();
      set_radii();
    }
    const double reach = largest();
    const Statistics all = statistics(plane_, threads);
    image_flux_ = all.sum - background_.level * static_cast<double>(all.count);
    sums_ = aperture_sums(plane_, *ellipses_, radii_, background_.level, threads);
    total_ =
        parameters_.has("total")
            ? parameters_.number("total")
            : sums_[static_cast<std::size_t>(std::ranges::max_element(radii_) - radii_.begin())]
                  .flux;
    half_light_radius_ =
        radius_of_flux(plane_, *ellipses_, total_ / 2, reach, background_.level, threads);
    moments_ = {no_value, no_value, no_value, no_value, no_value, no_value};
    if (!parameters_.has("weight_sigma")) {
      moments_ = moments(plane_, *ellipses_, reach, background_.level, threads);
    } else if (const auto adaptive =
                   adaptive_moments(plane_, *ellipses_, reach, parameters_.number("weight_sigma"),
                                    background_.level, threads)) {
      moments_ = *adaptive;
    }
    position_angle_ = position_angle();
  }

  double position_angle() const {
    // Moments without an axis ratio have no direction.
    if (!std::isfinite(moments_.axis_ratio())) return no_value;
    if (wcs_) {
      return or_unmeasurable([&] {
               return position_angle_on_sky(*wcs_, ellipses_->x(), ellipses_->y(), moments_);
             }) /
             degree;
    }
    const double from_y = moments_.angle() / degree - 90;
    return from_y < 0 ? from_y + 180 : from_y;
  }

  /// AB magnitude of factor * value; NaN without a zero point or light.
  double magnitude(double factor, double value) const {
    if (!task_.info.zero_point || !(value > 0)) return no_value;
    return *task_.info.zero_point + magnitudes_of(factor * value);
  }

  const OperationCall& call_;
  const ParameterSet& parameters_;
  const PlaneTask& task_;
  const Plane& plane_;
  const Target& place_;
  bool in_arcsec_ = false;
  std::optional<CelestialWcs> wcs_;
  std::optional<Ellipses> ellipses_;
  double pixel_area_ = no_value;  ///< arcsec^2
  Background background_;
  std::vector<double> radii_;
  std::vector<ApertureSum> sums_;
  double image_flux_ = 0, total_ = 0, half_light_radius_ = 0;
  LightMoments moments_;
  double position_angle_ = 0;
};

int run_photometry(const OperationCall& call) {
  check_table(call);
  const ParameterSet& parameters = call.parameters;
  const std::vector<Target> places = places_of(call);
  check_radii(call, "annulus");
  DataTable apertures, shapes, joined;
  apertures.name = "apertures";
  shapes.name = "shapes";
  joined.name = "photometry";
  const FitsInput input(call.inputs.front());
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    for (const Target& place : places) {
      const Photometry photometry(call, task, place);
      if (!photometry.is_there()) continue;
      photometry.put_apertures(apertures);
      photometry.put_shape(shapes);
      for (std::size_t i = 0; i < photometry.apertures(); ++i) {
        photometry.put_aperture(joined, i);
        photometry.put_shape_values(joined);
      }
    }
  });
  if (joined.columns.empty()) {
    throw wrong(call, "no row of --positions {} is in {}", parameters.text("positions"),
                call.inputs.front());
  }
  deliver(call, {apertures, shapes}, joined);
  return 0;
}

}  // namespace

Operation photometry_operation() {
  return {
      .name = "photometry",
      .summary = "Fluxes and magnitudes in apertures, half-light radius, moments",
      .description =
          "Apertures are circles or ellipses about --center, --position or the middle of the "
          "image. --positions is a FITS table (cat.fits[TRUTH]), ECSV, CSV or a plain table with a "
          "row of names. It has columns ra dec, ALPHA_J2000 DELTA_J2000 or RAJ2000 DEJ2000, else x "
          "y or X_IMAGE Y_IMAGE, in any case. Its rows outside the image are left out. Column "
          "position of the result is the number of the place, or the row of the table. Pixels "
          "count with the exact area that lies inside. flux is the sum of the pixels less the "
          "background of --annulus. magnitude = MAGZERO - 2.5 log10(flux), for brightnesses times "
          "the pixel's solid angle. The magnitude is empty where MAGZERO is missing or flux <= 0. "
          "half_light_radius is the smallest semi-major axis that holds half of --total, by "
          "default of the flux within the largest aperture. The moments describe the light within "
          "the largest aperture about its centroid, along x and y, without background subtraction. "
          "size = sqrt(ixx + iyy), e1 = (ixx - iyy)/(ixx + iyy), e2 = 2 ixy/(ixx + iyy). With "
          "--weight-sigma the weight is the Gaussian ellipse of the moments themselves (adaptive "
          "moments). Position angles, given and measured, run on the sky from North towards East, "
          "as in convolve, at the centre. Without celestial coordinates they run from +y towards "
          "-x. position_angle is the direction of the moments on the sky. Where all light is in "
          "one pixel, position_angle and axis_ratio are empty. Missing pixels add nothing and are "
          "counted. A table (--table) joins both tables, with a row per plane, place and radius.",
      .result = Operation::Result::text,
      .parameters = with_output({
          Parameter::numbers("center", "pixels", Interval::any(), std::nullopt,
                             "x,y as FITS counts (default: the middle), or x,y,x,y..."),
          Parameter::numbers("position", "deg", Interval::any(), std::nullopt,
                             "ra,dec, or ra,dec,ra,dec..., instead of --center"),
          Parameter::text("positions", std::nullopt,
                          "table of places, instead of --center: ra and dec (deg), or x and y"),
          Parameter::boolean(
              "recenter", false,
              "move the centre to the centroid within the largest aperture, iteratively"),
          Parameter::numbers(
              "radius", "--unit", Interval::positive(), std::nullopt,
              "semi-major axes (default: the largest within the image, or up to the annulus)"),
          Parameter::choice("unit", {"pixel", "arcsec"}, "pixel", "unit of all radii"),
          Parameter::number("axis_ratio", "", Interval::closed(least_axis_ratio, 1), 1.0,
                            "ratio of minor to major axis"),
          Parameter::number(
              "position_angle", "deg", Interval::any(), 0.0,
              "direction of the major axis, from North towards East; without celestial coordinates "
              "from +y towards -x"),
          Parameter::vector2(
              "annulus", "--unit", Interval::at_least(0), std::nullopt,
              "inner,outer semi-major axis of the background (default: none is subtracted)"),
          Parameter::choice("background", {"median", "mean", "clipped"}, "median",
                            "statistic of the annulus; clipped: mean within 3 sigma"),
          Parameter::number("total", "unit of the pixels", Interval::positive(), std::nullopt,
                            "total flux for the half-light radius"),
          Parameter::number("weight_sigma", "pixels", Interval::positive(), std::nullopt,
                            "compute adaptive moments, beginning with a Gaussian of this sigma"),
      }),
      .example = "photometry --radius 2,4,8 --axis-ratio 0.7 --position-angle 30 in.fits",
      .run = run_photometry};
}

}  // namespace gamer
