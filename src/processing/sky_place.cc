#include "processing/sky_place.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "gamer/core/error.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

constexpr double full_circle = 360, pole = 90;  // deg
constexpr double degrees_per_hour = 15;

std::optional<double> plain_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole_text = error == std::errc() && end == text.data() + text.size();
  if (!is_whole_text || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// An angle in degrees. With colons its first part counts units of `unit` degrees.
std::optional<double> angle(std::string_view text, double unit) {
  const bool is_negative = text.starts_with('-');
  if (is_negative || text.starts_with('+')) text.remove_prefix(1);
  // A second sign is none of the format.
  if (text.starts_with('-') || text.starts_with('+')) return std::nullopt;
  const double sign = is_negative ? -1 : 1;
  if (text.find(':') == std::string_view::npos) {
    const auto degrees = plain_number(text);
    if (!degrees) return std::nullopt;
    return sign * *degrees;
  }
  constexpr double sixty = 60;
  constexpr std::array<double, 3> sizes = {1, sixty, sixty * sixty};
  double sum = 0;
  for (std::size_t part = 0; part < sizes.size(); ++part) {
    const std::size_t colon = text.find(':');
    const auto value = plain_number(text.substr(0, colon));
    const bool is_last = colon == std::string_view::npos;
    const bool fits = value && *value >= 0 && (part == 0 || *value < sixty) &&
                      (is_last || *value == std::floor(*value));
    if (!fits || (is_last && part == 0)) return std::nullopt;
    sum += *value / sizes[part];
    if (is_last) return sign * unit * sum;
    text.remove_prefix(colon + 1);
  }
  return std::nullopt;
}

}  // namespace

SkyPosition parse_sky_position(const std::string& text) {
  const std::size_t comma = text.find(',');
  const std::string_view all = text;
  const auto ra = angle(all.substr(0, comma), degrees_per_hour);
  const auto dec = comma == std::string::npos ? std::nullopt : angle(all.substr(comma + 1), 1);
  if (!ra || !dec) {
    throw InputError(fmt::format(
        "{}: expected RA,DEC in degrees (150.1,2.2), or in hours and degrees with colons "
        "(10:00:24,+2:12:00)",
        in_quotes(text)));
  }
  if (std::abs(*ra) > full_circle || std::abs(*dec) > pole) {
    throw InputError(
        fmt::format("{}: RA {:g} deg and Dec {:g} deg; RA is within [-360, 360], Dec "
                    "within [-90, 90]",
                    in_quotes(text), *ra, *dec));
  }
  return {*ra, *dec};
}

SkyPosition sky_position(const OperationCall& call) {
  try {
    return parse_sky_position(call.parameters.text("position"));
  } catch (const InputError& error) {
    throw InputError(fmt::format("gutil {}: --position {}", call.operation, error.what()));
  }
}

Parameter position_parameter(const char* description) {
  Parameter parameter = Parameter::text("position", std::nullopt, description);
  parameter.unit = "deg";
  return parameter;
}

PixelPosition pixel_within(const OperationCall& call, const CelestialWcs& wcs,
                           const SkyPosition& sky, int width, int height,
                           const std::string& label) {
  const std::string what =
      fmt::format("gutil {}: --position {}", call.operation, call.parameters.text("position"));
  const auto pixel = wcs.pixel(sky);
  if (!pixel) throw InputError(fmt::format("{} has no pixel in {}", what, label));
  constexpr double first_side = 0.5;
  const bool is_inside = pixel->x >= first_side && pixel->x <= width + first_side &&
                         pixel->y >= first_side && pixel->y <= height + first_side;
  if (!is_inside) {
    throw InputError(
        fmt::format("{} is at pixel {:.6g},{:.6g}, outside {}, which has {} x {} "
                    "pixels",
                    what, pixel->x, pixel->y, label, width, height));
  }
  return *pixel;
}

}  // namespace gamer
