#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "processing/disk_breaks.h"
#include "processing/isophotes.h"

namespace gamer {

/// The profile of one plane, for the plot.
struct ProfileCurve {
  std::string label;
  std::vector<Isophote> isophotes;
  std::vector<double> magnitudes;  ///< surface brightness; NaN where there is none
  std::optional<DiskFit> disk;
  double zero_point = 0;  ///< magnitude of one unit of brightness
};

/// Writes a PNG picture of profiles against the semi-major axis: surface brightness with the fitted
/// disks, and ellipticity and position angle (deg, `angles`) of the first curve. `unit` is that of
/// the magnitudes. The file is complete or absent. Throws RunError.
void write_profile_plot(const std::filesystem::path& path, const std::vector<ProfileCurve>& curves,
                        const std::vector<double>& angles, const std::string& unit, bool overwrite);

}  // namespace gamer
