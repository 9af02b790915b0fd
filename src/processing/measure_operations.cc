#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/units.h"
#include "gamer/image/data_table.h"
#include "gamer/image/new_file.h"
#include "gamer/image/wcs.h"
#include "processing/aperture.h"
#include "processing/comparison.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/power_spectrum.h"
#include "processing/spectrum_plot.h"
#include "processing/statistics.h"
#include "processing/table_text.h"

namespace gamer {
namespace {

constexpr const char* group_name = "Measurement";
constexpr double no_value = std::numeric_limits<double>::quiet_NaN();
constexpr double least_axis_ratio = 1e-6;  ///< of apertures; its square does not underflow

const Interval positive = Interval::open(0, std::numeric_limits<double>::infinity());
const Interval not_negative = Interval::right_open(0, std::numeric_limits<double>::infinity());

InputError wrong(const OperationCall& call, const std::string& message) {
  return InputError(fmt::format("gutil {}: {}", call.operation, message));
}

/// Appends a value to the column of that name; the table's first row makes the columns.
template <class Value>
void put(DataTable& table, const std::string& name, const Value& value,
         const std::string& unit = {}, const std::string& description = {}) {
  auto column = std::find_if(table.columns.begin(), table.columns.end(),
                             [&](const DataColumn& one) { return one.name == name; });
  if (column == table.columns.end()) {
    table.columns.push_back({name, unit, description, std::vector<Value>()});
    column = table.columns.end() - 1;
  }
  std::get<std::vector<Value>>(column->values).push_back(value);
}
void put_count(DataTable& table, const std::string& name, std::int64_t value,
               const std::string& unit = {}, const std::string& description = {}) {
  put<std::int64_t>(table, name, value, unit, description);
}

/// Columns that identify the plane of a row.
void put_plane(DataTable& table, const PlaneTask& task, int hdu) {
  put_count(table, "hdu", hdu, "", "from 0, the primary");
  put_count(table, "plane", task.info.plane + 1, "", "of its HDU, from 1");
  put<std::string>(table, "label", task.info.label, "", "band, name or wavelength");
}

/// HDU number of each plane of a file.
std::vector<int> hdu_numbers(const FitsInput& input) {
  std::vector<int> numbers;
  for (const FitsHdu& hdu : input.hdus()) {
    numbers.insert(numbers.end(), static_cast<std::size_t>(hdu.planes), hdu.number);
  }
  return numbers;
}

ParameterTable with_output(ParameterTable table) {
  table.push_back({"json", ParameterType::boolean, "", {}, false, "print JSON, not a table"});
  table.push_back({"table", ParameterType::text, "", {}, {}, "write a table too: .ecsv or .fits"});
  return table;
}

/// Checks an option's output file before work begins: suffix, folder, and --overwrite.
void check_output(const OperationCall& call, const char* option,
                  std::initializer_list<const char*> suffixes) {
  if (!call.parameters.has(option)) return;
  const std::filesystem::path path = call.parameters.text(option);
  const std::string context = fmt::format("--{} '{}'", option, path.string());
  if (std::find(suffixes.begin(), suffixes.end(), path.extension().string()) == suffixes.end()) {
    throw wrong(call, fmt::format("{}: expected a name that ends in {}", context,
                                  fmt::join(suffixes, " or ")));
  }
  check_new_file(path, call.overwrite);
}

void check_table(const OperationCall& call) { check_output(call, "table", {".ecsv", ".fits"}); }

/// Prints `tables`, and writes `file` if --table is given.
void deliver(const OperationCall& call, const std::vector<DataTable>& tables,
             const DataTable& file) {
  if (call.parameters.has("table")) {
    const std::filesystem::path path = call.parameters.text("table");
    if (path.extension() == ".fits") {
      write_fits_table(path, file);
    } else {
      write_ecsv(path, file);
    }
  }
  std::string text;
  if (call.parameters.boolean("json")) {
    text = table_json(tables);
  } else {
    for (const DataTable& table : tables) {
      if (!text.empty()) text += '\n';
      text += table_text(table);
    }
  }
  call.print(text);
}

// stats

/// "p5", "p99_9": FITS wants columns of letters, digits and underscores.
std::string percentile_name(double percent) {
  std::string name = fmt::format("p{}", percent);
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

int run_stats(const OperationCall& call) {
  check_table(call);
  const std::vector<double>& percentiles = call.parameters.numbers("percentiles");
  std::vector<double> fractions = {0.5};
  for (const double percent : percentiles) fractions.push_back(percent / 100);
  DataTable table;
  table.name = "statistics";
  const FitsInput input(call.inputs.front());
  const std::vector<int> hdus = hdu_numbers(input);
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    const Plane& plane = *task.plane;
    const Statistics all = statistics(plane, call.threads);
    const std::vector<double> ordered = quantiles(plane, fractions, call.threads);
    const bool has_pixels = all.count > 0;
    const auto place = [&](int coordinate) {
      return has_pixels ? static_cast<double>(coordinate + 1) : no_value;
    };
    put_plane(table, task, hdus[static_cast<std::size_t>(task.index)]);
    put<std::string>(table, "unit", task.info.unit, "", "of the pixels");
    put_count(table, "width", plane.width(), "pixel");
    put_count(table, "height", plane.height(), "pixel");
    put_count(table, "count", all.count, "", "finite pixels");
    put_count(table, "nan", all.nans);
    put_count(table, "inf", all.infinities);
    put(table, "sum", all.sum);
    put(table, "min", all.min);
    put(table, "min_x", place(all.min_at.x), "pixel", "of the first such pixel, from 1");
    put(table, "min_y", place(all.min_at.y), "pixel");
    put(table, "max", all.max);
    put(table, "max_x", place(all.max_at.x), "pixel", "of the first such pixel, from 1");
    put(table, "max_y", place(all.max_at.y), "pixel");
    put(table, "mean", all.mean);
    put(table, "sigma", all.sigma, "", "sqrt(mean((v - mean)^2))");
    put(table, "median", ordered.front());
    put(table, "mad_sigma", mad_sigma(plane, ordered.front(), call.threads), "",
        "1.4826 median|v - median|");
    for (std::size_t i = 0; i < percentiles.size(); ++i) {
      put(table, percentile_name(percentiles[i]), ordered[i + 1], "", "percentile");
    }
    if (call.parameters.has("clip")) {
      const Background background =
          clipped_background(plane, call.parameters.number("clip"), call.threads);
      put(table, "clipped_mean", background.level);
      put(table, "clipped_sigma", background.sigma);
    }
  });
  deliver(call, {table}, table);
  return 0;
}

void check_percentiles(const OperationCall& call) {
  std::vector<double> sorted = call.parameters.numbers("percentiles");
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    throw wrong(call, fmt::format("--percentiles has {:g} twice; give each once", *twice));
  }
}

Operation stats_operation() {
  Operation operation;
  operation.name = "stats";
  operation.group = group_name;
  operation.summary = "Counts, sum, extremes, mean, sigma, median and percentiles of every plane";
  operation.description =
      "One row per plane, over its finite pixels: sigma = sqrt(mean((v - mean)^2)); a percentile "
      "interpolates linearly between the sorted values (as NumPy does) and is exact for images of "
      "any size; mad_sigma = 1.4826 median|v - median|. Positions are FITS pixels, the first from "
      "the bottom where there are several. --clip adds mean and sigma of the pixels within so many "
      "sigma, again and again from the median and mad_sigma.";
  operation.result = Operation::Result::text;
  operation.parameters = with_output(
      {{"percentiles", ParameterType::numbers, "", Interval::closed(0, 100),
        std::vector<double>{1, 5, 25, 75, 95, 99}, "percentiles to list"},
       {"clip", ParameterType::number, "sigma", positive, {}, "also the clipped mean and sigma"}});
  operation.example = "stats --percentiles 5,95 --clip 3 in.fits";
  operation.run = [](const OperationCall& call) {
    check_percentiles(call);
    return run_stats(call);
  };
  return operation;
}

// photometry

/// Place and parameters of the measurement of one plane.
class Photometry {
 public:
  Photometry(const OperationCall& call, const PlaneTask& task)
      : call_(call), parameters_(call.parameters), task_(task), plane_(*task.plane) {
    in_arcsec_ = parameters_.text("unit") == "arcsec";
    const bool needs_sky = in_arcsec_ || parameters_.has("position");
    try {
      wcs_ = celestial_wcs(task.header, task.label);
    } catch (const InputError& error) {
      if (needs_sky) {
        throw wrong(call, fmt::format("--{} needs celestial coordinates: {}",
                                      in_arcsec_ ? "unit arcsec" : "position", error.what()));
      }
    }
    try {
      ellipses_ = shape();
      measure();
    } catch (const Unmeasurable& error) {
      throw wrong(call, fmt::format("{}: {}", task.label, error.message));
    }
  }

  void put_apertures(DataTable& table, int hdu) const {
    for (std::size_t i = 0; i < radii_.size(); ++i) put_aperture(table, hdu, i);
  }

  void put_aperture(DataTable& table, int hdu, std::size_t i) const {
    const ApertureSum& sum = sums_[i];
    put_plane(table, task_, hdu);
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

  void put_shape(DataTable& table, int hdu) const {
    put_plane(table, task_, hdu);
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

  std::pair<double, double> center() const {
    double x = (plane_.width() - 1) / 2.0, y = (plane_.height() - 1) / 2.0;
    if (parameters_.has("center")) {
      x = parameters_.numbers("center")[0] - 1;
      y = parameters_.numbers("center")[1] - 1;
    } else if (parameters_.has("position")) {
      const double ra = parameters_.numbers("position")[0],
                   dec = parameters_.numbers("position")[1];
      const auto pixel = wcs_->pixel({ra, dec});
      if (!pixel) {
        throw wrong(call_,
                    fmt::format("--position {:g},{:g} has no pixel in {}", ra, dec, task_.label));
      }
      x = pixel->x - 1;
      y = pixel->y - 1;
    }
    if (!(x >= -0.5 && x <= plane_.width() - 0.5 && y >= -0.5 && y <= plane_.height() - 0.5)) {
      throw wrong(call_, fmt::format("the centre ({:.6g}, {:.6g}) lies outside {}, which has {} x "
                                     "{} pixels",
                                     x + 1, y + 1, task_.label, plane_.width(), plane_.height()));
    }
    return {x, y};
  }

  Ellipses shape() {
    const auto [x, y] = center();
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

  /// The inner radius of the annulus, else of the largest ellipse within the image.
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
      throw wrong(call_, fmt::format("--annulus {:g},{:g} holds no finite pixel of {}", annulus[0],
                                     annulus[1], task_.label));
    }
  }

  void measure() {
    const int threads = call_.threads;
    measure_background();
    const auto largest = [&] { return *std::max_element(radii_.begin(), radii_.end()); };
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
    total_ = parameters_.has("total")
                 ? parameters_.number("total")
                 : sums_[static_cast<std::size_t>(std::max_element(radii_.begin(), radii_.end()) -
                                                  radii_.begin())]
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
  if (parameters.has("center") && parameters.has("position")) {
    throw wrong(call, "--center and --position both say where; give one");
  }
  if (parameters.has("annulus")) {
    const std::vector<double>& annulus = parameters.numbers("annulus");
    if (!(annulus[0] < annulus[1])) {
      throw wrong(call, fmt::format("--annulus {:g},{:g}: the outer radius must be larger than the "
                                    "inner one",
                                    annulus[0], annulus[1]));
    }
  }
  DataTable apertures, shapes, joined;
  apertures.name = "apertures";
  shapes.name = "shapes";
  joined.name = "photometry";
  const FitsInput input(call.inputs.front());
  const std::vector<int> hdus = hdu_numbers(input);
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    const Photometry photometry(call, task);
    const int hdu = hdus[static_cast<std::size_t>(task.index)];
    photometry.put_apertures(apertures, hdu);
    photometry.put_shape(shapes, hdu);
    for (std::size_t i = 0; i < photometry.apertures(); ++i) {
      photometry.put_aperture(joined, hdu, i);
      photometry.put_shape_values(joined);
    }
  });
  deliver(call, {apertures, shapes}, joined);
  return 0;
}

Operation photometry_operation() {
  Operation operation;
  operation.name = "photometry";
  operation.group = group_name;
  operation.summary = "Fluxes and magnitudes in apertures, half-light radius, moments";
  operation.description =
      "Circles or ellipses about --center, --position or the middle of the image; pixels count "
      "with the exact area that lies inside. flux is the sum of the pixels less the background of "
      "--annulus; magnitude = MAGZERO - 2.5 log10(flux) (of brightnesses, times the pixel's solid "
      "angle), none where MAGZERO is missing or flux <= 0. half_light_radius is the smallest "
      "semi-major axis that holds half of --total, by default of the flux within the largest "
      "aperture. The moments are those of the light within the largest aperture about its "
      "centroid, of pixels as they are, in the directions of x and y: size = sqrt(ixx + iyy), e1 = "
      "(ixx - iyy)/(ixx + iyy), e2 = 2 ixy/(ixx + iyy); with --weight-sigma they are weighted with "
      "the Gaussian ellipse that they describe (adaptive moments). Position angles, given and "
      "measured, are on the sky, from North towards East (as of convolve), by the coordinates "
      "at the centre; without celestial coordinates from +y towards -x. position_angle is that of "
      "the "
      "moments as the sky shows them; it is empty, as is axis_ratio, where all light is in one "
      "pixel. Missing pixels add nothing "
      "and are counted. A table (--table) joins both tables, a row per plane and radius.";
  operation.result = Operation::Result::text;
  operation.parameters = with_output({
      {"center",
       ParameterType::vector2,
       "pixels",
       Interval::any(),
       {},
       "x,y as FITS counts (default: the middle)"},
      {"position",
       ParameterType::vector2,
       "deg",
       Interval::any(),
       {},
       "ra,dec, instead of --center"},
      {"recenter",
       ParameterType::boolean,
       "",
       {},
       false,
       "move to the centroid within the largest aperture, again and again"},
      {"radius",
       ParameterType::numbers,
       "--unit",
       positive,
       {},
       "semi-major axes (default: the largest within the image, or up to the annulus)"},
      {"unit",
       ParameterType::choice,
       "",
       {},
       std::string("pixel"),
       "of all radii",
       {"pixel", "arcsec"}},
      {"axis_ratio", ParameterType::number, "", Interval::closed(least_axis_ratio, 1), 1.0,
       "minor to major"},
      {"position_angle", ParameterType::number, "deg", Interval::any(), 0.0,
       "of the major axis, from North towards East; without celestial coordinates from +y towards "
       "-x"},
      {"annulus",
       ParameterType::vector2,
       "--unit",
       not_negative,
       {},
       "inner,outer semi-major axis of the background (default: none is subtracted)"},
      {"background",
       ParameterType::choice,
       "",
       {},
       std::string("median"),
       "of the annulus; clipped: mean within 3 sigma",
       {"median", "mean", "clipped"}},
      {"total",
       ParameterType::number,
       "unit of the pixels",
       positive,
       {},
       "flux of which the half-light radius holds half"},
      {"weight_sigma",
       ParameterType::number,
       "pixels",
       positive,
       {},
       "adaptive moments, from a Gaussian of that sigma"},
  });
  operation.example = "photometry --radius 2,4,8 --axis-ratio 0.7 --position-angle 30 in.fits";
  operation.run = run_photometry;
  return operation;
}

// spectrum

SpectrumOptions spectrum_options(const ParameterSet& parameters) {
  SpectrumOptions options;
  const std::string& window = parameters.text("window");
  options.window = window == "none"   ? SpectrumWindow::none
                   : window == "hann" ? SpectrumWindow::hann
                                      : SpectrumWindow::cosine;
  options.taper = parameters.number("taper");
  options.opacity = parameters.boolean("opacity");
  options.logarithm = parameters.boolean("log");
  options.psf_fwhm = parameters.number("psf_fwhm");
  options.white_level = parameters.number("white");
  options.bins = static_cast<int>(parameters.integer("bins"));
  if (parameters.has("range")) {
    options.lowest = parameters.numbers("range")[0];
    options.highest = parameters.numbers("range")[1];
  }
  return options;
}

void check_range(const OperationCall& call, const SpectrumOptions& options, const PlaneTask& task) {
  if (!call.parameters.has("range")) return;
  const int most = std::min(task.plane->width(), task.plane->height()) / 2;
  if (!(options.lowest < options.highest && options.highest <= most)) {
    throw wrong(call, fmt::format("--range {:g},{:g}: expected 1 <= k1 < k2 <= {} for {} x {} "
                                  "pixels",
                                  options.lowest, options.highest, most, task.plane->width(),
                                  task.plane->height()));
  }
}

void put_fit(DataTable& table, const PlaneTask& task, int hdu, const PowerSpectrum& spectrum) {
  put_plane(table, task, hdu);
  put(table, "slope", spectrum.fit.slope, "", "of ln P against ln k");
  put(table, "slope_error", spectrum.fit.slope_error, "", "standard error");
  put(table, "amplitude", spectrum.fit.amplitude, "", "P at k = 1 of the fit");
  put(table, "lowest_k", spectrum.fit.lowest);
  put(table, "highest_k", spectrum.fit.highest);
  put_count(table, "bins", spectrum.fit.bins);
  put_count(table, "width", spectrum.width, "pixel");
  put_count(table, "height", spectrum.height, "pixel");
  put_count(table, "count", spectrum.count, "", "pixels that were used");
  put_count(table, "missing", spectrum.missing);
  put(table, "mean", spectrum.mean);
  put(table, "sigma", spectrum.sigma);
  put(table, "skewness", spectrum.skewness);
  put(table, "log_sigma", spectrum.log_sigma, "", "sigma of the natural logarithm");
  put(table, "log_skewness", spectrum.log_skewness);
}

void put_annuli(DataTable& table, const PlaneTask& task, int hdu, const PowerSpectrum& spectrum) {
  for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) {
    put_plane(table, task, hdu);
    put_count(table, "k", annulus.k, "", "waves per shorter side");
    put(table, "frequency", annulus.frequency, "1/pixel");
    put(table, "power", annulus.power, "", "mean |F|^2 per pixel");
    put_count(table, "modes", annulus.modes);
  }
}

/// Adds the fit of plane `number` of `count` to the head of a table of annuli.
void add_cards(DataTable& table, const PowerSpectrum::Fit& fit, int number, int count) {
  const std::string suffix = count > 1 ? fmt::format("{}", number) : "";
  if (!std::isfinite(fit.slope)) return;
  table.cards.push_back({"SLOPE" + suffix, fit.slope, "of ln P against ln k"});
  table.cards.push_back({"SLOPER" + suffix, fit.slope_error, "standard error"});
}

int run_spectrum(const OperationCall& call) {
  check_table(call);
  check_output(call, "plot", {".png"});
  const SpectrumOptions options = spectrum_options(call.parameters);
  DataTable fits, annuli;
  fits.name = "fits";
  annuli.name = "spectrum";
  std::vector<SpectrumCurve> curves;
  std::optional<std::string> unit;
  const FitsInput input(call.inputs.front());
  const std::vector<int> hdus = hdu_numbers(input);
  visit_planes(input, call.threads,
               [&](const PlaneTask& task) { check_range(call, options, task); });
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    const int hdu = hdus[static_cast<std::size_t>(task.index)];
    const PowerSpectrum spectrum =
        power_spectrum(*task.plane, options, "gutil spectrum: " + task.label, call.threads);
    put_fit(fits, task, hdu, spectrum);
    put_annuli(annuli, task, hdu, spectrum);
    add_cards(annuli, spectrum.fit, task.index + 1, task.count);
    const bool is_named = !task.info.label.empty() || task.count == 1;
    curves.push_back(
        {is_named ? task.info.label : fmt::format("plane {}", task.index + 1), spectrum});
    if (!unit || *unit == task.info.unit) {
      unit = task.info.unit;
    } else {
      unit = "";
    }
  });
  if (call.parameters.has("plot")) {
    const bool is_changed = options.opacity || options.logarithm;
    write_spectrum_plot(call.parameters.text("plot"), curves, is_changed ? "" : unit.value_or(""),
                        call.overwrite);
  }
  deliver(call, {fits, annuli}, annuli);
  return 0;
}

Operation spectrum_operation() {
  Operation operation;
  operation.name = "spectrum";
  operation.group = group_name;
  operation.summary = "Azimuthally averaged power spectrum and its slope";
  operation.description =
      "The mean is subtracted, the window applied, and |F|^2/sum(w^2) averaged over the modes "
      "whose "
      "|k| rounds to 1, 2, ... N/2; k counts waves per shorter side N, so that k/N is the "
      "frequency in cycles per pixel. White noise has power sigma^2 at all k. A straight line "
      "through ln P against ln k, in bins of equal width in ln k over --range (default 4 to N/4), "
      "gives the slope and its standard error. Hann's window keeps steep spectra free of what "
      "leaks from the edges; none is right for images that repeat. Missing pixels become the mean. "
      "sigma and skewness of the values and of their logarithms come along. An image is held in "
      "memory whole, 8 bytes per pixel.";
  operation.result = Operation::Result::text;
  operation.parameters = with_output({
      {"window",
       ParameterType::choice,
       "",
       {},
       std::string("hann"),
       "none, hann, or cosine (rises over --taper at every edge)",
       {"none", "hann", "cosine"}},
      {"taper", ParameterType::number, "side", Interval::left_open(0, 0.5), 0.1,
       "length of the cosine's rise"},
      {"opacity",
       ParameterType::boolean,
       "",
       {},
       false,
       "pixels are opacities: take tau = -ln(1 - v)"},
      {"log", ParameterType::boolean, "", {}, false, "take the natural logarithm first"},
      {"white", ParameterType::number, "(unit of the pixels)^2", not_negative, 0.0,
       "power of white noise to subtract: its sigma^2"},
      {"psf_fwhm", ParameterType::number, "pixel", not_negative, 0.0,
       "divide by the squared transfer function of such a Gaussian (after --white)"},
      {"range",
       ParameterType::vector2,
       "",
       Interval::right_open(1, positive.high),
       {},
       "k1,k2 of the fit (default: 4,N/4)"},
      {"bins", ParameterType::integer, "", Interval::closed(3, 1000), std::int64_t{12},
       "of the fit"},
      {"plot", ParameterType::text, "", {}, {}, "write a plot: .png"},
  });
  operation.example = "spectrum --window hann --bins 8 in.fits";
  operation.run = run_spectrum;
  return operation;
}

// compare

struct ImageShape {
  int width, height, planes;
  bool operator==(const ImageShape&) const = default;
};

std::vector<ImageShape> image_shapes(const FitsInput& input) {
  std::vector<ImageShape> shapes;
  for (const FitsHdu& hdu : input.hdus()) {
    if (hdu.is_image()) shapes.push_back({hdu.width, hdu.height, hdu.planes});
  }
  return shapes;
}

std::string shapes_text(const std::vector<ImageShape>& shapes) {
  std::vector<std::string> words;
  for (const ImageShape& shape : shapes) {
    words.push_back(fmt::format("{} x {} x {}", shape.width, shape.height, shape.planes));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

int run_compare(const OperationCall& call) {
  check_table(call);
  const FitsInput first(call.inputs[0]), second(call.inputs[1]);
  std::vector<PlanePtr> others;
  visit_planes(second, call.threads, [&](const PlaneTask& task) { others.push_back(task.plane); });
  const std::vector<ImageShape> shapes = image_shapes(first), other_shapes = image_shapes(second);
  DataTable table;
  table.name = "comparison";
  bool all_within = true;
  const std::vector<int> hdus = hdu_numbers(first);
  visit_planes(first, call.threads, [&](const PlaneTask& task) {
    if (shapes != other_shapes) {
      throw wrong(
          call, fmt::format("{} has images of {} pixels, {} of {}; expected the same", first.name(),
                            shapes_text(shapes), second.name(), shapes_text(other_shapes)));
    }
    const auto index = static_cast<std::size_t>(task.index);
    const Comparison result = compare(*task.plane, *others[index], call.threads);
    const bool within =
        result.within(call.parameters.number("tolerance"), call.parameters.number("absolute"));
    all_within = all_within && within;
    const auto place = [&](int coordinate) {
      return result.differing > 0 ? static_cast<double>(coordinate + 1) : no_value;
    };
    put_plane(table, task, hdus[index]);
    put(table, "max", result.max_difference, "", "largest |b - a|");
    put(table, "x", place(result.max_at.x), "pixel", "of the first such pixel, from 1");
    put(table, "y", place(result.max_at.y), "pixel");
    put(table, "rms", result.rms_difference, "", "of b - a");
    put(table, "relative_max", result.relative_max(), "", "by the largest |a|");
    put(table, "relative_rms", result.relative_rms(), "", "by the rms of a");
    put_count(table, "count", result.count, "", "pixels finite in both");
    put_count(table, "differing", result.differing, "", "of these");
    put_count(table, "mismatched", result.mismatched, "", "finite in one only");
    put<std::string>(table, "within", within ? "yes" : "no", "", "the tolerance");
  });
  deliver(call, {table}, table);
  return all_within ? 0 : 1;
}

Operation compare_operation() {
  Operation operation;
  operation.name = "compare";
  operation.group = group_name;
  operation.summary = "Differences of two files of the same size; exit code 1 beyond a tolerance";
  operation.description =
      "Plane by plane: the largest |b - a| and where it is, the rms of b - a, both also by the "
      "largest |a| and the rms of a (a is the first file), and how many pixels differ or are "
      "finite "
      "in one file only. Exit code 0 where in all planes |b - a| <= --absolute + --tolerance "
      "max|a| and no pixel is finite in one file only (two NaN, or two infinities of one sign, are "
      "equal); 1 otherwise; 2 where sizes differ. Headers are not compared.";
  operation.least_inputs = operation.most_inputs = 2;
  operation.result = Operation::Result::text;
  operation.parameters = with_output(
      {{"tolerance", ParameterType::number, "largest |a|", not_negative, 0.0, "relative tolerance"},
       {"absolute", ParameterType::number, "unit of the pixels", not_negative, 0.0,
        "absolute tolerance"}});
  operation.example = "compare --tolerance 1e-6 in.fits in2.fits";
  operation.run = run_compare;
  return operation;
}

}  // namespace

std::vector<Operation> measure_operations() {
  return {stats_operation(), photometry_operation(), spectrum_operation(), compare_operation()};
}

}  // namespace gamer
