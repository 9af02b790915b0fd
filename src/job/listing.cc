#include "gamer/job/listing.h"

#include <algorithm>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/image/instrument.h"
#include "gamer/noise/noise.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"
#include "gamer/sed/bandpass.h"
#include "gamer/sed/sed.h"

namespace gamer {
namespace {

/// A table with its heading.
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
  groups.push_back({"arm", "[[arm]] of a galaxy file",
                    "One arm with a course of its own. Without [[arm]] every arm follows the law "
                    "of [arms] and its variations.",
                    ArmPattern::arm_table()});
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

/// Names with their meanings, a line each.
std::string rows_text(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::size_t width = 0;
  for (const auto& [name, meaning] : rows) width = std::max(width, name.size());
  std::string result;
  for (const auto& [name, meaning] : rows) {
    result += fmt::format("{:<{}}  {}\n", name, width, meaning);
  }
  return result;
}

/// Rows of all data of a kind; `describe` gives the description of one.
template <typename Describe>
std::string list_data(Resources& resources, const std::string& kind,
                      const std::vector<std::string>& suffixes,
                      std::vector<std::pair<std::string, std::string>> rows,
                      const Describe& describe) {
  for (const std::string& name : resources.names(kind, suffixes)) {
    std::string meaning;
    try {
      meaning = describe(name);
    } catch (const InputError& error) {
      meaning = error.what();
    }
    rows.emplace_back(name, std::move(meaning));
  }
  return rows_text(rows);
}

/// The description in [galaxy] of a galaxy file.
std::string description_of(const Resources::Text& text) {
  const ConfigNode root = parse_toml(text.content, text.label);
  const ConfigNode* galaxy = root.find("galaxy");
  if (galaxy == nullptr) return "";
  const ParameterSet values = ParameterSet::read(Galaxy::table(), *galaxy, "", "in [galaxy]");
  const std::string& description = values.text("description");
  return description.empty() ? values.text("name") : description;
}

}  // namespace

std::string list_components() {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const ComponentKind& kind : component_kinds()) {
    rows.emplace_back(kind.name, kind.description);
  }
  return rows_text(rows);
}

std::string list_galaxies(Resources& resources) {
  return list_data(resources, "galaxies", galaxy_suffixes(),
                   {{"sersic", "Sersic's law; the row gives sersic_index and axis_ratio"},
                    {"exponential", "Sersic's law of index 1"},
                    {"devaucouleurs", "Sersic's law of index 4"},
                    {"bulge+disk", "a bulge and a disk; the row gives bulge_fraction"},
                    {"star", "a point source"}},
                   [&](const std::string& name) {
                     return description_of(resources.find("galaxies", name, "", galaxy_suffixes()));
                   });
}

std::string list_seds(Resources& resources) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& name : analytic_sed_names()) rows.emplace_back(name, "analytic");
  return list_data(resources, "seds", sed_suffixes(), rows, [&](const std::string& name) {
    const Sed::Range range = find_sed(name, "", resources)->range();
    return fmt::format("{:.6g} to {:.6g} Angstrom", range.low, range.high);
  });
}

std::string list_bands(Resources& resources) {
  return list_data(resources, "bandpasses", bandpass_suffixes(), {}, [&](const std::string& name) {
    const auto band = find_bandpass(name, "", resources);
    return fmt::format("pivot {:.1f} Angstrom, {:.6g} to {:.6g}", band->pivot(), band->range().low,
                       band->range().high);
  });
}

std::string list_instruments(Resources& resources) {
  return list_data(resources, "instruments", instrument_suffixes(), {},
                   [&](const std::string& name) {
                     const Instrument instrument = find_instrument(name, "", resources);
                     return fmt::format("{}, {}: {:g} arcsec", instrument.name,
                                        instrument.description, instrument.pixel_scale);
                   });
}

std::string list_noises() {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const Noise* noise : noise_kinds()) {
    rows.emplace_back(std::string(noise->name()), std::string(noise->description()));
  }
  return rows_text(rows);
}

std::string list_parameters(const std::string& kind, bool markdown) {
  std::string result;
  for (const Group& group : all_groups()) {
    if (!kind.empty() && kind != group.kind) continue;
    if (!result.empty()) result += '\n';
    result += group_text(group, markdown);
  }
  if (result.empty()) {
    const std::vector<std::string> known = parameter_kinds();
    throw input_error({"--list-parameters", 0, 0}, "unknown kind {}; known are {}{}",
                      in_quotes(kind), fmt::join(known, ", "), did_you_mean(kind, known));
  }
  return result;
}

std::vector<std::string> parameter_kinds() {
  std::vector<std::string> kinds;
  for (const Group& group : all_groups()) {
    if (kinds.empty() || kinds.back() != group.kind) kinds.push_back(group.kind);
  }
  return kinds;
}

std::string sample_galaxy(const std::string& type, Resources& resources) {
  try {
    return resources.find("galaxies", type, "", galaxy_suffixes()).content.str();
  } catch (const InputError& error) {
    throw InputError({"gamer new", 0, 0}, error.what());
  }
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
