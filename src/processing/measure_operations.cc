#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/no_value.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/image/data_table.h"
#include "processing/comparison.h"
#include "processing/measurement_table.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/power_spectrum.h"
#include "processing/spectrum_plot.h"
#include "processing/statistics.h"

namespace gamer {
namespace {

// stats

/// "p5", "p99_9": FITS wants columns of letters, digits and underscores.
std::string percentile_name(double percent) {
  std::string name = fmt::format("p{}", percent);
  std::ranges::replace(name, '.', '_');
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
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    const Plane& plane = *task.plane;
    const Statistics all = statistics(plane, call.threads);
    const std::vector<double> ordered = quantiles(plane, fractions, call.threads);
    const bool has_pixels = all.count > 0;
    const auto place = [&](int coordinate) {
      return has_pixels ? static_cast<double>(coordinate + 1) : no_value;
    };
    put_plane(table, task);
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
  std::ranges::sort(sorted);
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    throw wrong(call, "--percentiles has {:g} twice; give each once", *twice);
  }
}

Operation stats_operation() {
  return {
      .name = "stats",
      .summary = "Counts, sum, extremes, mean, sigma, median and percentiles of every plane",
      .description =
          "Each plane has a row for its finite pixels. sigma = sqrt(mean((v - mean)^2)) and "
          "mad_sigma = 1.4826 median|v - median|. A percentile interpolates linearly between the "
          "sorted values, as NumPy does, and is exact for images of any size. Positions are FITS "
          "pixels; of equal pixels the first from the bottom is named. --clip adds mean and sigma "
          "of the pixels within this number of sigma, iterated from median and mad_sigma.",
      .result = Operation::Result::text,
      .parameters = with_output(
          {Parameter::numbers("percentiles", "", Interval::closed(0, 100),
                              std::vector<double>{1, 5, 25, 75, 95, 99}, "percentiles to list"),
           Parameter::number("clip", "sigma", Interval::positive(), std::nullopt,
                             "limit in sigma; also lists the clipped mean and sigma")}),
      .example = "stats --percentiles 5,95 --clip 3 in.fits",
      .run = [](const OperationCall& call) {
        check_percentiles(call);
        return run_stats(call);
      }};
}

// spectrum

BoundTable power_spectrum_keys(SpectrumOptions& p) {
  return {choice(p.window, "window",
                 {{"none", SpectrumWindow::none},
                  {"hann", SpectrumWindow::hann},
                  {"cosine", SpectrumWindow::cosine}},
                 "none, hann, or cosine (rises over --taper at every edge)"),
          {p.taper, "taper", "side", Interval::left_open(0, 0.5), "length of the cosine's rise"},
          {p.opacity, "opacity", "pixels are opacities: take tau = -ln(1 - v)"},
          {p.logarithm, "log", "take the natural logarithm first"},
          {p.white_level, "white", "(unit of the pixels)^2", Interval::at_least(0),
           "power of white noise to subtract, sigma^2"},
          {p.psf_fwhm, "psf_fwhm", "pixel", Interval::at_least(0),
           "divide by the squared transfer function of a Gaussian of this FWHM (after --white)"},
          Parameter::vector2("range", "", Interval::at_least(1), std::nullopt,
                             "k1,k2 of the fit (default: 4,N/4)"),
          {p.bins, "bins", "", Interval::closed(3, 1000), "of the fit"},
          Parameter::text("plot", std::nullopt, "write a plot: .png")};
}

SpectrumOptions spectrum_options(const ParameterSet& parameters) {
  SpectrumOptions options = read_object(parameters, power_spectrum_keys);
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
    throw wrong(call, "--range {:g},{:g}: expected 1 <= k1 < k2 <= {} for {} x {} pixels",
                options.lowest, options.highest, most, task.plane->width(), task.plane->height());
  }
}

void put_fit(DataTable& table, const PlaneTask& task, const PowerSpectrum& spectrum) {
  put_plane(table, task);
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

void put_annuli(DataTable& table, const PlaneTask& task, const PowerSpectrum& spectrum) {
  for (const PowerSpectrum::Annulus& annulus : spectrum.annuli) {
    put_plane(table, task);
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
  visit_planes(input, call.threads,
               [&](const PlaneTask& task) { check_range(call, options, task); });
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    const PowerSpectrum spectrum =
        power_spectrum(*task.plane, options, "gutil spectrum: " + task.label, call.threads);
    put_fit(fits, task, spectrum);
    put_annuli(annuli, task, spectrum);
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
  return {
      .name = "spectrum",
      .summary = "Azimuthally averaged power spectrum and its slope",
      .description =
          "The mean is subtracted and the window w applied. The power |F|^2/sum(w^2) is averaged "
          "over the modes whose |k| rounds to 1, 2, ... N/2. k counts waves per shorter side N, so "
          "that k/N is the frequency in cycles per pixel. White noise has power sigma^2 at all k. "
          "A straight line through ln P against ln k gives the slope and its standard error. Its "
          "bins have equal width in ln k over --range (default 4 to N/4). Hann's window keeps "
          "steep spectra free of leakage from the edges; none is right for periodic images. "
          "Missing pixels become the mean. sigma and skewness of the values and of their "
          "logarithms are listed too. An image is held in memory whole, 8 bytes per pixel.",
      .result = Operation::Result::text,
      .parameters = with_output(declarations(power_spectrum_keys)),
      .example = "spectrum --window hann --bins 8 in.fits",
      .run = run_spectrum};
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
  visit_planes(first, call.threads, [&](const PlaneTask& task) {
    if (shapes != other_shapes) {
      throw wrong(call, "{} has images of {} pixels, {} of {}; expected the same", first.name(),
                  shapes_text(shapes), second.name(), shapes_text(other_shapes));
    }
    const Comparison result =
        compare(*task.plane, *others[static_cast<std::size_t>(task.index)], call.threads);
    const bool within =
        result.within(call.parameters.number("tolerance"), call.parameters.number("absolute"));
    all_within = all_within && within;
    const auto place = [&](int coordinate) {
      return result.differing > 0 ? static_cast<double>(coordinate + 1) : no_value;
    };
    put_plane(table, task);
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
  return {.name = "compare",
          .summary = "Differences of two files with equal sizes; exit code 1 beyond a tolerance",
          .description =
              "For each plane of the files a (first) and b the table gives the largest |b - a|, "
              "its place, and the rms of b - a. They are also given relative to the largest |a| "
              "and the rms of a. Further columns count the pixels that differ, and pixels that are "
              "finite in one file only. The exit code is 0 if |b - a| <= --absolute + --tolerance "
              "max|a| in all planes and no pixel is finite in one file only. Two NaN, or two "
              "infinities of one sign, are equal. The exit code is 1 otherwise, and 2 if sizes "
              "differ. Headers are not compared.",
          .least_inputs = 2,
          .most_inputs = 2,
          .result = Operation::Result::text,
          .parameters =
              with_output({Parameter::number("tolerance", "largest |a|", Interval::at_least(0), 0.0,
                                             "relative tolerance"),
                           Parameter::number("absolute", "unit of the pixels",
                                             Interval::at_least(0), 0.0, "absolute tolerance")}),
          .example = "compare --tolerance 1e-6 in.fits in2.fits",
          .run = run_compare};
}

}  // namespace

std::vector<Operation> measure_operations() {
  return {stats_operation(),  photometry_operation(), profile_operation(), morphology_operation(),
          unwrap_operation(), spectrum_operation(),   compare_operation()};
}

}  // namespace gamer
