#pragma once

#include <optional>

#include "gamer/scene/parameter_section.h"

namespace gamer {

/// Section [stamps]: the size of the stamps of image.layout = "stamps".
struct StampSettings {
  static ParameterSection section();
  /// Throws InputError for sizes that are even or in the wrong order.
  static StampSettings read(const ParameterSet& values);

  enum class Radius { ball, half_light };
  std::optional<int> size;            ///< pixels on a side of every stamp; none: `extent` decides
  double extent = 1;                  ///< half a side over the object's radius
  Radius radius = Radius::ball;       ///< the radius that counts
  int smallest = 15, largest = 1001;  ///< pixels on a side, where the extent decides
};

}  // namespace gamer
