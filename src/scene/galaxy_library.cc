#include "gamer/scene/galaxy_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "galaxy/shape_text.h"
#include "gamer/core/random.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/scene.h"
#include "gamer/sed/photometry.h"
#include "scene/row_overrides.h"
#include "scene/scene_row.h"

namespace gamer {
namespace {

// Drafts are measured with the accuracy of this tolerance, over this many points of each component.
constexpr double draft_tolerance = 0.1;
constexpr std::size_t draft_points = std::size_t{1} << 13;

}  // namespace

const std::vector<std::string>& galaxy_suffixes() {
  static const std::vector<std::string> suffixes = {".toml"};
  return suffixes;
}

std::string name_of_type(const std::string& type) {
  std::string name = std::filesystem::path(split_type(type).name).filename().string();
  for (const std::string& suffix : galaxy_suffixes()) {
    if (name.ends_with(suffix)) name.resize(name.size() - suffix.size());
  }
  return name;
}

GalaxyLibrary::GalaxyLibrary(const RenderParameters& parameters, std::string label,
                             Resources& resources)
    : seed_(parameters.noise.seed), label_(std::move(label)), resources_(resources) {
  settings_.noise_kind = parameters.noise.kind;
  settings_.octaves = parameters.noise.octaves;
  settings_.accuracy = Accuracy::from_tolerance(parameters.sampling.tolerance);
  if (parameters.camera.supersample) keep_closures_apart();
  solo_ = parameters.scene.solo;
  for (const auto& [type, values] : parameters.scene.overrides.table()) {
    overrides_.emplace(type, std::make_shared<const ConfigNode>(values));
  }
}

void GalaxyLibrary::measure_as_draft() {
  is_draft_ = true;
  settings_.accuracy = Accuracy::from_tolerance(draft_tolerance);
  settings_.most_cloud_points = draft_points;
}

FootprintRange GalaxyLibrary::draft_footprints() {
  return {0, Accuracy::from_tolerance(draft_tolerance).widest_footprint};
}

RenderParameters GalaxyLibrary::draft_accuracy(RenderParameters parameters) {
  if (parameters.applies("sampling", "tolerance")) {
    parameters.set("sampling", "tolerance", draft_tolerance);
  }
  return parameters;
}

std::shared_ptr<const Galaxy> GalaxyLibrary::find(const std::string& type, const std::string& sed,
                                                  std::uint64_t seed, const SceneRow& row) {
  const auto known_type = smooth_.find({type, sed});
  const bool is_smooth = known_type != smooth_.end() && known_type->second;
  const auto known = galaxies_.find({type, sed, is_smooth ? 0 : seed});
  if (known != galaxies_.end()) return known->second;
  const Source source = source_of(type, sed, seed, row);
  if (reuses_ && !source.key.empty()) {
    if (auto found = measured_->find(source.key, resources_)) {
      reused_[found->galaxy.get()] = found->footprints;
      add_alone(type, sed, seed, found->galaxy);
      return found->galaxy;
    }
  }
  const std::shared_ptr<Galaxy> galaxy = make(type, source);
  unmeasured_.emplace(galaxy.get(), galaxy);
  add(type, sed, seed, galaxy);
  return galaxy;
}

bool GalaxyLibrary::suffices(const std::map<const Galaxy*, FootprintRange>& needed) {
  for (const auto& [galaxy, own] : needed) {
    const auto reused = reused_.find(galaxy);
    if (reused == reused_.end()) continue;
    const FootprintRange& known = reused->second;
    // Textures of galaxies of fixed flux have other scales.
    if (known.needs_light_means == own.needs_light_means && known.covers(own) &&
        (known.sees_whole || !own.sees_whole || known.narrowest == 0)) {
      continue;
    }
    reuses_ = false;
    reused_.clear();
    galaxies_.clear();
    unmeasured_.clear();
    smooth_.clear();
    references_.clear();
    profiles_.clear();
    origins_.clear();
    return false;
  }
  return true;
}

GalaxyLibrary::Keep GalaxyLibrary::keeper(std::span<const std::shared_ptr<Galaxy>> galaxies) const {
  if (measured_ == nullptr) return {};
  struct Kept {
    std::shared_ptr<const Galaxy> galaxy;
    Origin origin;
  };
  std::vector<Kept> all;
  for (const auto& galaxy : galaxies) {
    const auto origin = origins_.find(galaxy.get());
    all.push_back({galaxy, origin != origins_.end() ? origin->second : Origin()});
  }
  return [all = std::move(all), measured = measured_](std::span<const FootprintRange> footprints) {
    for (std::size_t g = 0; g < all.size(); ++g) {
      if (all[g].origin.key.empty()) continue;
      const FootprintRange range = footprints.empty() ? FootprintRange() : footprints[g];
      measured->add(all[g].origin.key,
                    {all[g].galaxy, range, all[g].origin.lookups, all[g].origin.label});
    }
  };
}

LightProfile GalaxyLibrary::light_profile(const std::string& type, const std::string& sed,
                                          std::uint64_t seed, double redshift, const Bandpass* band,
                                          const SceneRow& row) {
  TypeProfile& known = profiles_[{type, sed}];
  if (known.galaxy == nullptr) {
    known.galaxy = find(type, sed, seed, row);
    for (const auto& component : known.galaxy->components()) {
      known.components.emplace_back(*component);
    }
  }
  std::vector<double> light;
  for (std::size_t c = 0; c < known.components.size(); ++c) {
    const Sed* spectrum = known.galaxy->components()[c]->sed();
    const double flux = spectrum == nullptr                  ? 0.0
                        : band == nullptr                    ? 1.0
                        : covers(*spectrum, *band, redshift) ? band_flux(*spectrum, *band, redshift)
                                                             : 0.0;
    light.push_back(flux * known.galaxy->luminosity(c));
  }
  if (std::ranges::none_of(light, [](double value) { return value > 0; })) {
    row.fail(column::galaxy, "galaxy '{}' has no light that could have a half-light radius", type);
  }
  return LightProfile(known.components, light, known.galaxy->axis());
}

std::vector<std::shared_ptr<Galaxy>> GalaxyLibrary::take_unmeasured(const Scene& scene) {
  std::vector<std::shared_ptr<Galaxy>> galaxies;
  for (const PlacedGalaxy& placed : scene.galaxies) {
    if (auto found = unmeasured_.extract(placed.galaxy.get())) {
      galaxies.push_back(std::move(found.mapped()));
    }
  }
  return galaxies;
}

void GalaxyLibrary::add(const std::string& type, const std::string& sed, std::uint64_t seed,
                        std::shared_ptr<const Galaxy> galaxy) {
  references_.try_emplace(type, galaxy->reference());
  add_alone(type, sed, seed, std::move(galaxy));
}

void GalaxyLibrary::add_alone(const std::string& type, const std::string& sed, std::uint64_t seed,
                              std::shared_ptr<const Galaxy> galaxy) {
  const auto components = galaxy->components();
  const bool is_smooth =
      std::ranges::all_of(components, [](const auto& c) { return !c->depends_on_seed(); });
  smooth_[{type, sed}] = is_smooth;
  galaxies_.try_emplace({type, sed, is_smooth ? 0 : seed}, std::move(galaxy));
}

std::shared_ptr<const Sed> GalaxyLibrary::find_sed_of(const std::string& name,
                                                      const SceneRow& row) {
  std::shared_ptr<const Sed>& known = seds_[name];
  if (known == nullptr) {
    try {
      known = find_sed(name, label_, resources_);
    } catch (const InputError& error) {
      throw InputError(row.where(column::sed), error.what());
    }
  }
  return known;
}

namespace {

/// Logs lookups while it lives.
class LookupLog {
 public:
  LookupLog(Resources& resources, std::vector<Resources::Lookup>* list) : resources_(resources) {
    resources_.log_lookups(list);
  }
  ~LookupLog() { resources_.log_lookups(nullptr); }
  LookupLog& operator=(LookupLog&&) = delete;

 private:
  Resources& resources_;
};

/// All that decides a galaxy except the files that it names: text and place of its own file,
/// overrides and settings. Empty where the overrides cannot be written.
std::string key_of(const Resources::Text& text, const GalaxySettings& settings) {
  std::string key = measure_key(settings);
  try {
    if (settings.overrides != nullptr) {
      for (const std::string& one : assignments(*settings.overrides)) key += one + '\n';
    }
  } catch (const InputError&) {
    return "";
  }
  return key + '\n' + text.label + '\n' + text.content.str();
}

}  // namespace

GalaxyLibrary::Source GalaxyLibrary::source_of(const std::string& type, const std::string& sed,
                                               std::uint64_t row_seed, const SceneRow& row) {
  const auto [file, overrides] = split_type(type);
  Source source{{}, settings_, ""};
  GalaxySettings& settings = source.settings;
  settings.seed = hash_words({seed_, row_seed});
  if (!sed.empty()) settings.sed = find_sed_of(sed, row);
  try {
    if (const std::optional<std::string> content = made_galaxy(file)) {
      source.text = {"", file, *content};
    } else {
      source.text = resources_.find("galaxies", file, label_, galaxy_suffixes());
    }
  } catch (const InputError& error) {
    throw InputError(row.where(column::galaxy), error.what());
  }
  if (const auto found = overrides_.find(name_of_type(type)); found != overrides_.end()) {
    settings.overrides = found->second;
  }
  if (!overrides.empty()) {
    ConfigNode all = settings.overrides ? *settings.overrides : ConfigNode();
    add_overrides(overrides, row.where(column::overrides), all);
    settings.overrides = std::make_shared<const ConfigNode>(std::move(all));
  }
  if (!solo_.empty()) {
    ConfigNode all = settings.overrides ? *settings.overrides : ConfigNode();
    set_from_text(all, "galaxy.solo=" + toml_string(solo_), type + ".");
    settings.overrides = std::make_shared<const ConfigNode>(std::move(all));
  }
  // A row's SED is no part of the key.
  if (measured_ != nullptr && sed.empty()) source.key = key_of(source.text, settings);
  return source;
}

const ConfigNode& GalaxyLibrary::parsed(const Resources::Text& text) {
  const auto found = parsed_.find(text.label);
  if (found != parsed_.end() && found->second.content == text.content) return found->second.root;
  ConfigNode root = parse_toml(text.content, text.label);
  return (parsed_[text.label] = {text.content, std::move(root)}).root;
}

std::shared_ptr<Galaxy> GalaxyLibrary::make(const std::string& type, const Source& source) {
  GalaxySettings settings = source.settings;
  settings.reference = references_[type];
  const auto [twin, is_first] = twins_.try_emplace(type);
  if (is_first && measured_ != nullptr) twin->second = measured_->latest(source.text.label);
  settings.twin = twin->second;
  Origin origin{source.key, source.text.label, {}};
  const std::shared_ptr<Galaxy> galaxy = [&] {
    const LookupLog log(resources_, source.key.empty() ? nullptr : &origin.lookups);
    return Galaxy::read(parsed(source.text), settings, resources_);
  }();
  references_[type] = galaxy->reference();
  if (is_first) twin->second = galaxy;
  if (!source.key.empty()) origins_[galaxy.get()] = std::move(origin);
  return galaxy;
}

}  // namespace gamer
