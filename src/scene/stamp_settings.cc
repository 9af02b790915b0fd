#include "gamer/scene/stamp_settings.h"

#include "core/message.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double largest_side = 1e5;

/// The number of pixels on a side that a key gives.
int side(const ParameterSet& values, std::string_view key) {
  const std::int64_t pixels = values.integer(key);
  if (pixels % 2 == 1) return static_cast<int>(pixels);
  throw input_error(
      values.where(key),
      "{} = {}: a stamp has an odd number of pixels on a side, so that one is its middle", key,
      pixels);
}

}  // namespace

ParameterSection StampSettings::section() {
  const StampSettings usual;
  return {
      "stamps",
      "Sizes of the stamps of `image.layout = \"stamps\"` (`--stamps`).",
      {Parameter::integer("size", "pixels", Interval::closed(1, largest_side), std::nullopt,
                          "width and height of every stamp, odd; by default the extent decides"),
       Parameter::number("extent", "", Interval::positive(), usual.extent,
                         "half the side of a galaxy's stamp, in units of its radius"),
       Parameter::choice("radius", {"ball", "half_light"}, "ball",
                         "which radius: that of the ball that holds the galaxy, or the half-light "
                         "radius along its major axis, without noise and dust"),
       Parameter::integer("smallest", "pixels", Interval::closed(1, largest_side), usual.smallest,
                          "least side where the extent decides, odd; that of stars"),
       Parameter::integer("largest", "pixels", Interval::closed(1, largest_side), usual.largest,
                          "greatest side where the extent decides, odd")},
      {}};
}

StampSettings StampSettings::read(const ParameterSet& values) {
  StampSettings result;
  if (values.has("size")) result.size = side(values, "size");
  result.extent = values.number("extent");
  result.radius = values.text("radius") == "half_light" ? Radius::half_light : Radius::ball;
  result.smallest = side(values, "smallest");
  result.largest = side(values, "largest");
  if (result.smallest > result.largest) {
    throw input_error(place_of(values, {"smallest", "largest"}),
                      "smallest = {} is above largest = {}", result.smallest, result.largest);
  }
  return result;
}

}  // namespace gamer
