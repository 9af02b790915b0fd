#include "studio/declarations.h"

#include <fmt/format.h>

#include <cmath>
#include <type_traits>
#include <variant>

#include "gamer/core/type_name.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/galaxy/key_use.h"
#include "gamer/image/instrument.h"
#include "gamer/noise/noise.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene_columns.h"
#include "gamer/sed/bandpass.h"
#include "gamer/sed/sed.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

Json bound(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json parameter_json(const Parameter& parameter, const std::string& prefix) {
  const Interval& interval = parameter.interval;
  Json soft_min = nullptr, soft_max = nullptr;
  const char* scale = "linear";
  if (parameter.interval.usual_range) {
    soft_min = parameter.interval.usual_range->low;
    soft_max = parameter.interval.usual_range->high;
    if (parameter.interval.usual_range->is_logarithmic) scale = "log";
  }
  return {{"name", prefix + parameter.name},
          {"soft_min", soft_min},
          {"soft_max", soft_max},
          {"scale", scale},
          {"type", type_name(parameter.type)},
          {"unit", parameter.unit},
          {"min", bound(interval.low)},
          {"max", bound(interval.high)},
          {"min_open", interval.low_open},
          {"max_open", interval.high_open},
          {"default", value_json(parameter.default_value)},
          {"required", parameter.required},
          {"choices", parameter.choices},
          {"description", parameter.description}};
}

void add(const ParameterTable& table, const std::string& prefix, Json& list) {
  for (const Parameter& parameter : table) list.push_back(parameter_json(parameter, prefix));
}

/// Adds to the declarations of a list what each key needs in order to matter.
void add_uses(const std::vector<KeyUse>& uses, const std::string& prefix, Json& list) {
  const auto full = [&](const std::string& key) {
    return key.find('.') != std::string::npos || key == "arm" ? key : prefix + key;
  };
  for (Json& one : list) {
    for (const KeyUse& use : uses) {
      if (one["name"].get_ref<const std::string&>() != full(use.key)) continue;
      one["needs"].push_back(
          {{"key", full(use.selector)}, {"values", use.values}, {"excluded", use.is_excluded}});
    }
  }
}

std::vector<KeyUse> uses_of(const ParameterSection& section) {
  std::vector<KeyUse> uses;
  for (const KeyCondition& condition : section.conditions) {
    uses.push_back({condition.key, condition.selector, condition.values});
  }
  return uses;
}

/// The parameters of a kind, and those of its noise.
Json kind_json(const ComponentKind& kind) {
  Json list = Json::array();
  add(kind.parameters, "", list);
  if (kind.noise) {
    add({Parameter::boolean("noise", true, "whether the component has a texture")}, "", list);
    add(kind.noise->table(), "noise.", list);
  }
  add_uses(component_key_uses(kind), "", list);
  return list;
}

Json traits_json(const ComponentKind& kind) {
  return {{"description", kind.description},
          {"emits", kind.traits.emits},
          {"absorbs", kind.traits.absorbs},
          {"can_follow", kind.traits.can_follow},
          {"can_be_followed", kind.traits.can_be_followed},
          {"has_noise", kind.noise.has_value()}};
}

}  // namespace

Json value_json(const ParameterValue& value) {
  return std::visit(
      [](const auto& held) -> Json {
        using Held = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, std::monostate>) {
          return nullptr;
        } else if constexpr (std::is_same_v<Held, double>) {
          return bound(held);
        } else {
          return held;
        }
      },
      value);
}

void add_values(const ParameterSet& values, const std::string& prefix, Json& object) {
  for (const Parameter& parameter : values.table()) {
    object[prefix + parameter.name] = value_json(values.value(parameter.name));
  }
}

Json declarations_json() {
  Json galaxy = Json::array(), arm = Json::array();
  add(Galaxy::table(), "galaxy.", galaxy);
  add(ArmPattern::table(), "arms.", galaxy);
  add_uses(arm_key_uses(), "arms.", galaxy);
  add(ArmPattern::arm_table(), "", arm);
  Json scene = Json::array();
  add(scene_columns(), "", scene);
  Json kinds = Json::object(), traits = Json::object();
  for (const ComponentKind& kind : component_kinds()) {
    kinds[kind.name] = kind_json(kind);
    traits[kind.name] = traits_json(kind);
  }
  Json parameters = Json::object();
  for (const ParameterSection& section : render_parameter_sections()) {
    Json list = Json::array();
    add(section.table, "", list);
    add_uses(uses_of(section), "", list);
    parameters[section.name] = std::move(list);
  }
  return {{"kinds", kinds}, {"traits", traits}, {"galaxy", galaxy},
          {"arm", arm},     {"scene", scene},   {"parameters", parameters}};
}

Json catalogue_json(const Resources& resources) {
  return {{"galaxies", resources.names("galaxies", galaxy_suffixes())},
          {"seds", resources.names("seds", sed_suffixes())},
          {"bands", resources.names("bandpasses", bandpass_suffixes())},
          {"instruments", resources.names("instruments", instrument_suffixes())},
          {"noises", noise_names()}};
}

}  // namespace gamer
