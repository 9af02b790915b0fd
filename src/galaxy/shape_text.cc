#include "galaxy/shape_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <variant>

#include "gamer/core/random.h"

namespace gamer {
namespace {

/// Keys of [galaxy] and [[component]] that no texture depends on. An amplitude follows from the
/// last three, and is part of the names of those measurements that depend on it.
constexpr std::array<std::string_view, 7> other_keys = {
    "description", "sed", "extinction", "r_v", "intensity", "fraction", "optical_depth"};

void append(const ConfigNode& node, bool is_section, std::string& text) {
  if (node.is_table()) {
    text += '{';
    for (const auto& [key, value] : node.table()) {
      if (is_section && std::ranges::count(other_keys, key) > 0) continue;
      text += toml_string(key) + '=';
      append(value, false, text);
      text += ',';
    }
    text += '}';
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
  // Two independent words make equal digests of different texts unlikely beyond any use.
  return fmt::format("{:016x}{:016x}", hash_text(1, text), hash_text(2, text));
}

}  // namespace gamer
