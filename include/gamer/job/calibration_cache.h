#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// Measured parts of a galaxy (GalaxyStatistics) by name.
using CalibrationParts = std::map<std::string, std::vector<double>>;

/// The parts as bytes with a check sum.
std::string pack_parts(const CalibrationParts& parts);
/// The parts in bytes of pack_parts(); none where the check sum is wrong.
CalibrationParts unpack_parts(std::string_view bytes);

/// Measured parts in files, one for each shape of a galaxy (Galaxy::shape()), so that a later
/// process need not measure them again.
///
/// Files belong to a build and an instruction set (build_identity()), so that images have equal
/// bits with any state of the cache. A file is replaced as a whole. Any number of processes may use
/// a folder. Where two processes add parts at the same time, some parts may be lost. Damaged files
/// count as absent, and failures to write are ignored. The cache holds at most most_files files and
/// removes those unused for longest.
class CalibrationCache {
 public:
  /// `identity` must not be empty.
  CalibrationCache(const std::filesystem::path& folder, std::string identity);

  /// The cache of build_identity() in the folder named by GAMER_CACHE, else in
  /// $XDG_CACHE_HOME/gamer, else in ~/.cache/gamer. The result is null if GAMER_CACHE is "off", or
  /// if there is no folder or identity.
  static std::unique_ptr<CalibrationCache> of_user();

  CalibrationParts load(const std::string& shape) const;
  void save(const std::string& shape, const CalibrationParts& parts) const;

  /// The folder of this build's files.
  const std::filesystem::path& folder() const { return folder_; }

  /// The number of files that the cache holds at most.
  static constexpr std::size_t most_files = 4096;

 private:
  std::filesystem::path file_of(const std::string& shape) const;

  std::string identity_;
  std::filesystem::path folder_;
};

/// The cache that measure_galaxies() uses; null at first.
const CalibrationCache* calibration_cache();
/// Sets this cache. No measurement may run during this call.
void use_calibration_cache(std::unique_ptr<const CalibrationCache> cache);

}  // namespace gamer
