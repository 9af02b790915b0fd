#include "gamer/scene/stamp_settings.h"

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double largest_side = 1e5;

void check_side(const ParameterSet& values, std::string_view key) {
  if (!values.has(key) || values.integer(key) % 2 == 1) return;
  throw input_error(
      values.where(key),
      "{} = {}: a stamp has an odd number of pixels on a side, so that one is its middle", key,
      values.integer(key));
}

BoundTable stamp_keys(StampSettings& p) {
  return {{p.size, "size", "pixels", Interval::closed(1, largest_side),
           "width and height of every stamp, odd; by default its object decides them"},
          {p.extent, "extent", "", Interval::positive(),
           "half the side of a galaxy's stamp, in units of its radius"},
          choice(p.radius, "radius",
                 {{"ball", StampSettings::Radius::ball},
                  {"half_light", StampSettings::Radius::half_light}},
                 "which radius: that of the ball that holds the galaxy, or the half-light "
                 "radius along its major axis, without noise and dust"),
          {p.smallest, "smallest", "pixels", Interval::closed(1, largest_side),
           "least side, odd, of a stamp whose object decides its size; the side of a star's stamp"},
          {p.largest, "largest", "pixels", Interval::closed(1, largest_side),
           "greatest side, odd, of a stamp whose object decides its size"}};
}

}  // namespace

ParameterSection StampSettings::section() {
  return {"stamps", "Sizes of the stamps of `image.layout = \"stamps\"` (`--stamps`).",
          declarations(stamp_keys)};
}

StampSettings StampSettings::read(const ParameterSet& values) {
  for (const char* key : {"size", "smallest", "largest"}) check_side(values, key);
  StampSettings result = read_object(values, stamp_keys);
  if (result.smallest > result.largest) {
    throw input_error(place_of(values, {"smallest", "largest"}),
                      "smallest = {} is above largest = {}", result.smallest, result.largest);
  }
  return result;
}

}  // namespace gamer
