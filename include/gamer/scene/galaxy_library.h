#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/scene/render_parameters.h"

namespace gamer {

struct Scene;
class SceneRow;

/// The galaxies of scenes, each made once per type, SED and seed. It may outlive a scene: the
/// frames of an animation, whose cameras differ but whose noise and tolerance do not, share one.
/// Not for several threads at a time.
class GalaxyLibrary {
 public:
  /// `label` is the catalogue's, beside which names are looked up. `resources` must outlive this.
  GalaxyLibrary(const RenderParameters& parameters, std::string label, Resources& resources);

  /// Galaxies that are made from now on have closures of their own at every tolerance
  /// (Accuracy::shares_closure).
  void keep_closures_apart() { settings_.accuracy.shares_closure = false; }

  /// Not measured when it is made. Throws InputError, with the row's place where a name of it is
  /// unknown.
  std::shared_ptr<const Galaxy> find(const std::string& type, const std::string& sed,
                                     std::uint64_t seed, const SceneRow& row);
  /// An SED that a row names.
  std::shared_ptr<const Sed> find_sed_of(const std::string& name, const SceneRow& row);

  /// Galaxies of a scene, in its order, that GalaxyStatistics has to measure before they are
  /// evaluated. Later calls leave them out.
  std::vector<std::shared_ptr<Galaxy>> take_unmeasured(const Scene& scene);

  /// Takes in a galaxy that was made by another library with the same parameters and texts.
  void add(const std::string& type, const std::string& sed, std::uint64_t seed,
           std::shared_ptr<const Galaxy> galaxy);

 private:
  std::shared_ptr<Galaxy> make(const std::string& type, const std::string& sed,
                               std::uint64_t row_seed, const SceneRow& row);

  GalaxySettings settings_;  ///< without those of a row
  std::uint64_t seed_;
  std::string label_;
  Resources& resources_;
  std::map<std::tuple<std::string, std::string, std::uint64_t>, std::shared_ptr<const Galaxy>>
      galaxies_;
  std::map<const Galaxy*, std::shared_ptr<Galaxy>> unmeasured_;
  /// Whether all seeds are the same: without noise.
  std::map<std::pair<std::string, std::string>, bool> smooth_;
  std::map<std::string, std::shared_ptr<Galaxy>> references_;  ///< of types; null where not needed
  std::map<std::string, std::shared_ptr<const Sed>> seds_;
};

}  // namespace gamer
