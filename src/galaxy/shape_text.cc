#include "galaxy/shape_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <variant>

#include "gamer/core/digest.h"

namespace gamer {
namespace {

/// Keys of [galaxy] and [[component]] that no texture depends on. An amplitude follows from the
/// last three keys. It is part of the names of the measurements that depend on it.
constexpr std::array<std::string_view, 7> other_keys = {
    "description", "sed", "extinction", "r_v", "intensity", "fraction", "optical_depth"};

void append(const ConfigNode& node, bool is_section, std::string& text);

/// Appends the keys of a table, and their values, except those that `leaves_out`.
template <class Predicate>
void append_table(const ConfigNode& node, Predicate&& leaves_out, std::string& text) {
  text += '{';
  for (const auto& [key, value] : node.table()) {
    if (leaves_out(key)) continue;
    text += toml_string(key) + '=';
    append(value, false, text);
    text += ',';
  }
  text += '}';
}

bool is_other_key(std::string_view key) { return std::ranges::count(other_keys, key) > 0; }

void append(const ConfigNode& node, bool is_section, std::string& text) {
  if (node.is_table()) {
    append_table(
        node, [&](const auto& key) { return is_section && is_other_key(key); }, text);
  } else if (node.is_array()) {
    text += '[';
    for (const ConfigNode& value : node.array()) {
      append(value, value.is_table(), text);
      text += ',';
    }
    text += ']';
  } else if (const auto* word = std::get_if<std::string>(&node.data)) {
    text += toml_string(*word);
  } else if (const auto* number = std::get_if<double>(&node.data)) {
    text += fmt::format("{:a}", *number);
  } else if (const auto* whole = std::get_if<std::int64_t>(&node.data)) {
    text += fmt::format("{}", *whole);
  } else {
    text += std::get<bool>(node.data) ? "true" : "false";
  }
}

}  // namespace

std::string measure_key(const GalaxySettings& settings) {
  const Accuracy& accuracy = settings.accuracy;
  return fmt::format("{},{},{},{:a},{:a},{},{};",
                     settings.noise_kind ? settings.noise_kind->name() : "",
                     settings.octaves.value_or(-1), settings.seed, accuracy.ray_error,
                     accuracy.mean_error, accuracy.shares_closure, settings.most_cloud_points);
}

std::string shape_text(const ConfigNode& file, const GalaxySettings& settings) {
  std::string text = measure_key(settings);
  for (const auto& [section, node] : file.table()) {
    text += section + '=';
    append(node, node.is_table(), text);
  }
  return digest(text);
}

std::string surroundings_text(const ConfigNode& file) {
  std::string text;
  for (const auto& [section, node] : file.table()) {
    if (section == "component") continue;
    text += section + '=';
    if (section == "galaxy" && node.is_table()) {
      append_table(
          node, [](const auto& key) { return key == "name" || key == "solo" || is_other_key(key); },
          text);
    } else {
      append(node, false, text);
    }
  }
  return text;
}

ComponentDigests component_digests(const ConfigNode& node, const std::string& name,
                                   const ComponentKind& kind, const std::string& surroundings,
                                   const GalaxySettings& settings) {
  const auto text_without = [&](const auto& leaves_out) {
    std::string text = surroundings;
    append_table(
        node,
        [&](const std::string& key) {
          return key == "name" || key == "active" || key == "follows" || is_other_key(key) ||
                 leaves_out(key);
        },
        text);
    return text;
  };
  const std::string envelope = text_without([&](const std::string& key) {
    return (key == "noise" && kind.noise) ||
           std::ranges::count(kind.texture_parameters, key, &Parameter::name) > 0;
  });
  const std::string noise =
      fmt::format("{},{}", settings.noise_kind != nullptr ? settings.noise_kind->name() : "",
                  settings.octaves.value_or(-1));
  const std::string form = text_without([](const std::string& key) { return key == "seed"; });
  const std::string all = text_without([](const std::string&) { return false; });
  return {digest(envelope), digest(noise + form),
          digest(measure_key(settings) + toml_string(name) + all)};
}

}  // namespace gamer
