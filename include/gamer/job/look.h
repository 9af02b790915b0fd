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
  bool has_sky = false;        ///< whether stars and faint galaxies surround it
  bool has_seeing = true;      ///< whether points have a width; always with a sky
};

/// Records a parameter file and a scene list for `look`. The galaxy fills a picture of 640 x 640
/// pixels, NAME.png, at tolerance 1e-2. Its colours are blue, green, and red with H alpha, unless
/// `settings` ("section.key=value") give bands or wavelengths.
///
/// With a sky the galaxy is 10 Mpc away. Its ball has a radius of 200 arcsec, and its magnitude in
/// the red plane is 9.5. Its name chooses the stars and faint galaxies (background_list()). The
/// ball's diameter is the picture's shorter side, unless the settings give the scale of the pixels.
///
/// Throws InputError for a name that no scene list can hold. With a sky other errors are settings
/// that choose one component or another projection, wrong settings, and a view of too many objects.
void add_look(const Look& look, const std::vector<std::string>& settings, Resources& resources);

}  // namespace gamer
