#include "scene/row_overrides.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>

namespace gamer {
namespace {

constexpr char overrides_begin = '{', overrides_end = '}', separator = ';';

bool is_parameter(const std::string& name) {
  const auto dot = name.find('.');
  return dot != std::string::npos && is_bare_key(name.substr(0, dot)) &&
         std::ranges::all_of(name.substr(dot + 1),
                             [](char c) {
                               return c == '.' || is_bare_key({&c, 1});
                             }) &&
         !name.ends_with('.');
}

/// The names before the dot of columns that are a SkyCoord of Astropy: coord.ra and coord.dec.
std::set<std::string> coordinates_of(const Catalogue& catalogue) {
  std::set<std::string> names, found;
  for (const Catalogue::Column& column : catalogue.columns()) names.insert(column.name);
  constexpr std::string_view first = ".ra", second = ".dec";
  for (const std::string& name : names) {
    if (!name.ends_with(first)) continue;
    const std::string stem = name.substr(0, name.size() - first.size());
    if (names.contains(stem + std::string(second))) found.insert(stem);
  }
  return found;
}

/// Place of the separator that ends the assignment; one in quotes belongs to a text.
std::size_t end_of_assignment(const std::string& overrides, std::size_t first) {
  bool is_quoted = false;
  for (std::size_t at = first; at < overrides.size(); ++at) {
    if (overrides[at] == '"') is_quoted = !is_quoted;
    if (overrides[at] == separator && !is_quoted) return at;
  }
  return overrides.size();
}

}  // namespace

std::string join_type(const OverriddenType& type) {
  if (type.overrides.empty()) return type.name;
  return fmt::format("{}{}{}{}", type.name, overrides_begin, type.overrides, overrides_end);
}

OverriddenType split_type(const std::string& type) {
  const auto first = type.find(overrides_begin);
  if (first == std::string::npos || !type.ends_with(overrides_end)) return {type, ""};
  return {type.substr(0, first), type.substr(first + 1, type.size() - first - 2)};
}

std::vector<std::size_t> override_columns(const Catalogue& catalogue) {
  std::vector<std::size_t> places;
  if (!catalogue.has_galaxies()) return places;
  const std::set<std::string> coordinates = coordinates_of(catalogue);
  for (std::size_t i = 0; i < catalogue.columns().size(); ++i) {
    const std::string& name = catalogue.columns()[i].name;
    if (is_parameter(name) && !coordinates.contains(name.substr(0, name.find('.')))) {
      places.push_back(i);
    }
  }
  return places;
}

void add_overrides(const std::string& overrides, const SourceLocation& where, ConfigNode& galaxy) {
  for (std::size_t first = 0; first < overrides.size();) {
    const std::size_t last = end_of_assignment(overrides, first);
    set_from_text(galaxy, overrides.substr(first, last - first), where.text() + ": ");
    first = last + 1;
  }
}

}  // namespace gamer
