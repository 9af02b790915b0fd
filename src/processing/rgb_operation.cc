#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/rgb.h"
#include "processing/tone.h"

namespace gamer {
namespace {

constexpr double default_display_gamma = 2.2;

struct Source {
  PlanePtr plane;
  PlaneInfo info;
  std::string label;
};

std::vector<Source> read_sources(const OperationCall& call) {
  std::vector<Source> sources;
  for (const std::string& name : call.inputs) {
    const FitsInput input(name);
    visit_planes(input, call.threads, [&](const PlaneTask& task) {
      if (task.info.role == PlaneRole::variance) return;
      const std::string plane =
          task.info.planes > 1 ? fmt::format(" (plane {})", task.info.plane + 1) : "";
      sources.push_back({task.plane, task.info, task.label + plane});
    });
  }
  return sources;
}

/// The planes for the picture: those of --planes, else all.
std::vector<Source> choose_sources(const OperationCall& call, const std::vector<Source>& all) {
  if (!call.parameters.has("planes")) return all;
  std::vector<Source> chosen;
  for (const double number : call.parameters.numbers("planes")) {
    if (number != std::floor(number) || number > static_cast<double>(all.size())) {
      throw input_error("gutil rgb: --planes {}: there is no plane {}, only 1 to {}",
                        fmt::join(call.parameters.numbers("planes"), ","), number, all.size());
    }
    chosen.push_back(all[static_cast<std::size_t>(number) - 1]);
  }
  return chosen;
}

void check_sources(const OperationCall& call, const std::vector<Source>& sources) {
  const Source& first = sources.front();
  for (const Source& source : sources) {
    const Plane &a = *first.plane, &b = *source.plane;
    if (a.width() != b.width() || a.height() != b.height()) {
      throw input_error(
          "gutil rgb: {} has {} x {} pixels, {} has {} x {}; channels are of one size", first.label,
          a.width(), a.height(), source.label, b.width(), b.height());
    }
    if (is_magnitude(source.info.unit)) {
      throw input_error(
          "gutil rgb: the pixels of {} are magnitudes ({}); a picture needs light, such as nJy",
          source.label, source.info.unit);
    }
  }
  const bool fits = sources.size() == 1 || sources.size() == 3;
  if (!fits && call.parameters.text("method") != "auto") {
    const std::string few = sources.size() > 3 ? "choose three by --planes r,g,b" : "give three";
    throw input_error("gutil rgb: {} planes in {}; {}, or take --method auto", sources.size(),
                      fmt::join(call.inputs, ", "), few);
  }
}

/// Wavelengths that sort the channels; empty where the given order stays.
std::vector<double> sorting_wavelengths(const OperationCall& call,
                                        const std::vector<Source>& sources) {
  const ParameterSet& parameters = call.parameters;
  const bool by_wavelength = parameters.text("order") == "wavelength";
  if (parameters.has("planes")) {
    if (by_wavelength && parameters.is_given("order")) {
      throw InputError(
          "gutil rgb: --planes are red, green and blue as given; --order goes without");
    }
    return {};
  }
  std::vector<double> wavelengths;
  for (const Source& source : sources) {
    if (!by_wavelength || !source.info.wavelength) return {};
    wavelengths.push_back(*source.info.wavelength);
  }
  return wavelengths;
}

/// light_of_unit() of the planes; empty where one has no wavelength or zero point.
std::vector<double> light_of_sources(const std::vector<Source>& sources) {
  std::vector<double> wavelengths, zero_points;
  for (const Source& source : sources) {
    if (!source.info.wavelength || !source.info.zero_point) return {};
    wavelengths.push_back(*source.info.wavelength);
    zero_points.push_back(*source.info.zero_point);
  }
  return light_of_unit(wavelengths, zero_points);
}

/// Checks options that belong to some methods only.
void check_method_options(const OperationCall& call) {
  static const std::map<std::string, std::vector<std::string>> methods = {
      {"minimum", {"lupton", "stiff", "plain"}},
      {"scale", {"lupton"}},
      {"stretch", {"lupton"}},
      {"q", {"lupton"}},
      {"maximum", {"stiff", "plain"}},
      {"percentiles", {"stiff", "plain"}},
      {"gamma", {"stiff", "plain"}},
      {"luminance_gamma", {"stiff"}},
      {"saturation", {"stiff", "auto"}},
      {"brightness", {"auto"}},
      {"contrast", {"auto"}}};
  const std::string& method = call.parameters.text("method");
  for (const auto& [name, known] : methods) {
    if (!call.parameters.is_given(name)) continue;
    if (std::ranges::find(known, method) == known.end()) {
      throw input_error("gutil rgb: {} goes with --method {}, not {}", option_name(name),
                        fmt::join(known, " or "), method);
    }
  }
}

/// One value for all channels, or one per channel.
std::optional<Rgb> channel_values(const OperationCall& call, const std::string& name) {
  if (!call.parameters.has(name)) return std::nullopt;
  const std::vector<double>& values = call.parameters.numbers(name);
  if (values.size() == 1) return Rgb{values[0], values[0], values[0]};
  if (values.size() == 3) return Rgb{values[0], values[1], values[2]};
  throw input_error("gutil rgb: {} has {} values; give one, or one for each channel",
                    option_name(name), values.size());
}

/// Channels with 0 for missing pixels, which then have no weight in the choice of a tone.
std::vector<PlanePtr> finite_channels(std::span<const PlanePtr> channels) {
  return picture_channels({channels.begin(), channels.end()}, {});
}

/// Black and white of each channel: given values, else percentiles, else the sky and
/// white_quantile.
std::array<Limits, 3> channel_limits(const OperationCall& call,
                                     std::span<const PlanePtr> channels) {
  constexpr double white_quantile = 0.999;
  const std::optional<Rgb> low = channel_values(call, "minimum");
  const std::optional<Rgb> high = channel_values(call, "maximum");
  const bool has_percentiles = call.parameters.has("percentiles");
  if (has_percentiles && (low || high)) {
    throw input_error("gutil rgb: --percentiles and {} exclude each other; give one",
                      low ? "--minimum" : "--maximum");
  }
  std::array<Limits, 3> limits;
  if (has_percentiles) {
    const std::vector<double>& ends = call.parameters.numbers("percentiles");
    if (!(ends[0] < ends[1])) {
      throw input_error("gutil rgb: --percentiles {}: low must be below high",
                        fmt::join(ends, ","));
    }
    for (std::size_t c = 0; c < channels.size(); ++c) {
      limits[c] = quantile_limits(channels.subspan(c, 1), ends[0] * percent, ends[1] * percent,
                                  call.threads);
    }
  } else {
    const Rgb black = low ? *low : automatic_tone(finite_channels(channels), call.threads).black;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const double white = high ? (*high)[c]
                                : quantile_limits(channels.subspan(c, 1), white_quantile,
                                                  white_quantile, call.threads)
                                      .high;
      limits[c] = {black[c], white};
    }
  }
  if (channels.size() == 1) {
    for (std::size_t c = 1; c < 3; ++c) {
      limits[c] = {low ? (*low)[c] : limits[0].low, high ? (*high)[c] : limits[0].high};
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    if (limits[c].low < limits[c].high) continue;
    constexpr std::array<const char*, 3> names = {"red", "green", "blue"};
    throw input_error(
        "gutil rgb: black at {:.6g} and white at {:.6g} in {}: give --minimum below --maximum",
        limits[c].low, limits[c].high, names[c]);
  }
  return limits;
}

std::string limits_text(const std::array<Limits, 3>& limits) {
  return fmt::format("--minimum {},{},{} --maximum {},{},{}", limits[0].low, limits[1].low,
                     limits[2].low, limits[0].high, limits[1].high, limits[2].high);
}

/// The function from values to colours, and the complete options that describe it.
struct Colours {
  ColourOf colour;
  ByteRounding rounding = ByteRounding::nearest;
  std::string options;
};

Colours choose_colours(const OperationCall& call, std::span<const PlanePtr> channels,
                       const Rgb& factors) {
  const ParameterSet& parameters = call.parameters;
  const std::string& method = parameters.text("method");
  const auto number = [&](const char* name) -> std::optional<double> {
    if (!parameters.has(name)) return std::nullopt;
    return parameters.number(name);
  };
  if (method == "lupton") {
    const LuptonTone tone =
        choose_lupton(finite_channels(channels),
                      {channel_values(call, "minimum"), channel_values(call, "scale"),
                       number("stretch"), number("q")},
                      call.threads, factors);
    return {tone, ByteRounding::down,
            fmt::format("--minimum {} --scale {} --stretch {} --q {}", fmt::join(tone.minimum, ","),
                        fmt::join(tone.scale, ","), tone.stretch, tone.q)};
  }
  if (method == "stiff") {
    const StiffTone tone = {channel_limits(call, channels),
                            number("gamma").value_or(default_display_gamma),
                            parameters.number("luminance_gamma"), parameters.number("saturation")};
    return {tone, ByteRounding::nearest, limits_text(tone.limits)};
  }
  if (method == "plain") {
    const PlainTone tone = {channel_limits(call, channels), number("gamma").value_or(1)};
    return {tone, ByteRounding::nearest, limits_text(tone.limits)};
  }
  const PictureTone tone = automatic_tone(channels, call.threads, {}, {}, factors);
  const PictureColours colours(tone,
                               {.brightness = parameters.number("brightness"),
                                .contrast = parameters.number("contrast"),
                                .saturation = parameters.number("saturation")},
                               static_cast<int>(channels.size()));
  return {[colours](const Rgb& rgb) { return colours.colour(rgb, {}); }, ByteRounding::nearest, ""};
}

PictureFileOptions picture_options(const OperationCall& call) {
  PictureFileOptions options;
  options.name = call.output;
  options.format = picture_format(call.output).value_or(PictureFormat::png);
  options.overwrite = call.overwrite;
  const bool has_bits = call.parameters.has("bits");
  if (has_bits && call.parameters.text("bits") == "8") options.bits = 8;
  if (has_bits && options.bits == 16 && options.format == PictureFormat::bmp) {
    throw InputError("gutil rgb: --bits 16: a BMP file has 8 bits a channel; use .png");
  }
  return options;
}

int make_rgb(const OperationCall& call) {
  check_method_options(call);
  PictureFileOptions options = picture_options(call);
  const std::vector<Source> sources = choose_sources(call, read_sources(call));
  check_sources(call, sources);
  check_picture_file(options, sources.front().plane->width(), sources.front().plane->height());
  std::vector<PlanePtr> planes;
  for (const Source& source : sources) planes.push_back(source.plane);
  const std::vector<double> wavelengths = sorting_wavelengths(call, sources);
  const bool is_auto = call.parameters.text("method") == "auto";
  if (!is_auto && !wavelengths.empty()) {
    std::vector<std::size_t> order(planes.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order,
                             [&](auto a, auto b) { return wavelengths[a] > wavelengths[b]; });
    std::transform(order.begin(), order.end(), planes.begin(),
                   [&](std::size_t i) { return sources[i].plane; });
  }
  const std::vector<PlanePtr> channels = is_auto ? picture_channels(planes, wavelengths) : planes;
  const Rgb factors =
      channel_factors(static_cast<int>(planes.size()), wavelengths, light_of_sources(sources));
  const Colours colours = choose_colours(call, channels, factors);
  options.comment = call.history;
  if (!colours.options.empty()) options.comment += "; " + colours.options;
  write_rgb(options, channels, colours.colour, colours.rounding, call.threads);
  return 0;
}

ParameterTable rgb_parameters() {
  constexpr double largest_q = 1e10;
  return {
      Parameter::choice("method", {"lupton", "stiff", "plain", "auto"}, "lupton",
                        "how values become colours"),
      Parameter::vector3("planes", "", Interval::at_least(1), std::nullopt,
                         "planes red,green,blue, from 1"),
      Parameter::choice("order", {"wavelength", "given"}, "wavelength",
                        "longest wavelength first, or the planes as given, red first"),
      Parameter::numbers("minimum", "unit of the pixels", Interval::any(), std::nullopt,
                         "value of black, one for all or red,green,blue (default: the sky)"),
      Parameter::numbers(
          "scale", "", Interval::positive(), std::nullopt,
          "lupton: factors of the channels, one for all or red,green,blue (default: chosen)"),
      Parameter::number("stretch", "unit of the pixels", Interval::positive(), std::nullopt,
                        "lupton: linear stretch (default: chosen)"),
      Parameter::number("q", "", Interval::left_open(0, largest_q), std::nullopt,
                        "lupton: asinh softening (default: chosen; with --stretch 8)"),
      Parameter::numbers("maximum", "unit of the pixels", Interval::any(), std::nullopt,
                         "stiff, plain: value of white, one for all or red,green,blue (default: "
                         "the 99.9 % percentile)"),
      Parameter::vector2("percentiles", "%", Interval::closed(0, 100), std::nullopt,
                         "stiff, plain: black and white of each channel instead"),
      Parameter::number("gamma", "", Interval::positive(), std::nullopt,
                        "stiff (default 2.2), plain (default 1): gamma of the display"),
      Parameter::number("luminance_gamma", "", Interval::positive(), 1.0,
                        "stiff: further gamma of the luminance alone"),
      Parameter::number("saturation", "", Interval::at_least(0), 1.0,
                        "stiff, auto: 0 is grey, 1 keeps the colours, larger values strengthen "
                        "them"),
      Parameter::number("brightness", "", PictureStyle::factors(), 1.0,
                        "auto: factor on the slope of the stretch; white stays white"),
      Parameter::number("contrast", "", PictureStyle::factors(), 1.0,
                        "auto: divides the slope of the stretch; the level 0.28 stays, and with "
                        "values above 1 the brightest parts become white"),
      Parameter::choice("bits", {"8", "16"}, std::nullopt,
                        "bits per channel of a PNG (default 16); a BMP has 8"),
  };
}

}  // namespace

Operation rgb_operation() {
  return {
      .name = "rgb",
      .summary = "Colour picture (PNG, BMP)",
      .description =
          "Red, green and blue are three files of one plane each, or the three planes of a file. "
          "--planes names other planes, counted from 1 over all files. One plane alone is grey. "
          "Variances (EXTNAME VARIANCE, ..._VARIANCE) are left out. If all planes have a "
          "wavelength (WAVELEN), the longest is red; otherwise, or with --order given, the first "
          "plane is red. The picture's top row is the image's last. Pixels that are missing in a "
          "channel are black.\nlupton (Lupton et al. 2004): c' = scale (c - minimum) becomes c' "
          "F(I)/I, with I = (r' + g' + b')/3 and F(I) = 0.1 asinh(Q I/stretch)/asinh(0.1 Q). Where "
          "the largest of the three is above 1, all are divided by it, so hue stays. --minimum 0 "
          "--scale 1 and 8 bits give the bytes of Astropy's make_lupton_rgb, except that Astropy "
          "sometimes rounds a saturated 255 to 254. Defaults are chosen from the image: minimum is "
          "the sky, scale balances the channels, stretch and Q show the outer disk and the "
          "nucleus. Where all planes have WAVELEN and MAGZERO, scale first makes their light that "
          "per unit wavelength.\nstiff (Bertin 2012): x = (c - minimum)/(maximum - minimum), Y = "
          "mean x, c' = (Y + saturation (x - Y)) Y^(1/luminance-gamma - 1), and the channel is "
          "c'^(1/gamma).\nplain: x^(1/gamma), each channel on its own.\nauto: any number of "
          "planes, as the renderer makes its pictures; --brightness, --contrast and --saturation "
          "are image.brightness, image.contrast and image.saturation of its parameters.\nThe PNG's "
          "text 'Comment' names the values that were used.",
      .least_inputs = 1,
      .most_inputs = 3,
      .result = Operation::Result::picture,
      .parameters = rgb_parameters(),
      .example = "rgb in.fits out.png",
      .run = make_rgb};
}

}  // namespace gamer
