#include "gamer/scene/galaxy_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "gamer/core/random.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/scene.h"
#include "gamer/sed/photometry.h"
#include "scene/row_overrides.h"
#include "scene/scene_row.h"

namespace gamer {

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

std::shared_ptr<const Galaxy> GalaxyLibrary::find(const std::string& type, const std::string& sed,
                                                  std::uint64_t seed, const SceneRow& row) {
  const auto known_type = smooth_.find({type, sed});
  const bool is_smooth = known_type != smooth_.end() && known_type->second;
  const auto known = galaxies_.find({type, sed, is_smooth ? 0 : seed});
  if (known != galaxies_.end()) return known->second;
  const std::shared_ptr<Galaxy> galaxy = make(type, sed, seed, row);
  unmeasured_.emplace(galaxy.get(), galaxy);
  add(type, sed, seed, galaxy);
  return galaxy;
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
    row.fail(column::galaxy,
             fmt::format("galaxy '{}' has no light that could have a half-light radius", type));
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
  const auto components = galaxy->components();
  const bool is_smooth = std::all_of(components.begin(), components.end(),
                                     [](const auto& c) { return !c->depends_on_seed(); });
  smooth_[{type, sed}] = is_smooth;
  references_.try_emplace(type, galaxy->reference());
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

std::shared_ptr<Galaxy> GalaxyLibrary::make(const std::string& type, const std::string& sed,
                                            std::uint64_t row_seed, const SceneRow& row) {
  const auto [file, overrides] = split_type(type);
  GalaxySettings settings = settings_;
  settings.seed = hash_words({seed_, row_seed});
  if (!sed.empty()) settings.sed = find_sed_of(sed, row);
  Resources::Text made;
  const Resources::Text* text = &made;
  try {
    if (const std::optional<std::string> content = made_galaxy(file)) {
      made = {"", file, *content};
    } else {
      text = &resources_.find("galaxies", file, label_, galaxy_suffixes());
    }
  } catch (const InputError& error) {
    throw InputError(row.where(column::galaxy), error.what());
  }
  settings.reference = references_[type];
  if (const auto own = overrides_.find(name_of_type(type)); own != overrides_.end()) {
    settings.overrides = own->second;
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
  std::shared_ptr<Galaxy> galaxy = Galaxy::read(text->content, text->label, settings, resources_);
  references_[type] = galaxy->reference();
  return galaxy;
}

}  // namespace gamer
