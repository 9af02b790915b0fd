#include "gamer/galaxy/key_use.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/job/session.h"

namespace gamer::key_use_test {
namespace {

using Lines = std::map<std::string, std::string>;

/// A close view of a galaxy, in which fine textures are seen.
const char* const parameters =
    "[image]\nsize = 12\n[camera]\nprojection = \"orthographic\"\nposition = [0.3, -1, 2]\n"
    "target = [0.25, 0.1, 0]\nwidth = 0.08\n[spectrum]\nwavelengths = [5500, 4400]\n"
    "[sampling]\ntolerance = 0.05\n";

/// The text of a table of keys and values; a key "noise.x" goes into its noise.
std::string table_text(const Lines& lines) {
  std::string text, noise;
  bool has_noise = true;
  for (const auto& [key, value] : lines) {
    if (key == "noise") {
      has_noise = value == "true";
    } else if (key.starts_with("noise.")) {
      noise += fmt::format("{}{} = {}", noise.empty() ? "" : ", ", key.substr(6), value);
    } else {
      text += fmt::format("{} = {}\n", key, value);
    }
  }
  if (!has_noise) return text + "noise = false\n";
  return noise.empty() ? text : text + fmt::format("noise = {{{}}}\n", noise);
}

/// The pixels of a galaxy, or the reason of its refusal.
struct Seen {
  std::vector<double> pixels;
  std::string refusal;

  bool is_refused() const { return !refusal.empty(); }
  /// Whether the pixels equal those of another, to rounding.
  bool is_as(const Seen& other) const {
    const double most = *std::ranges::max_element(other.pixels);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (std::abs(pixels[i] - other.pixels[i]) > 1e-12 * most) return false;
    }
    return true;
  }
};

/// The view of a galaxy with a disk and one more component.
Seen seen(const Session& session, const Lines& arms, const Lines& component,
          const std::string& more = "") {
  const std::string galaxy =
      "[arms]\n" + table_text(arms) + more +
      "[[component]]\nclass = \"disk\"\nname = \"d\"\nsed = \"flat\"\nz0 = 0.05\n"
      "noise = {octaves = 2}\n[[component]]\n" +
      table_text(component);
  try {
    const Rendering rendering = session.render(session.load(RenderInput{
        parameters, RenderInput::Text{"galaxy x y z size\nown 0 0 0 1\n"}, {{"own", galaxy}}}));
    const double* first = rendering.image.plane(0);
    return {{first, first + 2 * rendering.image.width() * rendering.image.height()}, ""};
  } catch (const InputError& error) {
    return {{}, error.what()};
  }
}

Lines arms_of(const std::string& model) {
  Lines arms = {{"model", '"' + model + '"'}};
  if (model == "logarithmic") arms.insert({{"pitch_angle", "20"}, {"scale", "0.1"}});
  return arms;
}

Lines least_of(const ComponentKind& kind) {
  Lines lines = {{"class", '"' + kind.name + '"'}, {"name", "\"own\""}};
  for (const Parameter& parameter : kind.parameters) {
    if (parameter.name == "sed" && parameter.required) lines["sed"] = "\"flat\"";
    if (parameter.name == "effective_radius") lines["effective_radius"] = "0.2";
  }
  return lines;
}

/// A value other than the default; none where only a name would do.
std::optional<std::string> other_value(const Parameter& parameter) {
  switch (parameter.type) {
    case ParameterType::boolean:
      return parameter.default_value == ParameterValue(true) ? "false" : "true";
    case ParameterType::choice: {
      const auto other = std::ranges::find_if(parameter.choices, [&](const std::string& choice) {
        return parameter.default_value != ParameterValue(choice) && choice != "simplex";
      });
      return '"' + *other + '"';
    }
    case ParameterType::integer:
    case ParameterType::number: {
      if (parameter.name == "handedness") return "-1";
      const bool is_whole = parameter.type == ParameterType::integer;
      const Interval& interval = parameter.interval;
      double low = std::max(interval.low, -10.0), high = std::min(interval.high, 10.0);
      if (parameter.interval.usual_range) {
        low = parameter.interval.usual_range->low;
        high = parameter.interval.usual_range->high;
      }
      double usual = low;
      if (const auto* number = std::get_if<double>(&parameter.default_value)) usual = *number;
      if (const auto* whole = std::get_if<std::int64_t>(&parameter.default_value))
        usual = double(*whole);
      double value = low + 0.3 * (high - low);
      if (std::abs(value - usual) < 0.1 * (high - low)) value = low + 0.6 * (high - low);
      return is_whole ? fmt::format("{}", std::llround(value)) : fmt::format("{}", value);
    }
    case ParameterType::vector3: return "[1, 0.6, 0.8]";
    case ParameterType::numbers: return "[0, 100]";
    default: return std::nullopt;
  }
}

std::string quoted(const std::string& value) {
  const bool is_bare = value == "true" || value == "false" ||
                       value.find_first_not_of("0123456789.-") == std::string::npos;
  return is_bare ? value : '"' + value + '"';
}

/// A value of a selector for which its key does not matter; none where the selector is a file's
/// name.
std::optional<std::string> failing_value(const KeyUse& use, const ParameterTable& table) {
  if (use.is_excluded) return quoted(use.values.front());
  if (use.selector == "noise") return "false";
  if (use.selector == "sed") return "\"flat\"";
  for (const Parameter& parameter : table) {
    if (!use.selector.ends_with(parameter.name)) continue;
    for (const std::string& choice : parameter.choices) {
      if (std::ranges::count(use.values, choice) == 0) return quoted(choice);
    }
  }
  return std::nullopt;
}

ParameterTable all_keys(const ComponentKind& kind) {
  ParameterTable table = kind.parameters;
  if (!kind.noise) return table;
  for (Parameter parameter : kind.noise->table()) {
    parameter.name = "noise." + parameter.name;
    table.push_back(std::move(parameter));
  }
  return table;
}

const Parameter& find(const ParameterTable& table, const std::string& name) {
  return *std::ranges::find(table, name, &Parameter::name);
}

TEST(KeyUses, WithoutWhatAKeyNeedsItIsRefusedOrWithoutEffect) {
  const Session session(2);
  int count = 0;
  for (const ComponentKind& kind : component_kinds()) {
    const ParameterTable table = all_keys(kind);
    for (const KeyUse& use : component_key_uses(kind)) {
      SCOPED_TRACE(fmt::format("{}: {} needs {}", kind.name, use.key, use.selector));
      const auto value = other_value(find(table, use.key));
      const auto failing = failing_value(use, table);
      if (!value || !failing) continue;
      Lines arms = arms_of("ringermacher-mead"), lines = least_of(kind);
      if (use.selector == "arms.model") {
        if (kind.name.starts_with("veins")) continue;  // veins need arms
        arms = arms_of("none");
      } else {
        lines[use.selector] = *failing;
      }
      const Seen without = seen(session, arms, lines);
      ASSERT_FALSE(without.is_refused()) << without.refusal;
      lines[use.key] = *value;
      const Seen with = seen(session, arms, lines);
      EXPECT_TRUE(with.is_refused() || with.is_as(without));
      ++count;
    }
  }
  EXPECT_GT(count, 100);
}

TEST(KeyUses, EveryOtherKeyMatters) {
  const Session session(2);
  // Names, alternatives to other keys, keys of the truth table, and keys that normalisation
  // cancels.
  const std::set<std::string> others = {"name", "bulge", "number", "radius", "class"};
  for (const ComponentKind& kind : component_kinds()) {
    const std::vector<KeyUse> uses = component_key_uses(kind);
    const Lines lines = least_of(kind);
    const Seen before = seen(session, arms_of("logarithmic"), lines);
    ASSERT_FALSE(before.is_refused()) << before.refusal;
    for (const Parameter& parameter : all_keys(kind)) {
      const auto value = other_value(parameter);
      const bool has_use = std::ranges::count(uses, parameter.name, &KeyUse::key) > 0;
      const bool is_of_noise = parameter.name.starts_with("noise.");
      if (!value || others.contains(parameter.name) || parameter.name == "fraction") continue;
      // Every key of noise needs noise; a key that needs more has two uses.
      if (std::ranges::count(uses, parameter.name, &KeyUse::key) > (is_of_noise ? 1 : 0) && has_use)
        continue;
      Lines changed = lines;
      changed[parameter.name] = *value;
      const Seen after = seen(session, arms_of("logarithmic"), changed);
      ASSERT_FALSE(after.is_refused()) << after.refusal;
      EXPECT_FALSE(after.is_as(before)) << kind.name << ": " << parameter.name << " = " << *value;
    }
  }
}

TEST(KeyUses, ArmsHaveThoseOfTheirModel) {
  const Session session(2);
  const ComponentKind& disk = find_component_kind("disk", {});
  const ParameterTable table = ArmPattern::table();
  Lines lines = least_of(disk);
  lines["arm_width"] = "2";
  const auto is_met = [](const KeyUse& use, const Lines& arms, bool has_tables) {
    std::string value = use.selector == "arm" ? has_tables ? "1" : "0" : "0";
    if (const auto found = arms.find(use.selector); found != arms.end()) value = found->second;
    std::erase(value, '"');
    return (std::ranges::count(use.values, value) > 0) != use.is_excluded;
  };
  for (const std::string model : {"ringermacher-mead", "logarithmic", "none"}) {
    for (const bool has_tables : {false, true}) {
      if (has_tables && model == "none") continue;
      const std::string tables = has_tables ? "[[arm]]\noffset = 10\n" : "";
      const Lines arms = {{"model", '"' + model + '"'}};
      const Seen plain = seen(session, arms, lines, tables);
      ASSERT_FALSE(plain.is_refused()) << plain.refusal;
      for (const Parameter& parameter : table) {
        if (parameter.name == "model" || parameter.name == "seed") continue;
        Lines changed = arms;
        // A given key may change how arms are followed, whatever its value.
        Seen before = plain;
        if (std::holds_alternative<double>(parameter.default_value)) {
          changed[parameter.name] = value_text(parameter.default_value);
          const Seen given = seen(session, changed, lines, tables);
          if (!given.is_refused()) before = given;
        }
        changed[parameter.name] = *other_value(parameter);
        const Seen after = seen(session, changed, lines, tables);
        bool matters = true;
        for (const KeyUse& use : arm_key_uses()) {
          if (use.key == parameter.name) matters = matters && is_met(use, arms, has_tables);
        }
        EXPECT_EQ(!after.is_refused() && !after.is_as(before), matters)
            << model << " " << parameter.name << " = " << changed[parameter.name] << " "
            << after.refusal;
      }
    }
  }
}

}  // namespace
}  // namespace gamer::key_use_test
