#include "studio/model.h"

#include <fmt/format.h>

#include <array>

#include "gamer/core/resources.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/scene/render_parameters.h"
#include "studio/declarations.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

// Appends the keys of a table; those of a table within it are like "noise.k0".
void add_given(const ConfigNode& node, const std::string& prefix, Json& list) {
  for (const auto& [key, value] : node.table()) {
    if (value.is_table()) {
      add_given(value, prefix + key + ".", list);
    } else {
      list.push_back(prefix + key);
    }
  }
}

/// The text at a key of a table, or another.
std::string text_or(const ConfigNode& node, const char* key, std::string other) {
  const ConfigNode* member = node.find(key);
  const auto* text = member != nullptr ? std::get_if<std::string>(&member->data) : nullptr;
  return text != nullptr ? *text : std::move(other);
}

Json component_json(const ConfigNode& node, const std::string& name) {
  static const std::array<std::string, 1> skipped = {"noise"};
  const ComponentKind& kind = find_component_kind(text_or(node, "class", ""), node.where);
  Json values = Json::object(), given = Json::array();
  const auto skip = std::span(skipped).first(kind.noise ? 1 : 0);
  add_values(ParameterSet::read(kind.parameters, node, "", "", skip), "", values);
  if (kind.noise) {
    const ConfigNode* noise = node.find("noise");
    const bool is_table = noise != nullptr && noise->is_table();
    values["noise"] = noise == nullptr || is_table;
    const ParameterTable table = kind.noise->table();
    add_values(is_table ? ParameterSet::read(table, *noise, "", "") : ParameterSet(table), "noise.",
               values);
  }
  add_given(node, "", given);
  return {{"kind", kind.name}, {"name", name}, {"values", values}, {"given", given}};
}

void add_section(const ConfigNode& root, const char* name, const ParameterTable& table,
                 Json& values) {
  const ConfigNode* node = root.find(name);
  add_values(node != nullptr ? ParameterSet::read(table, *node, "", "") : ParameterSet(table),
             fmt::format("{}.", name), values);
}

Json arms_json(const ConfigNode& root) {
  Json arms = Json::array();
  if (const ConfigNode* list = root.find("arm")) {
    for (const ConfigNode& node : list->array()) {
      Json values = Json::object();
      add_values(ParameterSet::read(ArmPattern::arm_table(), node, "", ""), "", values);
      arms.push_back(std::move(values));
    }
  }
  return arms;
}

}  // namespace

std::vector<std::string> component_names(const ConfigNode& galaxy) {
  std::vector<std::string> names;
  const ConfigNode* list = galaxy.find("component");
  if (list == nullptr || !list->is_array()) return names;
  for (const ConfigNode& node : list->array()) {
    const std::string default_name = text_or(node, "class", "") + std::to_string(names.size() + 1);
    names.push_back(text_or(node, "name", default_name));
  }
  return names;
}

std::vector<std::string> component_kinds_of(const ConfigNode& galaxy) {
  std::vector<std::string> kinds;
  const ConfigNode* list = galaxy.find("component");
  if (list == nullptr || !list->is_array()) return kinds;
  for (const ConfigNode& node : list->array()) kinds.push_back(text_or(node, "class", ""));
  return kinds;
}

Json model_json(const std::string& text, const std::string& label,
                const std::vector<std::filesystem::path>& folders,
                std::shared_ptr<const Galaxy>& latest) {
  Resources resources(folders);
  GalaxySettings settings;
  settings.twin = latest;
  settings.noise_kind = RenderParameters().noise.kind;
  const ConfigNode root = parse_toml(text, label);
  latest = Galaxy::read(root, settings, resources);
  Json values = Json::object(), given = Json::array(), components = Json::array();
  add_section(root, "galaxy", Galaxy::table(), values);
  add_section(root, "arms", ArmPattern::table(), values);
  for (const auto& [key, node] : root.table()) {
    if (node.is_table()) add_given(node, key + ".", given);
  }
  const std::vector<std::string> names = component_names(root);
  std::size_t index = 0;
  for (const ConfigNode& node : root.find("component")->array()) {
    components.push_back(component_json(node, names[index++]));
  }
  return {{"name", latest->name()},
          {"values", values},
          {"given", given},
          {"arms", arms_json(root)},
          {"components", components}};
}

}  // namespace gamer
