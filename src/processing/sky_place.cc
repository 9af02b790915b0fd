#include "processing/sky_place.h"

#include <cmath>
#include <optional>
#include <string_view>

#include "core/sexagesimal.h"
#include "gamer/core/near.h"
#include "processing/plane_operation.h"

namespace gamer {
namespace {

constexpr double largest_ra = 360, largest_dec = 90;  // deg
constexpr double degrees_per_hour = 15;

}  // namespace

SkyPosition parse_sky_position(const std::string& text) {
  const std::size_t comma = text.find(',');
  const std::string_view all = text;
  const auto ra = parse_angle(all.substr(0, comma), degrees_per_hour);
  const auto dec =
      comma == std::string::npos ? std::nullopt : parse_angle(all.substr(comma + 1), 1);
  if (!ra || !dec) {
    throw input_error(
        "{}: expected RA,DEC in degrees (150.1,2.2), or in hours and degrees with colons "
        "(10:00:24,+2:12:00)",
        in_quotes(text));
  }
  if (std::abs(*ra) > largest_ra || std::abs(*dec) > largest_dec) {
    throw input_error(
        "{}: RA {:g} deg and Dec {:g} deg; RA is within [-360, 360], Dec within [-90, 90]",
        in_quotes(text), *ra, *dec);
  }
  return {*ra, *dec};
}

SkyPosition sky_position(const OperationCall& call) {
  try {
    return parse_sky_position(call.parameters.text("position"));
  } catch (const InputError& error) {
    throw wrong(call, "--position {}", error.what());
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
  if (!pixel) throw input_error("{} has no pixel in {}", what, label);
  constexpr double first_side = 0.5;
  const bool is_inside = pixel->x >= first_side && pixel->x <= width + first_side &&
                         pixel->y >= first_side && pixel->y <= height + first_side;
  if (!is_inside) {
    throw input_error("{} is at pixel {:.6g},{:.6g}, outside {}, which has {} x {} pixels", what,
                      pixel->x, pixel->y, label, width, height);
  }
  return *pixel;
}

}  // namespace gamer
