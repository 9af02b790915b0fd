#include "gamer/galaxy/component.h"

#include <numbers>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "galaxy/shape_text.h"
#include "gamer/core/digest.h"
#include "gamer/core/near.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

namespace {

// These bounds keep emissivities and their sums within single precision in galaxies of any size. A
// share of 10^-10 stays above denormal numbers. Sums are per scene unit.
constexpr double largest_intensity = 1e30, smallest_intensity = 1e-12;

// Sharpness up to which rays at a distance of one footprint follow the features of a texture.
constexpr double followed_sharpness = std::numbers::sqrt2;

}  // namespace

double Component::footprint_scale() const {
  if (texture_ == nullptr || absorbs()) return 1;
  return std::max(texture_->sharpness() / followed_sharpness, 1.0);
}

void Component::follow(const ComponentDigests& followed) {
  digests_.texture = digest(digests_.texture + followed.texture);
}

namespace {

/// The keys of all kinds.
ParameterTable common_parameters() {
  return {
      required(Parameter::text("class", std::nullopt, "kind of component")),
      Parameter::text("name", std::nullopt,
                      "unique within the galaxy; default the class and its index"),
      Parameter::boolean("active", true, "false leaves the component out"),
  };
}

ParameterTable light_parameters(bool has_own_spectrum) {
  return {
      has_own_spectrum
          ? Parameter::text(
                "sed", std::nullopt,
                "name or file of the spectrum of all stars together; they differ in colour "
                "only if a key of temperatures is given")
          : required(
                Parameter::text("sed", std::nullopt, "name or file of its spectrum in `seds/`")),
      Parameter::number("intensity", "",
                        Interval::closed(0, largest_intensity).usual_logarithmic(0.001, 1000.0),
                        std::nullopt,
                        "I_m, central emissivity at 5500 Angstrom where envelope and noise are 1: "
                        "0 or at least 1e-12; default 1"),
      Parameter::number(
          "fraction", "", Interval::left_open(0, 1), std::nullopt,
          "instead of `intensity`: share of the galaxy's dust-free light at 5500 Angstrom"),
  };
}

ParameterTable dust_parameters() {
  return {
      Parameter::number("optical_depth", "", Interval::closed(0, 1000).usual_logarithmic(0.02, 50),
                        1.0, "tau_V, face-on optical depth at V through the middle"),
      Parameter::text("extinction", "ccm89", "extinction curve: \"ccm89\" or a file"),
      Parameter::number("r_v", "", Interval::closed(2, 6), 3.1, "R_V of ccm89"),
  };
}

/// The kind, with the parameters of its traits added.
ComponentKind with_shared_parameters(ComponentKind kind) {
  ParameterTable parameters = common_parameters();
  if (kind.traits.emits) parameters = parameters + light_parameters(kind.traits.has_own_spectrum);
  if (kind.traits.absorbs) parameters = parameters + dust_parameters();
  if (kind.traits.can_follow) {
    parameters.push_back(Parameter::text(
        "follows", std::nullopt,
        "name of the disk component whose noise also modulates this one; for a starfield with "
        "noise = false also of the associations in whose clumps its stars lie"));
  }
  kind.parameters = parameters + kind.parameters + kind.texture_parameters;
  return kind;
}

std::vector<ComponentKind>& registry() {
  static std::vector<ComponentKind> kinds = [] {
    std::vector<ComponentKind> result;
    for (const auto kind :
         {bulge_kind, disk_kind, stars_kind, dust_kind, veins_kind, veins_light_kind,
          starfield_kind, sersic_kind, associations_kind, bar_kind}) {
      result.push_back(with_shared_parameters(kind()));
    }
    return result;
  }();
  return kinds;
}

}  // namespace

std::span<const ComponentKind> component_kinds() { return registry(); }

void register_component_kind(ComponentKind kind) {
  for (const ComponentKind& known : registry()) {
    if (known.name == kind.name) {
      throw std::invalid_argument("register_component_kind: there is a kind " + kind.name);
    }
  }
  registry().push_back(with_shared_parameters(std::move(kind)));
}

const ComponentKind& find_component_kind(const std::string& name, const SourceLocation& where) {
  std::vector<std::string> names;
  for (const ComponentKind& kind : component_kinds()) {
    if (kind.name == name) return kind;
    names.push_back(kind.name);
  }
  std::string known;
  for (const std::string& n : names) known += (known.empty() ? "'" : ", '") + n + "'";
  throw InputError(where,
                   "unknown class '" + name + "'; known are " + known + did_you_mean(name, names));
}

namespace {

// Smallest length and stretch, in galaxy radii, for single precision.
constexpr double smallest_length = 1e-9;

/// Throws InputError for positive lengths that are too small.
void check_lengths(const ParameterSet& values, const std::string& context) {
  for (const Parameter& parameter : values.table()) {
    const bool is_stretch = parameter.type == ParameterType::vector3;
    const bool is_length =
        parameter.type == ParameterType::number && parameter.unit == "galaxy radii";
    if (!(is_stretch || is_length) || !values.has(parameter.name)) continue;
    const std::vector<double> lengths = is_stretch
                                            ? values.numbers(parameter.name)
                                            : std::vector<double>{values.number(parameter.name)};
    for (const double length : lengths) {
      if (length > 0 && length < smallest_length) {
        throw InputError(values.where(parameter.name),
                         context + parameter.name + " is too small; at least 1e-9 is resolved");
      }
    }
  }
}

/// A component of this form in the twin of the settings, or null.
const Component* twin_of(const std::string& form, const GalaxySettings& settings) {
  if (settings.twin == nullptr) return nullptr;
  for (const auto& component : settings.twin->components()) {
    if (component->digests().form == form) return component.get();
  }
  return nullptr;
}

}  // namespace

/// A reader of the data that all kinds share.
class ComponentReader {
 public:
  static std::unique_ptr<Component> read(const ConfigNode& node, int index,
                                         const ComponentSurroundings& surroundings,
                                         const GalaxySettings& settings, Resources& resources);

 private:
  static void read_light(Component& component, const ParameterSet& values,
                         const std::string& context, const GalaxySettings& settings,
                         Resources& resources);
  static void read_noise(Component& component, const ComponentKind& kind,
                         const ParameterSet& values, const ConfigNode& node,
                         const std::string& context, const GalaxySettings& settings);
};

void ComponentReader::read_light(Component& component, const ParameterSet& values,
                                 const std::string& context, const GalaxySettings& settings,
                                 Resources& resources) {
  if (values.is_given("intensity") && values.is_given("fraction")) {
    throw InputError(values.where("fraction"),
                     context + "'intensity' and 'fraction' exclude each other; give one");
  }
  component.amplitude_ = values.has("intensity") ? values.number("intensity") : 1.0;
  if (component.amplitude_ > 0 && component.amplitude_ < smallest_intensity) {
    throw input_error(values.where("intensity"),
                      "{}intensity = {} is too small for single precision; give 0 or at least {}, "
                      "all intensities in a smaller unit",
                      context, component.amplitude_, smallest_intensity);
  }
  if (values.has("fraction")) component.fraction_ = values.number("fraction");
  if (settings.sed != nullptr) {
    component.sed_ = settings.sed;
    return;
  }
  // Star fields without `sed` have spectra of their own.
  if (!values.has("sed")) return;
  try {
    component.sed_ = find_sed(values.text("sed"), values.where("sed").file, resources);
  } catch (const InputError& error) {
    // A message about the SED file itself carries its own place.
    throw InputError(values.where("sed"), context + error.what());
  }
}

void ComponentReader::read_noise(Component& component, const ComponentKind& kind,
                                 const ParameterSet& values, const ConfigNode& node,
                                 const std::string& context, const GalaxySettings& settings) {
  FractalParameters parameters = *kind.noise;
  parameters.kind = settings.noise_kind;
  if (settings.octaves) parameters.octaves = *settings.octaves;
  parameters.seed = hash_text(settings.seed, component.name_);
  const ConfigNode* noise = node.find("noise");
  if (noise != nullptr && !noise->is_table()) {
    const bool* on = std::get_if<bool>(&noise->data);
    if (on != nullptr && !*on) return;
    throw InputError(noise->where, context + "noise must be a table or false, not " +
                                       (on != nullptr ? "true" : noise->type_name()));
  }
  if (noise != nullptr && noise->is_table()) {
    parameters.apply(
        ParameterSet::read(parameters.table(), *noise, context + "noise: ", "in component.noise"),
        context + "noise: ");
    // The file's seed chooses the noise of this component; the row's seed still varies it.
    if (noise->find("seed") != nullptr) {
      parameters.seed = hash_words({parameters.seed, settings.seed});
    }
  }
  component.texture_ =
      std::make_unique<FractalTexture>(parameters, values.number("twirl"), 2 * values.number("z0"));
}

std::unique_ptr<Component> ComponentReader::read(const ConfigNode& node, int index,
                                                 const ComponentSurroundings& surroundings,
                                                 const GalaxySettings& settings,
                                                 Resources& resources) {
  if (!node.is_table()) {
    throw InputError(node.where, "[[component]] must be a table, not " + node.type_name());
  }
  const ConfigNode* kind_node = node.find("class");
  if (kind_node == nullptr) throw InputError(node.where, "missing key 'class' in [[component]]");
  const std::string* kind_name = std::get_if<std::string>(&kind_node->data);
  if (kind_name == nullptr) {
    throw InputError(kind_node->where, "class must be a string, not " + kind_node->type_name());
  }
  const ComponentKind& kind = find_component_kind(*kind_name, kind_node->where);

  std::string name = kind.name + std::to_string(index);
  if (const ConfigNode* given = node.find("name")) {
    if (const auto* text = std::get_if<std::string>(&given->data)) name = *text;
  }
  const std::string context = "component '" + name + "': ";
  const std::vector<std::string> skip = {"noise"};
  const bool has_noise = kind.noise.has_value();
  const ParameterSet values = ParameterSet::read(
      kind.parameters, node, context, "in a [[component]] of class '" + kind.name + "'",
      has_noise ? std::span<const std::string>(skip) : std::span<const std::string>());
  check_lengths(values, context);
  ComponentDigests digests = component_digests(node, name, kind, surroundings.text, settings);
  std::unique_ptr<Component> component =
      kind.make(ComponentInput{values, node, context, surroundings.arms, surroundings.axis_z,
                               settings, name, resources, twin_of(digests.form, settings)});
  component->digests_ = std::move(digests);
  component->kind_ = kind.name;
  component->traits_ = kind.traits;
  // The key `bulge` of some kinds decides whether the component is a bulge.
  if (std::ranges::count(kind.parameters, "bulge", &Parameter::name) > 0) {
    component->traits_.is_bulge = values.boolean("bulge");
  }
  component->name_ = name;
  component->active_ = values.boolean("active");
  component->where_ = node.where;
  if (kind.traits.emits) read_light(*component, values, context, settings, resources);
  if (kind.traits.absorbs) {
    try {
      component->extinction_ = find_extinction(values.text("extinction"), values.number("r_v"),
                                               node.where.file, resources);
    } catch (const InputError& error) {
      throw InputError(values.where("extinction"), context + error.what());
    }
    if (values.text("extinction") != "ccm89" && values.is_given("r_v")) {
      throw InputError(values.where("r_v"), context + "'r_v' belongs to extinction = \"ccm89\"");
    }
  }
  if (kind.traits.can_follow && values.has("follows")) {
    component->follows_ = values.text("follows");
    component->follows_where_ = values.where("follows");
  }
  if (has_noise) read_noise(*component, kind, values, node, context, settings);
  return component;
}

std::unique_ptr<Component> read_component(const ConfigNode& node, int index,
                                          const ComponentSurroundings& surroundings,
                                          const GalaxySettings& settings, Resources& resources) {
  return ComponentReader::read(node, index, surroundings, settings, resources);
}

}  // namespace gamer
