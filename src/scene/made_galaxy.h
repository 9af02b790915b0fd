#pragma once

#include <string>

namespace gamer {

/// z0/rh of made disks. The relation of the disk's inclination with its aspect ratio holds for any;
/// thin disks have about this.
inline constexpr double made_disk_thickness = 0.1;

/// What a made galaxy's name says.
struct MadeGalaxy {
  double bulge_share = 0;   ///< of the light; the disk has the rest
  double bulge_radius = 0;  ///< effective, along the equator, galaxy radii
  double flattening = 1;    ///< c/a of the bulge
  double scale_length = 0;  ///< of the disk, galaxy radii
  std::string bulge_sed;
  std::string disk_sed;

  /// Numbers are rounded to six digits: galaxies of one shape share a type. What a part without
  /// light would be does not show.
  std::string name() const;
};

}  // namespace gamer
