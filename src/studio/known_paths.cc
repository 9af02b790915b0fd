#include "studio/known_paths.h"

#include <algorithm>
#include <array>
#include <functional>
#include <string_view>

#include "core/message.h"
#include "gamer/core/config.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

using Take = std::function<void(const std::string&)>;

/// Keys of texts for people, and of units such as MJy/sr.
constexpr std::array<std::string_view, 3> no_paths = {"description", "name", "unit"};

bool is_path(std::string_view text) {
  return text.find('/') != std::string_view::npos || text == "..";
}

/// All texts of a tree that may be paths.
void walk(const ConfigNode& node, const Take& take) {
  if (const auto* text = std::get_if<std::string>(&node.data)) return take(*text);
  if (node.is_array()) {
    for (const ConfigNode& element : node.array()) walk(element, take);
  }
  if (!node.is_table()) return;
  for (const auto& [key, value] : node.table()) {
    if (std::find(no_paths.begin(), no_paths.end(), key) == no_paths.end()) walk(value, take);
  }
}

/// The words of a scene's rows.
void walk_scene(std::string_view scene, const Take& take) {
  constexpr std::string_view separators = " \t,;\"'|<>";
  while (!scene.empty()) {
    const std::size_t end = std::min(scene.find('\n'), scene.size());
    std::string_view line = scene.substr(0, end);
    scene.remove_prefix(std::min(end + 1, scene.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.starts_with('#')) continue;
    while (!line.empty()) {
      const std::size_t stop = std::min(line.find_first_of(separators), line.size());
      if (stop > 0) take(std::string(line.substr(0, stop)));
      line.remove_prefix(std::min(stop + 1, line.size()));
    }
  }
}

/// The values of a TOML text. A text that is no TOML has none; reading it fails later.
void walk_toml(const std::string& text, const Take& take) {
  ConfigNode root;
  try {
    root = parse_toml(text, "");
  } catch (const InputError&) {
    return;
  }
  walk(root, take);
}

void walk_settings(const std::vector<std::string>& settings, const Take& take) {
  for (const std::string& setting : settings) {
    ConfigNode root;
    try {
      set_from_text(root, setting);
    } catch (const InputError&) {
      continue;
    }
    walk(root, take);
  }
}

}  // namespace

KnownPaths::KnownPaths(const PageDocument& opened) {
  const auto take = [&](const std::string& text) { known_.insert(text); };
  walk_toml(opened.parameters, take);
  walk_scene(opened.scene, take);
  for (const auto& [name, text] : opened.galaxies) walk_toml(text, take);
}

void KnownPaths::refuse_unknown(const std::string& text) const {
  if (!is_path(text) || known_.count(text) > 0) return;
  throw input_error(
      "{} is a path; the page may use names of the catalogue, and paths "
      "in the files that gstudio was started with",
      in_quotes(text));
}

void KnownPaths::check(const PageDocument& document) const {
  const auto refuse = [&](const std::string& text) { refuse_unknown(text); };
  check_text(document.parameters);
  walk_settings(document.settings, refuse);
  walk_scene(document.scene, refuse);
  for (const auto& [name, text] : document.galaxies) {
    refuse(name);
    check_text(text);
  }
}

void KnownPaths::check_text(const std::string& text) const {
  walk_toml(text, [&](const std::string& value) { refuse_unknown(value); });
}

}  // namespace gamer
