#include "scene/row_overrides.h"

#include <fmt/format.h>

#include <algorithm>

namespace gamer {
namespace {

constexpr char begin = '{', end = '}', separator = ';';

bool is_parameter(const std::string& name) {
  const auto dot = name.find('.');
  return dot != std::string::npos && is_bare_key(name.substr(0, dot)) &&
         std::ranges::all_of(name.substr(dot + 1),
                             [](char c) {
                               return c == '.' || is_bare_key({&c, 1});
                             }) &&
         !name.ends_with('.');
}

}  // namespace

std::string join_type(const OverriddenType& type) {
  if (type.overrides.empty()) return type.name;
  return fmt::format("{}{}{}{}", type.name, begin, type.overrides, end);
}

OverriddenType split_type(const std::string& type) {
  const auto first = type.find(begin);
  if (first == std::string::npos || !type.ends_with(end)) return {type, ""};
  return {type.substr(0, first), type.substr(first + 1, type.size() - first - 2)};
}

std::vector<std::size_t> override_columns(const Catalogue& catalogue) {
  std::vector<std::size_t> places;
  if (!catalogue.has_galaxies()) return places;
  for (std::size_t i = 0; i < catalogue.columns().size(); ++i) {
    if (is_parameter(catalogue.columns()[i].name)) places.push_back(i);
  }
  return places;
}

void add_overrides(const std::string& overrides, const SourceLocation& where, ConfigNode& galaxy) {
  for (std::size_t first = 0; first < overrides.size();) {
    const std::size_t last = std::min(overrides.find(separator, first), overrides.size());
    set_from_text(galaxy, overrides.substr(first, last - first), where.text() + ": ");
    first = last + 1;
  }
}

}  // namespace gamer
