#pragma once

#include <string>
#include <vector>

#include "gamer/core/resources.h"

namespace gamer {

/// A picture of one galaxy without parameter file and scene list.
struct Look {
  std::string galaxy;          ///< a type's name or its file
  double inclination = 35;     ///< deg
  double position_angle = 30;  ///< deg
};

/// Records a parameter file and a scene list for `look`. The galaxy fills a picture of 640 x 640
/// pixels, NAME.png, at tolerance 1e-2. Its colours are blue, green, and red with H alpha, unless
/// `settings` ("section.key=value") give bands or wavelengths. Throws InputError for a name that no
/// scene list can hold.
void add_look(const Look& look, const std::vector<std::string>& settings, Resources& resources);

}  // namespace gamer
