#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/galaxy/light_profile.h"
#include "gamer/scene/measured_galaxies.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/sed/bandpass.h"

namespace gamer {

struct Scene;
class SceneRow;

/// The name of a type in scene.overrides: the name of its file, without folder and suffix.
std::string name_of_type(const std::string& type);

/// Suffixes of files in `galaxies/`.
const std::vector<std::string>& galaxy_suffixes();

/// The galaxies of scenes, each made once per type, SED and seed. A library may outlive a scene.
/// Frames of an animation share a library, since they differ in the camera, but not in noise and
/// tolerance. One thread at a time may use a library.
class GalaxyLibrary {
 public:
  /// `label` is the catalogue's; names are looked up beside it. `resources` must outlive the
  /// library.
  GalaxyLibrary(const RenderParameters& parameters, std::string label, Resources& resources);

  /// Galaxies made after this call have closures of their own at every tolerance
  /// (Accuracy::shares_closure is false).
  void keep_closures_apart() { settings_.accuracy.shares_closure = false; }

  /// Galaxies made after this call are measured over few points, and in the same way for every
  /// camera and tolerance. The light of a component then has an error of a few per cent.
  void measure_as_draft();
  bool measures_as_draft() const { return is_draft_; }
  /// The footprints for which drafts are measured. Wider footprints occur only at higher
  /// tolerances.
  static FootprintRange draft_footprints();
  /// The given parameters, with the tolerance at which drafts are measured.
  static RenderParameters draft_accuracy(RenderParameters parameters);

  /// Makes later calls take galaxies that earlier scenes measured from this store.
  void reuse(std::shared_ptr<MeasuredGalaxies> measured) { measured_ = std::move(measured); }
  /// Whether all galaxies that were taken are measured for the footprints that a scene needs. If
  /// not, the library forgets all its galaxies and takes no more from the store. The scene must
  /// then be read again.
  bool suffices(const std::map<const Galaxy*, FootprintRange>& needed);
  /// A function that keeps these galaxies for later scenes. Its argument gives the footprints for
  /// which each was measured. Empty without reuse().
  using Keep = std::function<void(std::span<const FootprintRange> footprints)>;
  Keep keeper(std::span<const std::shared_ptr<Galaxy>> galaxies) const;

  /// The galaxy of a row, made if need be, but not yet measured. Throws InputError with the row's
  /// place where the row names something unknown.
  std::shared_ptr<const Galaxy> find(const std::string& type, const std::string& sed,
                                     std::uint64_t seed, const SceneRow& row);
  /// The distribution of light of a row's galaxy in a band at a redshift, or at 5500 Angstrom if
  /// the band is null. It does not depend on the seed. Throws InputError where the galaxy has no
  /// light there.
  LightProfile light_profile(const std::string& type, const std::string& sed, std::uint64_t seed,
                             double redshift, const Bandpass* band, const SceneRow& row);
  /// The SED that a row names. Throws InputError with the row's place if there is none.
  std::shared_ptr<const Sed> find_sed_of(const std::string& name, const SceneRow& row);

  /// Galaxies of a scene, in its order, that GalaxyStatistics has to measure before they are
  /// evaluated. Later calls do not return them again.
  std::vector<std::shared_ptr<Galaxy>> take_unmeasured(const Scene& scene);

  /// Adds a galaxy made by another library with the same parameters and texts.
  void add(const std::string& type, const std::string& sed, std::uint64_t seed,
           std::shared_ptr<const Galaxy> galaxy);

 private:
  /// The text and the settings from which a row's galaxy is made.
  struct Source {
    Resources::Text text;
    GalaxySettings settings;
    std::string key;  ///< in MeasuredGalaxies; empty for none
  };
  Source source_of(const std::string& type, const std::string& sed, std::uint64_t row_seed,
                   const SceneRow& row);
  std::shared_ptr<Galaxy> make(const std::string& type, const Source& source);
  /// The content of a galaxy's file. Each text is parsed once.
  const ConfigNode& parsed(const Resources::Text& text);
  /// Adds a galaxy without making its reference that of later galaxies.
  void add_alone(const std::string& type, const std::string& sed, std::uint64_t seed,
                 std::shared_ptr<const Galaxy> galaxy);

  GalaxySettings settings_;  ///< settings that all rows share
  bool is_draft_ = false;
  /// SceneSettings::overrides, by type.
  std::map<std::string, std::shared_ptr<const ConfigNode>> overrides_;
  std::uint64_t seed_;
  std::string solo_;  ///< `scene.solo`
  std::string label_;
  Resources& resources_;
  struct Parsed {
    std::string content;
    ConfigNode root;
  };
  std::map<std::string, Parsed> parsed_;  ///< by label
  std::map<std::tuple<std::string, std::string, std::uint64_t>, std::shared_ptr<const Galaxy>>
      galaxies_;
  std::map<const Galaxy*, std::shared_ptr<Galaxy>> unmeasured_;
  std::shared_ptr<MeasuredGalaxies> measured_;
  bool reuses_ = true;  ///< whether galaxies are taken from measured_
  std::map<const Galaxy*, FootprintRange> reused_;
  /// Keys and files of galaxies that may be kept.
  struct Origin {
    std::string key;
    std::string label;
    std::vector<Resources::Lookup> lookups;
  };
  std::map<const Galaxy*, Origin> origins_;
  /// Whether a type and SED have no noise, so that all seeds make one galaxy.
  std::map<std::pair<std::string, std::string>, bool> smooth_;
  std::map<std::string, std::shared_ptr<Galaxy>> references_;  ///< by type; null where not needed
  /// The first galaxy of each type.
  std::map<std::string, std::shared_ptr<const Galaxy>> twins_;
  std::map<std::string, std::shared_ptr<const Sed>> seds_;
  /// The components of a type, with the galaxy that they were measured on.
  struct TypeProfile {
    std::shared_ptr<const Galaxy> galaxy;
    std::vector<ComponentProfile> components;
  };
  std::map<std::pair<std::string, std::string>, TypeProfile> profiles_;
};

}  // namespace gamer
