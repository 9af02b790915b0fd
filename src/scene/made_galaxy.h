#pragma once

#include <optional>
#include <string>

namespace gamer {

/// z0/rh of made disks, a typical value of thin disks. The relation between a disk's inclination
/// and its aspect ratio holds for any value.
inline constexpr double made_disk_thickness = 0.1;

/// The parameters in a made galaxy's name.
struct MadeGalaxy {
  double bulge_share = 0;   ///< share of the light; the rest is the disk's
  double bulge_radius = 0;  ///< effective radius along the equator, galaxy radii
  double flattening = 1;    ///< c/a of the bulge
  double scale_length = 0;  ///< of the disk, galaxy radii
  std::string bulge_sed;
  std::string disk_sed;

  /// The name, with numbers rounded to six digits so that galaxies of one shape share a type. The
  /// shape of a part without light does not enter it.
  std::string name() const;
};

/// Sersic's index of the ready galaxies `exponential` (1) and `devaucouleurs` (4), and of `sersic`
/// where a row gives it; none for other names.
std::optional<double> sersic_index_of(const std::string& galaxy, std::optional<double> index);
/// The name of a made galaxy of one Sersic spheroid with this index and c/a, rounded to six digits.
std::string sersic_galaxy(double index, double flattening);
/// The name of a made galaxy of two Sersic spheroids with one c/a. One is a bulge with this share
/// of the light and this index, the other an exponential disk. `ratio` is the bulge's effective
/// radius over that of the disk. Numbers are rounded to six digits.
std::string bulge_and_disk(double share, double index, double ratio, double flattening);

}  // namespace gamer
