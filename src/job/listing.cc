#include "gamer/job/listing.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/near.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {
namespace {

/// One table with what stands above it.
struct Group {
  std::string kind;
  std::string title;
  std::string description;
  ParameterTable table;
};

std::vector<Group> all_groups() {
  std::vector<Group> groups;
  for (const ParameterSection& section : render_parameter_sections()) {
    groups.push_back({section.name, fmt::format("[{}] of a parameter file", section.name),
                      section.description, section.table});
  }
  groups.push_back(
      {"galaxy", "[galaxy] of a galaxy file", "The galaxy as a whole.", Galaxy::table()});
  groups.push_back({"arms", "[arms] of a galaxy file", "The spiral pattern.", ArmPattern::table()});
  for (const ComponentKind& kind : component_kinds()) {
    const std::string title = fmt::format("[[component]] of class \"{}\"", kind.name);
    groups.push_back({kind.name, title, kind.description, kind.parameters});
    if (kind.noise) {
      groups.push_back({kind.name, fmt::format("noise of class \"{}\"", kind.name),
                        "The table `noise` of the component; `noise = false` for none.",
                        kind.noise->table()});
    }
  }
  groups.push_back({"list", "Columns of a scene list", "One galaxy per row.", scene_columns()});
  return groups;
}

std::string group_text(const Group& group, bool markdown) {
  if (markdown) {
    return fmt::format("### {}\n\n{}\n\n{}", group.title, group.description,
                       markdown_table(group.table));
  }
  return fmt::format("{}: {}\n\n{}", group.title, group.description, terminal_table(group.table));
}

}  // namespace

std::string list_components() {
  std::size_t width = 0;
  for (const ComponentKind& kind : component_kinds()) width = std::max(width, kind.name.size());
  std::string result;
  for (const ComponentKind& kind : component_kinds()) {
    result += fmt::format("{:<{}}  {}\n", kind.name, width, kind.description);
  }
  return result;
}

std::string list_parameters(const std::string& kind, bool markdown) {
  std::string result;
  std::vector<std::string> known;
  for (const Group& group : all_groups()) {
    if (known.empty() || known.back() != group.kind) known.push_back(group.kind);
    if (!kind.empty() && kind != group.kind) continue;
    if (!result.empty()) result += '\n';
    result += group_text(group, markdown);
  }
  if (result.empty()) {
    std::string names;
    for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
    throw InputError({"--list-parameters", 0, 0},
                     fmt::format("unknown kind {}; known are {}{}", in_quotes(kind), names,
                                 did_you_mean(kind, known)));
  }
  return result;
}

std::string sample_parameters() {
  const RenderParameters defaults;
  std::string result;
  for (const ParameterSection& section : render_parameter_sections()) {
    if (!result.empty()) result += '\n';
    result += fmt::format("# {}\n[{}]\n", section.description, section.name);
    for (const Parameter& parameter : section.table) {
      result += fmt::format("\n# {}\n# {}\n", parameter.description, parameter.type_text());
      const ParameterValue& value = defaults.section(section.name).value(parameter.name);
      const bool has_value = defaults.section(section.name).has(parameter.name);
      const bool is_active = has_value && defaults.applies(section.name, parameter.name);
      result += fmt::format("{}{} ={}\n", is_active ? "" : "# ", parameter.name,
                            has_value ? " " + value_text(value) : "");
    }
  }
  return result;
}

}  // namespace gamer
