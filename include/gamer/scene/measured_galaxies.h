#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// A store of galaxies that earlier scenes made and measured, for scenes with equal galaxies. A
/// key holds all that decides a galaxy, except the contents of the files that it names. These files
/// are looked up again, and must be equal. Several threads may use a store.
class MeasuredGalaxies {
 public:
  struct Entry {
    std::shared_ptr<const Galaxy> galaxy;
    FootprintRange footprints;               ///< footprints for which it is measured
    std::vector<Resources::Lookup> lookups;  ///< the files that it names
    std::string label;                       ///< of its own file
  };

  /// Begins a scene. Galaxies that none of the last eight scenes used are forgotten.
  void begin_scene();
  /// The galaxy of this key; `resources` then records its files, too. Nothing if there is no such
  /// galaxy or a file has changed.
  std::optional<Entry> find(const std::string& key, Resources& resources);
  /// The galaxy that was last added from a file of this label; null if there is none. It is the
  /// twin of a galaxy of the edited file.
  std::shared_ptr<const Galaxy> latest(const std::string& label);
  void add(const std::string& key, Entry entry);

 private:
  struct Used {
    Entry entry;
    std::uint64_t scene = 0;   ///< number of the last scene that used it
    std::uint64_t number = 0;  ///< number of its addition, from 1
  };
  std::mutex mutex_;
  std::uint64_t scene_ = 0, added_ = 0;
  std::map<std::string, Used> galaxies_;
};

}  // namespace gamer
