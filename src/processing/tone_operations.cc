#include <fmt/ranges.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/bound_parameter.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/tone.h"

namespace gamer {
namespace {

// ---- One tone for each plane or for the file ---------------------------------------------------

Parameter per_parameter() {
  return Parameter::choice(
      "per", {"file", "plane"}, "file",
      "measure all planes of the file together, which keeps colours, or each plane alone");
}

/// An output plane, made once all planes of the file are known.
class LatePlane final : public Plane {
 public:
  LatePlane(const PlanePtr& source, std::shared_ptr<PlanePtr> made)
      : Plane(source->width(), source->height()), source_(source), made_(std::move(made)) {}

  Tile tile() const override { return source_->tile(); }
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    (*made_)->read(area, out, stride);
  }

 private:
  PlanePtr source_;
  std::shared_ptr<PlanePtr> made_;
};

template <class Tone>
struct ToneChange {
  /// Measures a tone in planes together; its InputErrors do not name the planes.
  std::function<Tone(std::span<const PlaneTask> group)> measure;
  std::function<PlanePtr(const PlanePtr& plane, const Tone& tone)> apply;
  /// Changes a header; `tones` are those of the HDU's planes.
  std::function<void(FitsHeader& header, std::span<const Tone> tones)> edit;
  /// Throws InputError for options that do not suit a plane.
  std::function<void(const PlaneTask& task)> check = {};
  /// Applies the tone to planes of variances; if it is empty, they are refused.
  std::function<PlanePtr(const PlanePtr& plane, const Tone& tone)> apply_to_variance = {};
  std::function<void(FitsHeader& header)> edit_variance = {};
};

template <class Tone>
std::vector<Tone> measure_tones(const OperationCall& call, std::span<const PlaneTask> tasks,
                                const ToneChange<Tone>& change) {
  const auto measure = [&](std::span<const PlaneTask> group) {
    try {
      return change.measure(group);
    } catch (const InputError& error) {
      const PlaneTask& first = group.front();
      const std::string plane =
          group.size() == 1 && first.count > 1 ? fmt::format(", plane {}", first.index + 1) : "";
      throw wrong(call, "{}{}: {}", first.label, plane, error.what());
    }
  };
  std::vector<Tone> tones;
  if (call.parameters.text("per") == "plane") {
    for (std::size_t i = 0; i < tasks.size(); ++i) tones.push_back(measure(tasks.subspan(i, 1)));
  } else {
    tones.assign(tasks.size(), measure(tasks));
  }
  return tones;
}

/// Runs an operation whose tone is measured in its planes.
template <class Tone>
int change_tones(const OperationCall& call, const ToneChange<Tone>& change) {
  struct Late {
    PlaneTask task;
    std::shared_ptr<PlanePtr> made;
  };
  std::vector<Late> images, variances;
  std::vector<Tone> tones;
  std::size_t edited = 0;
  const auto late = [](std::vector<Late>& planes, const PlaneTask& task) {
    planes.push_back({task, std::make_shared<PlanePtr>()});
    return std::make_shared<LatePlane>(task.plane, planes.back().made);
  };
  const auto measure = [&] {
    if (!tones.empty()) return;
    std::vector<PlaneTask> tasks;
    for (const Late& image : images) tasks.push_back(image.task);
    tones = measure_tones(call, std::span<const PlaneTask>(tasks), change);
    const auto tone_of = [&](const Late& plane) {
      return tones[static_cast<std::size_t>(plane.task.index)];
    };
    for (const Late& image : images) *image.made = change.apply(image.task.plane, tone_of(image));
    for (const Late& variance : variances) {
      *variance.made = change.apply_to_variance(variance.task.plane, tone_of(variance));
    }
  };
  VarianceChange variance;
  if (change.apply_to_variance) {
    variance.change = [&](const PlaneTask& task) { return late(variances, task); };
    variance.edit = [&](FitsHeader& header, int, int, int) {
      measure();
      change.edit_variance(header);
    };
  }
  change_planes(
      call,
      [&](const PlaneTask& task) {
        if (change.check) change.check(task);
        return late(images, task);
      },
      [&](FitsHeader& header, int, int, int planes) {
        measure();
        const auto count = static_cast<std::size_t>(planes);
        change.edit(header, std::span<const Tone>(tones).subspan(edited, count));
        edited += count;
      },
      {}, variance);
  return 0;
}

std::vector<PlanePtr> planes_of(std::span<const PlaneTask> group) {
  std::vector<PlanePtr> planes;
  for (const PlaneTask& task : group) planes.push_back(task.plane);
  return planes;
}

// ---- normalise ---------------------------------------------------------------------------------

constexpr std::array<const char*, 5> targets = {"total", "peak", "mean", "percentile_range",
                                                "magnitude"};

std::string only_target(const OperationCall& call) {
  std::vector<std::string> given, all;
  for (const char* name : targets) {
    all.push_back(option_name(name));
    if (call.parameters.has(name)) given.emplace_back(name);
  }
  if (given.size() == 1) return given.front();
  if (given.empty()) {
    throw input_error("gutil normalise: to what? give one of {}", fmt::join(all, ", "));
  }
  throw input_error("gutil normalise: {} and {} exclude each other; give one",
                    option_name(given[0]), option_name(given[1]));
}

/// The tone that gives the plane's total the magnitude.
LinearTone tone_to_magnitude(double magnitude, const PlaneTask& task) {
  if (!task.info.zero_point) {
    throw InputError("has no MAGZERO card, which --magnitude needs; --total sets the sum instead");
  }
  double total = flux_ratio(magnitude - *task.info.zero_point);
  if (is_brightness(task.info.unit)) {
    const double scale = pixel_scale(task.header, task.label);
    total /= scale * scale;
  }
  return tone_to_total(std::span(&task.plane, 1), total, task.threads);
}

class Normalisation {
 public:
  explicit Normalisation(const OperationCall& call);
  int run() const;

 private:
  /// The planes of a group that are measured.
  std::span<const PlaneTask> measured(std::span<const PlaneTask> group) const;
  LinearTone tone(std::span<const PlaneTask> group) const;

  const OperationCall& call_;
  std::string target_;
  bool is_to_magnitude_;
  std::array<double, 2> range_{};  ///< of target percentile_range, shares
};

Normalisation::Normalisation(const OperationCall& call)
    : call_(call), target_(only_target(call)), is_to_magnitude_(target_ == "magnitude") {
  const ParameterSet& parameters = call.parameters;
  if (parameters.has("reference") && parameters.text("per") == "plane") {
    throw InputError("gutil normalise: --reference goes with --per file");
  }
  if (target_ != "percentile_range") return;
  const std::vector<double>& percentiles = parameters.numbers(target_);
  range_ = {percentiles[0] * percent, percentiles[1] * percent};
  if (!(range_[0] < range_[1])) {
    throw input_error("gutil normalise: --percentile-range {}: low must be below high",
                      fmt::join(percentiles, ","));
  }
}

std::span<const PlaneTask> Normalisation::measured(std::span<const PlaneTask> group) const {
  if (!call_.parameters.has("reference")) return group;
  const std::int64_t reference = call_.parameters.integer("reference");
  if (reference > static_cast<std::int64_t>(group.size())) {
    throw input_error("--reference {}: there are {} planes", reference, group.size());
  }
  return group.subspan(static_cast<std::size_t>(reference) - 1, 1);
}

LinearTone Normalisation::tone(std::span<const PlaneTask> group) const {
  group = measured(group);
  const int threads = group.front().threads;
  if (is_to_magnitude_) {
    if (group.size() > 1) {
      throw input_error("--magnitude of which of {} planes? give --reference, or --per plane",
                        group.size());
    }
    return tone_to_magnitude(plane_value(call_, "magnitude", group.front()), group.front());
  }
  const std::vector<PlanePtr> planes = planes_of(group);
  if (target_ == "percentile_range") {
    return tone_to_unit_range(quantile_limits(planes, range_[0], range_[1], threads));
  }
  const double value = call_.parameters.number(target_);
  if (target_ == "total") return tone_to_total(planes, value, threads);
  if (target_ == "peak") return tone_to_peak(planes, value, threads);
  return tone_to_mean(planes, value, threads);
}

int Normalisation::run() const {
  const auto measure = [&](std::span<const PlaneTask> group) { return tone(group); };
  const auto edit = [&](FitsHeader& header, std::span<const LinearTone> tones) {
    if (is_to_magnitude_) return;
    std::vector<double> factors;
    for (const LinearTone& one : tones) factors.push_back(one.factor);
    change_unit(header, factors, "");
  };
  const auto check = [&](const PlaneTask& task) {
    refuse_magnitudes(call_.operation, task.label, task.info.unit);
    if (is_to_magnitude_) plane_value(call_, "magnitude", task);
  };
  const auto scale_variance = [](const PlanePtr& plane, const LinearTone& one) {
    return linear_tone(plane, {0, one.factor * one.factor});
  };
  const auto edit_variance = [&](FitsHeader& header) {
    if (!is_to_magnitude_) header.remove("BUNIT");
  };
  return change_tones<LinearTone>(
      call_, {measure, linear_tone, edit, check, scale_variance, edit_variance});
}

Operation normalise_operation() {
  return {
      .name = "normalise",
      .aliases = {"normalize"},
      .summary = "Bring the pixels to a total, peak, mean, range or magnitude",
      .description =
          "v' = f v, where f gives the sum, the largest or the mean of the pixels the wanted "
          "value. By default all planes of the file have one factor f, which keeps colours; --per "
          "plane gives each plane its own. --percentile-range low,high subtracts the low "
          "percentile and scales the high percentile to 1. With --per file all planes are measured "
          "together, or only the plane that --reference names. --magnitude m makes the sum "
          "10^(-0.4 (m - MAGZERO)); pixels per solid angle count with their area. Missing pixels "
          "(NaN) are left out. --magnitude changes the light: BUNIT and MAGZERO stay. The other "
          "options change the unit, so that magnitudes stay right. BUNIT is deleted, MAGZERO and "
          "PHOTZP grow by 2.5 log10 f, PHOTFLAM and GAIN are divided by f, and SATURATE is "
          "multiplied by f. After --percentile-range magnitudes are those of light above the low "
          "percentile. Variances (EXTNAME VARIANCE, ..._VARIANCE) are not measured, and are "
          "multiplied by f^2.",
      .parameters =
          {
              Parameter::number("total", "", Interval::positive(), std::nullopt,
                                "sum of the pixels"),
              Parameter::number("peak", "", Interval::positive(), std::nullopt, "largest pixel"),
              Parameter::number("mean", "", Interval::positive(), std::nullopt,
                                "mean of the pixels"),
              Parameter::vector2("percentile_range", "%", Interval::closed(0, 100), std::nullopt,
                                 "percentiles low,high that become 0 and 1"),
              Parameter::numbers("magnitude", "mag", Interval::any(), std::nullopt,
                                 "AB magnitude of the sum: one for all planes, or one for each"),
              per_parameter(),
              Parameter::integer("reference", "", Interval::at_least(1), std::nullopt,
                                 "with --per file: the plane, from 1, that is measured for all"),
          },
      .example = "normalise --peak 1 in.fits out.fits",
      .run = [](const OperationCall& call) { return Normalisation(call).run(); }};
}

// ---- gamma -------------------------------------------------------------------------------------

int correct_gamma(const OperationCall& call) {
  const ParameterSet& parameters = call.parameters;
  const double gamma = parameters.number("gamma");
  const auto measure = [&](std::span<const PlaneTask> group) {
    return parameters.has("maximum") ? parameters.number("maximum")
                                     : positive_maximum(planes_of(group), group.front().threads);
  };
  const auto apply = [gamma](const PlanePtr& plane, double maximum) {
    return gamma_tone(plane, maximum, gamma);
  };
  const auto edit = [](FitsHeader& header, std::span<const double> maxima) {
    drop_calibration(header, static_cast<int>(maxima.size()));
  };
  return change_tones<double>(call, {measure, apply, edit});
}

Operation gamma_operation() {
  return {
      .name = "gamma",
      .summary = "Gamma correction",
      .description =
          "v' = (v/max)^gamma, where max is the largest pixel of the file, the largest of each "
          "plane (--per plane), or --maximum (Groeneboom & Dahle 2014). A gamma below 1 brightens "
          "faint pixels; displays need 1/2.2 = 0.4545. Negative pixels keep their sign: "
          "-(-v/max)^gamma. The output is not a linear measure of light: BUNIT, MAGZERO, "
          "PHOTZP, PHOTFLAM, GAIN and SATURATE are deleted.",
      .parameters =
          {
              required(
                  Parameter::number("gamma", "", Interval::positive(), std::nullopt, "exponent")),
              Parameter::number("maximum", "unit of the pixels", Interval::positive(), std::nullopt,
                                "value that becomes 1 (default: the largest pixel)"),
              per_parameter(),
          },
      .example = "gamma --gamma 0.4545 in.fits out.fits",
      .run = correct_gamma};
}

// ---- stretch -----------------------------------------------------------------------------------

BoundTable stretch_keys(Stretch& p) {
  return {choice(p.function, "function",
                 {{"linear", Stretch::Function::linear},
                  {"sqrt", Stretch::Function::square_root},
                  {"log", Stretch::Function::logarithm},
                  {"asinh", Stretch::Function::asinh}},
                 "the stretch"),
          without_default({p.softening, "softening", "", Interval::positive(),
                           "parameter a of log (default 1000; larger bends more) and "
                           "asinh (default 0.1; smaller bends more)"}),
          Parameter::vector2("percentiles", "%", Interval::closed(0, 100),
                             std::vector<double>{0, 100}, "limits low,high as percentiles"),
          Parameter::vector2("limits", "unit of the pixels", Interval::any(), std::nullopt,
                             "limits low,high as values"),
          Parameter::boolean("no_clip", false, "keep values beyond the limits"),
          per_parameter()};
}

int stretch_file(const OperationCall& call) {
  const ParameterSet& parameters = call.parameters;
  Stretch stretch;
  const std::string& name = parameters.text("function");
  put_values(parameters, stretch_keys(stretch));
  const bool has_softening = name == "log" || name == "asinh";
  if (parameters.has("softening") && !has_softening) {
    throw input_error("gutil stretch: --softening goes with log and asinh, not {}", name);
  }
  if (!parameters.has("softening")) stretch.softening = default_softening(stretch.function);
  stretch.clip = !parameters.boolean("no_clip");
  if (parameters.has("limits") && parameters.is_given("percentiles")) {
    throw InputError("gutil stretch: --limits and --percentiles exclude each other; give one");
  }
  const std::string limits = parameters.has("limits") ? "limits" : "percentiles";
  const std::vector<double>& ends = parameters.numbers(limits);
  if (!(ends[0] < ends[1])) {
    throw input_error("gutil stretch: {} {}: low must be below high", option_name(limits),
                      fmt::join(ends, ","));
  }
  const auto measure = [&](std::span<const PlaneTask> group) {
    if (limits == "limits") return Limits{ends[0], ends[1]};
    const Limits measured = quantile_limits(planes_of(group), ends[0] * percent, ends[1] * percent,
                                            group.front().threads);
    tone_to_unit_range(measured);
    return measured;
  };
  const auto apply = [&](const PlanePtr& plane, const Limits& measured) {
    Stretch of_plane = stretch;
    of_plane.limits = measured;
    return stretched(plane, of_plane);
  };
  const auto edit = [](FitsHeader& header, std::span<const Limits> tones) {
    drop_calibration(header, static_cast<int>(tones.size()));
  };
  return change_tones<Limits>(call, {measure, apply, edit});
}

Operation stretch_operation() {
  return {.name = "stretch",
          .summary = "Linear, sqrt, log or asinh stretch between two limits",
          .description =
              "With x = (v - low)/(high - low) and softening a, the functions are: linear v' = x; "
              "sqrt v' = sqrt(x); log v' = ln(1 + a x)/ln(1 + a); asinh v' = "
              "asinh(x/a)/asinh(1/a). The limits low and high are percentiles of the file or of "
              "each plane (--per plane), or fixed values. x is clipped to [0, 1]; with --no-clip "
              "v'(-x) = -v'(x). Missing pixels stay missing. The output is not a linear measure "
              "of light: BUNIT, MAGZERO, PHOTZP, PHOTFLAM, GAIN and SATURATE are deleted.",
          .parameters = declarations(stretch_keys),
          .example = "stretch --function asinh --percentiles 1,99.9 in.fits out.fits",
          .run = stretch_file};
}

}  // namespace

std::vector<Operation> tone_operations() {
  return {normalise_operation(), gamma_operation(), stretch_operation(), rgb_operation()};
}

}  // namespace gamer
