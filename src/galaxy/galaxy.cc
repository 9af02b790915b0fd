#include "gamer/galaxy/galaxy.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "core/message.h"
#include "galaxy/galaxy_overrides.h"
#include "galaxy/shape_text.h"
#include "gamer/core/near.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"
#include "gamer/galaxy/kinds/star_field.h"

namespace gamer {

namespace {

constexpr std::size_t most_components = 64;

// Smallest stretch of the ball that single precision resolves.
constexpr double smallest_stretch = 1e-9;

// The seed of shared references, an arbitrary fixed number.
constexpr std::uint64_t reference_seed = 0x7265666572656e63;

void check_sections(const ConfigNode& root) {
  static const std::vector<std::string> sections = {"galaxy", "arms", "arm", "component"};
  for (const auto& [key, node] : root.table()) {
    if (std::ranges::find(sections, key) == sections.end()) {
      throw InputError(node.key_where,
                       "unknown section '" + key + "' in a galaxy" + did_you_mean(key, sections));
    }
  }
}

const ConfigNode::Array& component_list(const ConfigNode& root) {
  const ConfigNode* list = root.find("component");
  if (list == nullptr) throw InputError(root.where, "a galaxy needs at least one [[component]]");
  if (!list->is_array()) {
    throw InputError(list->key_where, "write [[component]], with double brackets");
  }
  if (list->array().size() > most_components) {
    throw InputError(list->key_where,
                     "at most " + std::to_string(most_components) + " components fit a galaxy");
  }
  return list->array();
}

}  // namespace

ParameterTable Galaxy::table() {
  return {
      Parameter::text("name", std::string(), "title of the galaxy in lists and pages"),
      Parameter::text("description", std::string(), "one line about the galaxy, for lists"),
      Parameter::vector3("axis", "", Interval::left_open(0, 10).usual(0.2, 2),
                         std::vector<double>{1, 1, 1}, "stretch of the whole galaxy along x, y, z"),
      Parameter::text("solo", std::string(),
                      "name of the only component that is seen, with its share of the whole "
                      "galaxy's light; dust is hidden"),
  };
}

std::shared_ptr<const Galaxy> Galaxy::parse(std::string_view text, const std::string& label,
                                            const GalaxySettings& settings, Resources& resources) {
  const std::shared_ptr<Galaxy> galaxy = read(parse_toml(text, label), settings, resources);
  GalaxyStatistics(*galaxy).measure_all();
  return galaxy;
}

std::shared_ptr<Galaxy> Galaxy::read(ConfigNode file, const GalaxySettings& settings,
                                     Resources& resources) {
  if (settings.overrides != nullptr) apply_overrides(*settings.overrides, file);
  check_sections(file);
  auto galaxy = read_alone(file, settings, resources);
  for (std::size_t c = 0; c < galaxy->components_.size(); ++c) {
    const Component& component = *galaxy->components_[c];
    if (!component.absorbs() || (component.texture() == nullptr && galaxy->followed_[c] < 0)) {
      continue;
    }
    const bool is_shared = settings.accuracy.shares_closure;
    if (is_shared && settings.reference != nullptr) {
      galaxy->reference_ = settings.reference;
      return galaxy;
    }
    GalaxySettings of_reference = settings;
    if (is_shared) of_reference.seed = reference_seed;
    of_reference.twin = galaxy;
    galaxy->reference_ = read_alone(file, of_reference, resources);
    galaxy->reference_->is_reference_ = true;
    return galaxy;
  }
  return galaxy;
}

std::shared_ptr<Galaxy> Galaxy::read_alone(const ConfigNode& root, const GalaxySettings& settings,
                                           Resources& resources) {
  const auto section = [&](const char* key) -> const ConfigNode* {
    const ConfigNode* node = root.find(key);
    if (node != nullptr && !node->is_table()) {
      throw InputError(node->where,
                       std::string("[") + key + "] must be a table, not " + node->type_name());
    }
    return node;
  };
  auto galaxy = std::make_shared<Galaxy>();
  galaxy->shape_ = shape_text(root, settings);
  std::string solo;
  SourceLocation solo_where;
  if (const ConfigNode* node = section("galaxy")) {
    const ParameterSet values = ParameterSet::read(table(), *node, "", "in [galaxy]");
    galaxy->name_ = values.text("name");
    galaxy->description_ = values.text("description");
    galaxy->axis_ = values.numbers("axis");
    solo = values.text("solo");
    solo_where = values.where("solo");
    for (const double stretch : galaxy->axis_) {
      if (stretch < smallest_stretch) {
        throw InputError(values.where("axis"), "axis is too small; at least 1e-9 is resolved");
      }
    }
  }
  const Galaxy* twin = settings.twin.get();
  galaxy->surroundings_ = surroundings_text(root);
  if (const ConfigNode* node = section("arms")) {
    const bool has_twin = twin != nullptr && twin->surroundings_ == galaxy->surroundings_;
    galaxy->arms_ = has_twin ? twin->arms_ : ArmPattern::read(*node, root.find("arm"));
  } else if (const ConfigNode* arm = root.find("arm")) {
    throw InputError(arm->key_where, "[[arm]] needs [arms] with a model");
  }
  int index = 0;
  const ComponentSurroundings surroundings{galaxy->arms_, galaxy->axis_[2], galaxy->surroundings_};
  for (const ConfigNode& node : component_list(root)) {
    auto component = read_component(node, ++index, surroundings, settings, resources);
    for (const auto& other : galaxy->components_) {
      if (other->name() == component->name()) {
        throw InputError(component->where(),
                         "two components are called '" + other->name() + "'; names must be unique");
      }
    }
    galaxy->components_.push_back(std::move(component));
  }
  galaxy->most_cloud_points_ = settings.most_cloud_points;
  galaxy->mean_error_ = settings.accuracy.mean_error;
  galaxy->resolve(root.where, twin);
  if (!solo.empty()) galaxy->show_alone(solo, solo_where);
  return galaxy;
}

void Galaxy::show_alone(const std::string& name, const SourceLocation& where) {
  std::vector<std::string> known;
  const Component* shown = nullptr;
  for (const auto& component : components_) {
    if (component->name() == name || bare_name(component->name()) == name) shown = component.get();
    if (!component->absorbs()) known.push_back(component->name());
  }
  if (shown == nullptr) {
    throw input_error(where, "the galaxy has no component {}{}; its light is in '{}'",
                      in_quotes(name), did_you_mean(name, known), fmt::join(known, "', '"));
  }
  if (shown->absorbs()) {
    throw input_error(where,
                      "{} is dust, which emits no light to be seen alone; truth.optical_depth "
                      "makes an image of it",
                      in_quotes(name));
  }
  for (std::size_t c = 0; c < components_.size(); ++c) luminosities_.push_back(luminosity(c));
  for (const auto& component : components_) {
    if (component.get() != shown) component->set_amplitude(0);
  }
}

int Galaxy::position(const std::string& name) const {
  const auto found = std::ranges::find(components_, name, [](const auto& c) { return c->name(); });
  return found != components_.end() ? static_cast<int>(found - components_.begin()) : -1;
}

void Galaxy::join_followers() {
  std::vector<std::string> names;
  for (const auto& c : components_) {
    if (c->texture() != nullptr) names.push_back(c->name());
  }
  for (const auto& c : components_) {
    if (c->follows().empty()) continue;
    const int followed = position(c->follows());
    const std::string context = "component '" + c->name() + "': follows '" + c->follows() + "', ";
    if (followed < 0) {
      throw InputError(c->follows_where(),
                       context + "which is no component" + did_you_mean(c->follows(), names));
    }
    const Component& leader = *components_[followed];
    const bool has_clumps = leader.has_texture_mean() && leader.star_field() == nullptr;
    if (&leader == c.get() || leader.texture() == nullptr ||
        !(leader.traits().can_be_followed || has_clumps)) {
      throw InputError(c->follows_where(),
                       context + "which is no disk with noise and no associations");
    }
    if (!leader.active()) throw InputError(c->follows_where(), context + "which is not active");
    if (has_clumps && !c->gather_in_clumps(leader)) {
      throw InputError(c->follows_where(), context + "whose clumps hold only the stars of a " +
                                               "starfield with noise = false");
    }
  }
}

void Galaxy::resolve(const SourceLocation& file, const Galaxy* twin) {
  join_followers();
  std::erase_if(components_, [](const auto& c) { return !c->active(); });
  if (components_.empty()) throw InputError(file, "no component of the galaxy is active");
  calibration_ = GalaxyCalibration(components_.size());
  // Face-on optical depth from which dust counts as thick.
  constexpr double thick = 5;
  double depth = 0;
  for (const auto& component : components_) {
    if (component->absorbs()) depth += component->amplitude() * component->face_on_column();
  }
  skin_scale_ = static_cast<float>(thick / std::max(depth, thick));
  add_integrals(twin);
  for (const auto& component : components_) {
    needs_azimuth_ = needs_azimuth_ || component->needs_azimuth();
    needs_winding_ = needs_winding_ || component->needs_winding();
  }
  order_evaluation();
  resolve_fractions();
  check_densities();
}

void Galaxy::order_evaluation() {
  for (std::vector<int>* const places : {&followed_, &early_, &clump_leader_, &clump_stars_}) {
    places->assign(components_.size(), -1);
  }
  const auto add = [&](std::size_t c) {
    if (early_[c] < 0) early_[c] = static_cast<int>(early_count_++);
  };
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (components_[c]->follows().empty()) continue;
    const auto leader = static_cast<std::size_t>(position(components_[c]->follows()));
    components_[c]->follow(components_[leader]->digests());
    const StarField* const stars = components_[c]->star_field();
    // Stars in clumps have a texture of their own.
    if (!components_[c]->has_texture_mean()) {
      followed_[c] = static_cast<int>(leader);
      add(leader);
    } else if (stars != nullptr && stars->shares_layer()) {
      clump_leader_[c] = static_cast<int>(leader);
      if (clump_stars_[leader] >= 0) continue;
      clump_stars_[leader] = static_cast<int>(c);
      add(leader);
      add(c);
    }
  }
}

void Galaxy::evaluate_stars(std::size_t c, const Points& points,
                            std::span<const std::uint32_t> clumps, BatchArray& density,
                            EvaluationCounts& counts) const {
  if (const StarClumps* const own = components_[c]->star_field()->clumps()) {
    counts.noise_evaluations += points.size * own->octaves();
    return own->evaluate(points, clumps, density.data());
  }
  evaluate_component(c, points, 0, density, counts);
}

double Galaxy::largest_phi(std::size_t c) const {
  const StarClumps* const clumps = components_[c]->star_field()->clumps();
  if (clumps == nullptr) return calibration_.largest_phi[c];
  return clumps->scale() / double{calibration_.means[c].narrowest()};
}

void Galaxy::add_integrals(const Galaxy* twin) {
  std::map<std::string_view, double> known;
  for (std::size_t c = 0; twin != nullptr && c < twin->components_.size(); ++c) {
    known.emplace(twin->components_[c]->digests().envelope, twin->integrals_[c]);
  }
  for (const auto& component : components_) {
    const auto found = known.find(component->digests().envelope);
    integrals_.push_back(found != known.end()
                             ? found->second
                             : component->envelope_integral() * axis_[0] * axis_[1] * axis_[2]);
  }
}

void Galaxy::check_densities() const {
  for (const auto& component : components_) {
    if (std::isfinite(static_cast<float>(component->amplitude()))) continue;
    throw InputError(component->where(),
                     "component '" + component->name() + "': its density exceeds single precision");
  }
}

double Galaxy::luminosity(std::size_t c) const {
  if (c < luminosities_.size()) return luminosities_[c];
  return std::as_const(*components_[c]).amplitude() * integrals_[c];
}

void Galaxy::resolve_fractions() {
  double by_intensity = 0, fractions = 0;
  const Component* first = nullptr;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const Component& component = *components_[c];
    if (component.absorbs()) continue;
    if (component.fraction()) {
      fractions += *component.fraction();
      if (first == nullptr) first = &component;
    } else {
      by_intensity += luminosity(c);
    }
  }
  if (first == nullptr) return;
  constexpr double rounding = 1e-9;
  if (by_intensity == 0 && std::abs(fractions - 1) > rounding) {
    throw InputError(first->where(), "the fractions of the galaxy's light add up to " +
                                         std::to_string(fractions) + ", not to 1");
  }
  if (by_intensity > 0 && fractions >= 1 - rounding) {
    throw InputError(first->where(),
                     "the fractions of the galaxy's light leave nothing for the components "
                     "that give an intensity");
  }
  const double total = by_intensity > 0 ? by_intensity / (1 - fractions) : 1.0;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    Component& component = *components_[c];
    if (component.absorbs() || !component.fraction()) continue;
    component.set_amplitude(1);
    component.set_amplitude(*component.fraction() * total / luminosity(c));
  }
}

}  // namespace gamer
