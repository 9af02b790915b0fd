#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gamer/core/random.h"
#include "processing/detector.h"
#include "processing/instrument_option.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"

namespace gamer {
namespace {

constexpr const char* noise_context = "gutil noise: ";
/// The unit that gamer writes for counts per second; it needs no zero point.
constexpr const char* electron_rate_unit = "electron/s";

/// Parameters of one plane's noise.
struct PlaneNoise {
  double sigma = 0;
  Detector detector;
  double gain = 1;         ///< electrons per output unit
  double unit_factor = 1;  ///< output units in one input unit (times arcsec^2 for a brightness)
};

class NoiseOperation {
 public:
  explicit NoiseOperation(const OperationCall& call);

  PlanePtr change(const PlaneTask& task);
  void edit(FitsHeader& header, int planes);
  std::vector<ExtraImage> variance(const FitsHeader& header, const std::vector<PlaneTask>& tasks);

 private:
  bool has(const char* name) const { return call_.parameters.has(name); }
  double number(const char* name) const { return call_.parameters.number(name); }
  double value(const char* name, const PlaneTask& task) const {
    return plane_value(call_, name, task);
  }
  /// An option, else the instrument's value, else the option's default.
  double number_or(const char* name, double Instrument::*own) const {
    const bool is_own = instrument_.is_given() && !call_.parameters.is_given(name);
    return is_own ? instrument_.get().*own : number(name);
  }
  double exposure(const PlaneTask& task) const;
  int exposures() const;
  std::optional<double> full_well() const;
  /// AB magnitude of 1 electron/s, of the option or the instrument.
  std::optional<double> zero_point(const PlaneTask& task) const;
  /// AB mag/arcsec^2 of the sky, of the option or the instrument.
  std::optional<double> sky(const PlaneTask& task) const;
  PlaneNoise gaussian(const PlaneTask& task) const;
  PlaneNoise ccd(const PlaneTask& task) const;
  double electron_rate(const PlaneTask& task) const;
  double sky_rate(const PlaneTask& task, double rate) const;

  const OperationCall& call_;
  InstrumentOption instrument_;
  bool is_gaussian_ = false;
  std::string output_unit_;
  std::map<std::string, int> labels_;
  std::vector<PlaneNoise> planes_;
  /// Index in planes_ of the first plane of the next HDU.
  std::size_t next_edited_ = 0;
  std::map<std::string, int> variances_;
};

NoiseOperation::NoiseOperation(const OperationCall& call) : call_(call), instrument_(call) {
  const ParameterSet& parameters = call.parameters;
  output_unit_ = parameters.text("output_unit");
  is_gaussian_ = has("sigma") || has("snr");
  const auto exclude = [](const char* a, const char* b) {
    throw input_error("{}{} and {} exclude each other; leave one out", noise_context,
                      option_name(a), option_name(b));
  };
  if (has("sigma") && has("snr")) exclude("sigma", "snr");
  if (has("sky") && has("sky_rate")) exclude("sky", "sky_rate");
  if (is_gaussian_) {
    constexpr const char* detector_name[] = {
        "exposure", "exposures", "zero_point", "electrons_per_unit", "sky",
        "sky_rate", "dark",      "read_noise", "full_well",          "output_unit",
        "gain",     "bias",      "keep_sky",   "instrument"};
    for (const char* name : detector_name) {
      if (!parameters.is_given(name)) continue;
      throw input_error(
          "{}{} is of a detector and does not go with {}, plain Gaussian noise; leave one out",
          noise_context, option_name(name), has("sigma") ? "--sigma" : "--snr");
    }
    return;
  }
  if (!has("exposure") && !instrument_.is_given()) {
    throw input_error(
        "{}which noise? --exposure (s) or --instrument for a detector, --sigma or --snr for plain "
        "Gaussian noise",
        noise_context);
  }
  for (const char* name : {"gain", "bias"}) {
    if (parameters.is_given(name) && output_unit_ != "ADU") {
      throw input_error("{}{} is of the converter to ADU; add --output-unit ADU", noise_context,
                        option_name(name));
    }
  }
}

PlaneNoise NoiseOperation::gaussian(const PlaneTask& task) const {
  PlaneNoise noise;
  if (has("sigma")) {
    noise.sigma = value("sigma", task);
    return noise;
  }
  const double ratio = value("snr", task);
  const double norm = signal_norm(*task.plane, task.threads);
  if (!(norm > 0 && std::isfinite(norm))) {
    throw input_error("{}--snr needs light: plane {} of {} has {}; --sigma needs none",
                      noise_context, task.info.plane + 1, task.label,
                      norm > 0 ? "infinite pixels" : "none");
  }
  noise.sigma = norm / ratio;
  return noise;
}

double NoiseOperation::exposure(const PlaneTask& task) const {
  return has("exposure") ? value("exposure", task) : instrument_.get().exposure;
}

int NoiseOperation::exposures() const {
  // The instrument's number of exposures holds only for its own exposure time.
  const bool is_own =
      instrument_.is_given() && !has("exposure") && !call_.parameters.is_given("exposures");
  return is_own ? instrument_.get().exposures
                : static_cast<int>(call_.parameters.integer("exposures"));
}

std::optional<double> NoiseOperation::full_well() const {
  if (has("full_well")) return number("full_well");
  return instrument_.is_given() ? instrument_.get().full_well : std::nullopt;
}

std::optional<double> NoiseOperation::zero_point(const PlaneTask& task) const {
  if (has("zero_point")) return value("zero_point", task);
  if (!instrument_.is_given() || has("electrons_per_unit")) return std::nullopt;
  return instrument_.band(task).zero_point;
}

std::optional<double> NoiseOperation::sky(const PlaneTask& task) const {
  if (has("sky")) return value("sky", task);
  if (!instrument_.is_given()) return std::nullopt;
  const std::optional<double> own = instrument_.band(task).sky;
  if (own) return own;
  throw input_error("{}{} has no sky in {}; give --sky or --sky-rate", noise_context,
                    instrument_.get().name, task.info.label);
}

/// Area to which the flux of MAGZERO belongs.
double area_of(const PlaneTask& task) {
  if (!task.info.zero_point) return 1;
  try {
    return calibrated_area(task.info.unit, task.header, task.label);
  } catch (const InputError& error) {
    throw input_error(
        "{}a surface brightness ({}) becomes electrons by the size of pixels: {}; give "
        "--electrons-per-unit",
        noise_context, task.info.unit, error.what());
  }
}

/// Electrons/s of a pixel of value 1.
double NoiseOperation::electron_rate(const PlaneTask& task) const {
  const bool has_scale = has("electrons_per_unit");
  const std::optional<double> image_zero_point = task.info.zero_point;
  if (has_scale && has("zero_point") && image_zero_point) {
    throw input_error(
        "{}{} has MAGZERO, so --zero-point and --electrons-per-unit exclude each other; leave one "
        "out",
        noise_context, task.label);
  }
  if (has_scale) return value("electrons_per_unit", task);
  const std::optional<double> own_zero_point = zero_point(task);
  if (!own_zero_point) {
    if (task.info.unit == electron_rate_unit) return 1;
    throw input_error(
        "{}how many electrons is light? Give --zero-point (AB magnitude of 1 electron/s){}",
        noise_context,
        image_zero_point
            ? ""
            : fmt::format(" or, as {} has no MAGZERO, --electrons-per-unit", task.label));
  }
  if (!image_zero_point) {
    throw input_error("{}{} needs MAGZERO, and {} has none; give --electrons-per-unit",
                      noise_context, has("zero_point") ? "--zero-point" : "--instrument",
                      task.label);
  }
  return area_of(task) * flux_ratio(*image_zero_point - *own_zero_point);
}

/// Electrons/s of the sky in a pixel.
double NoiseOperation::sky_rate(const PlaneTask& task, double rate) const {
  if (has("sky_rate")) return value("sky_rate", task);
  const std::optional<double> brightness = sky(task);
  if (!brightness) return 0;
  std::optional<double> rate_zero_point = zero_point(task);
  if (!rate_zero_point && task.info.zero_point) {
    rate_zero_point = *task.info.zero_point - magnitudes_of(rate / area_of(task));
  }
  if (!rate_zero_point) {
    throw input_error(
        "{}--sky needs --zero-point (AB magnitude of 1 electron/s), as {} has no MAGZERO; or give "
        "--sky-rate",
        noise_context, task.label);
  }
  try {
    const double scale = pixel_scale(task.header, task.label);
    return scale * scale * flux_ratio(*brightness - *rate_zero_point);
  } catch (const InputError& error) {
    throw input_error("{}--sky needs the size of pixels: {}; give --sky-rate", noise_context,
                      error.what());
  }
}

PlaneNoise NoiseOperation::ccd(const PlaneTask& task) const {
  PlaneNoise noise;
  Detector& detector = noise.detector;
  detector.electron_rate = electron_rate(task);
  detector.sky_rate = sky_rate(task, detector.electron_rate);
  detector.dark_rate = number_or("dark", &Instrument::dark);
  detector.exposure = exposure(task);
  detector.exposures = exposures();
  detector.read_noise = number_or("read_noise", &Instrument::read_noise);
  detector.full_well = full_well().value_or(detector.full_well);
  double bias = 0;
  const double electrons = detector.electron_rate * detector.exposure;
  const double background_counts = detector.background();
  if (!(std::isnormal(electrons) && std::isfinite(background_counts))) {
    throw input_error(
        "{}a pixel of value 1 of {} would be {:.6g} electrons, and the sky {:.6g}; check the zero "
        "points, --sky and --exposure",
        noise_context, task.label, electrons, background_counts);
  }
  if (output_unit_ == "same") {
    noise.gain = electrons;
  } else if (output_unit_ == "ADU") {
    noise.gain = number_or("gain", &Instrument::gain);
    bias = number("bias");
  }
  if (output_unit_ != "same") noise.unit_factor = electrons / (area_of(task) * noise.gain);
  detector.per_electron = 1 / noise.gain;
  const double background = call_.parameters.boolean("keep_sky") ? 0 : background_counts;
  detector.offset = bias - background * detector.per_electron;
  return noise;
}

PlanePtr NoiseOperation::change(const PlaneTask& task) {
  refuse_magnitudes(call_.operation, task.label, task.info.unit);
  const PlaneNoise noise = is_gaussian_ ? gaussian(task) : ccd(task);
  planes_.push_back(noise);
  const auto seed = static_cast<std::uint64_t>(call_.parameters.integer("seed"));
  const std::uint64_t key = noise_key(seed, task.info.label, labels_[task.info.label]++);
  return is_gaussian_ ? with_gaussian_noise(task.plane, noise.sigma, key)
                      : observed(task.plane, noise.detector, key);
}

/// Sets one card where the planes agree, else one per plane.
void set_common(FitsHeader& header, const std::string& key, const std::vector<double>& values,
                const std::string& comment) {
  const int planes = static_cast<int>(values.size());
  for (int i = 0; i < planes; ++i) header.remove(fmt::format("{}{}", key, i + 1));
  if (std::ranges::all_of(values, [&](double v) { return v == values.front(); })) {
    header.set({key, values.front(), comment});
    return;
  }
  header.remove(key);
  for (int i = 0; i < planes; ++i) {
    header.set({fmt::format("{}{}", key, i + 1), values[static_cast<std::size_t>(i)], comment});
  }
}

void NoiseOperation::edit(FitsHeader& header, int planes) {
  const auto first = planes_.begin() + static_cast<std::ptrdiff_t>(next_edited_);
  const std::vector<PlaneNoise> noises(first, first + planes);
  next_edited_ += static_cast<std::size_t>(planes);
  for (const char* key : {"DATAMIN", "DATAMAX"}) header.remove(key);
  if (is_gaussian_) return;
  // The input's saturation does not apply to this detector.
  header.remove("SATURATE");
  for (int i = 1; i <= planes; ++i) header.remove(fmt::format("SATURATE{}", i));
  const auto values = [&](auto get) {
    std::vector<double> result;
    for (const PlaneNoise& noise : noises) result.push_back(get(noise));
    return result;
  };
  if (output_unit_ != "same") {
    const std::string unit = output_unit_ == "ADU" ? "adu" : "electron";
    change_unit(header, values([](const PlaneNoise& noise) { return noise.unit_factor; }), unit);
    for (const char* key : {"MAGZERO", "PHOTZP"}) {
      for (int i = 0; i <= planes; ++i) {
        const std::string numbered = i == 0 ? key : fmt::format("{}{}", key, i);
        const auto zero_point = header.number(numbered);
        if (zero_point)
          header.set({numbered, *zero_point, fmt::format("AB magnitude of 1 {}", unit)});
      }
    }
    header.set({"BUNIT", unit, "unit of the pixels"});
  }
  set_common(header, "EXPTIME",
             values([](const PlaneNoise& noise) { return noise.detector.exposure; }),
             "[s] all exposures together");
  set_common(header, "GAIN", values([](const PlaneNoise& noise) { return noise.gain; }),
             "electrons per unit of the pixels");
  const Detector& detector = noises.front().detector;
  header.set({"RDNOISE", detector.read_noise * std::sqrt(detector.exposures),
              "[electron] rms, all exposures together"});
  if (std::isfinite(detector.full_well)) {
    set_common(header, "SATURATE",
               values([](const PlaneNoise& noise) { return noise.detector.saturation(); }),
               "pixels that are full have this value");
  }
}

std::vector<ExtraImage> NoiseOperation::variance(const FitsHeader& header,
                                                 const std::vector<PlaneTask>& tasks) {
  ExtraImage image;
  image.header = header;
  for (const PlaneTask& task : tasks) {
    const PlaneNoise& noise = planes_[static_cast<std::size_t>(task.index)];
    image.planes.push_back(is_gaussian_ ? gaussian_variance(task.plane, noise.sigma)
                                        : observed_variance(task.plane, noise.detector));
  }
  // Calibration cards do not apply to squares of values.
  drop_calibration(image.header, static_cast<int>(tasks.size()));
  const std::string unit = header.text("BUNIT").value_or("");
  if (!unit.empty()) image.header.set({"BUNIT", squared_unit(unit), "variance of the pixels"});
  const std::string name = header.text("EXTNAME").value_or("");
  const std::string extension = name.empty() ? "VARIANCE" : name + "_VARIANCE";
  image.header.set({"EXTNAME", extension, "variance of the image before"});
  image.header.set({"UTYPE", "VarianceUncertainty", "kind, for Astropy's CCDData"});
  // Several images without names get EXTVER.
  if (const int version = ++variances_[extension]; name.empty() && version > 1) {
    image.header.set({"EXTVER", static_cast<long long>(version), ""});
  }
  return {image};
}

int run_noise(const OperationCall& call) {
  NoiseOperation noise(call);
  ExtraImages extra;
  if (call.parameters.boolean("variance")) {
    extra = [&](const FitsHeader& header, const std::vector<PlaneTask>& tasks) {
      return noise.variance(header, tasks);
    };
  }
  change_planes(
      call, [&](const PlaneTask& task) { return noise.change(task); },
      [&](FitsHeader& header, int, int, int planes) { noise.edit(header, planes); }, extra);
  return 0;
}

ParameterTable noise_parameters() {
  constexpr double most_exposures = 1e6;
  const auto list = [](const char* name, const char* unit, const Interval& interval,
                       const char* description) {
    return Parameter::numbers(name, unit, interval, std::nullopt, description);
  };
  return {
      InstrumentOption::parameter(),
      list("exposure", "s", Interval::positive(),
           "exposure time, of all exposures together; or one per plane"),
      Parameter::integer("exposures", "", Interval::closed(1, most_exposures), 1,
                         "number of exposures added up; each has read noise and a full well"),
      list("zero_point", "mag", Interval::any(),
           "AB magnitude that gives 1 electron/s; or one per plane"),
      list("electrons_per_unit", "electron/s", Interval::positive(),
           "electrons per second of a pixel of value 1, for images without MAGZERO; or one per "
           "plane"),
      list("sky", "mag/arcsec^2", Interval::any(),
           "AB surface brightness of the sky; or one per plane"),
      list("sky_rate", "electron/s", Interval::at_least(0),
           "sky, electrons per second and pixel; or one per plane"),
      Parameter::number("dark", "electron/s", Interval::at_least(0), 0.0,
                        "dark current of a pixel"),
      Parameter::number("read_noise", "electron", Interval::at_least(0), 0.0,
                        "rms noise of a pixel in one exposure"),
      Parameter::number("full_well", "electron", Interval::positive(), std::nullopt,
                        "largest count of a pixel in one exposure"),
      Parameter::choice("output_unit", {"same", "electron", "ADU"}, "same",
                        "unit of the output: the input's, electrons, or ADU"),
      Parameter::number("gain", "electron/ADU", Interval::positive(), 1.0, "electrons of 1 ADU"),
      Parameter::number("bias", "ADU", Interval::any(), 0.0, "what the converter adds"),
      Parameter::boolean("keep_sky", false, "leave the mean of sky and dark current in the image"),
      list("sigma", "pixel units", Interval::at_least(0),
           "plain Gaussian noise of this rms; or one per plane"),
      list("snr", "", Interval::positive(),
           "plain Gaussian noise that gives the plane this signal-to-noise ratio; or one per "
           "plane"),
      Parameter::integer("seed", "", Interval::right_open(0, largest_seed), 1, "seed of the noise"),
      Parameter::boolean("variance", false,
                         "add the expected variance of each image as a further image"),
  };
}

Operation noise_operation() {
  return {
      .name = "noise",
      .summary = "Add the noise of a CCD, or Gaussian noise",
      .description =
          "A pixel of value v collects mu = (v s + sky + dark) exposure electrons in the mean. The "
          "pixel reads N = Poisson(mu) + Normal(0, read noise sqrt(exposures)), at most full well "
          "x exposures. The factor s is 10^(-0.4 (MAGZERO - zero point)), for surface brightnesses "
          "times the pixel's arcsec^2. --electrons-per-unit gives s directly; for images in "
          "electron/s the default of s is 1. The sky is 10^(-0.4 (sky - zero point)) times the "
          "pixel's arcsec^2. A negative v counts as 0.\n\nThe output is N less the mean of sky and "
          "dark; --keep-sky keeps that mean. By default the output has the input's unit, so that "
          "photometry stays. --output-unit chooses electrons, or ADU = N / gain + bias. MAGZERO, "
          "PHOTZP and PHOTFLAM follow the unit. EXPTIME, GAIN (electrons per unit of the output), "
          "RDNOISE (for all exposures together) and SATURATE are set.\n\n--sigma and --snr add "
          "Normal(0, sigma) instead. The signal-to-noise ratio is that of a matched filter: S/N = "
          "sqrt(sum v^2) / sigma over the pixels of the plane. --variance adds an HDU "
          "<EXTNAME>_VARIANCE, or VARIANCE, with mu + exposures read noise^2 in the output's unit "
          "squared, or with sigma^2. The variance ignores saturation.\n\nA pixel's noise follows "
          "from the seed, the plane's band or wavelength and the pixel's place alone. The order "
          "and the number of planes in the file do not matter.\n\n--instrument gives exposure, "
          "read noise, dark current, gain and full well of a camera, and zero point and sky of "
          "each plane's band. An option that is given replaces the instrument's value. The "
          "instrument's number of exposures holds only with its own exposure time.",
      .parameters = noise_parameters(),
      .example =
          "noise --exposure 3600 --zero-point 28 --sky 21.5 --read-noise 5 --variance in.fits "
          "out.fits",
      .run = run_noise};
}

}  // namespace

std::vector<Operation> detector_operations() { return {noise_operation(), inject_operation()}; }

}  // namespace gamer
