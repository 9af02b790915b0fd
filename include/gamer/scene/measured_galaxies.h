#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// Galaxies that earlier scenes made and measured, so that a scene with equal ones need not even
/// make them. A galaxy is known by a key, which is all that decides it but for the files that it
/// names. These are looked up anew, and must be equal. Several threads may use it.
class MeasuredGalaxies {
 public:
  struct Entry {
    std::shared_ptr<const Galaxy> galaxy;
    FootprintRange footprints;               ///< for which it is measured
    std::vector<Resources::Lookup> lookups;  ///< the files that it names
  };

  /// A scene begins. Galaxies that none of the last eight scenes used are forgotten.
  void begin_scene();
  /// The galaxy of this key, whose files are then in use in `resources` too. Nothing where there is
  /// none, or a file has changed.
  std::optional<Entry> find(const std::string& key, Resources& resources);
  void add(const std::string& key, Entry entry);

 private:
  struct Used {
    Entry entry;
    std::uint64_t scene = 0;  ///< the last that used it
  };
  std::mutex mutex_;
  std::uint64_t scene_ = 0;
  std::map<std::string, Used> galaxies_;
};

}  // namespace gamer
