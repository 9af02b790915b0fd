#pragma once

#include <initializer_list>
#include <optional>
#include <string_view>

#include "gamer/core/parameter.h"

namespace gamer {

/// The value of an optional integer key.
inline std::optional<int> optional_integer(const ParameterSet& section, std::string_view key) {
  if (!section.has(key)) return std::nullopt;
  return static_cast<int>(section.integer(key));
}

inline std::optional<double> optional_number(const ParameterSet& section, std::string_view key) {
  if (!section.has(key)) return std::nullopt;
  return section.number(key);
}

inline std::optional<bool> optional_boolean(const ParameterSet& section, std::string_view key) {
  if (!section.has(key)) return std::nullopt;
  return section.boolean(key);
}

/// The value of an optional text, or an empty one.
inline std::string text_or_empty(const ParameterSet& section, std::string_view key) {
  return section.has(key) ? section.text(key) : "";
}

/// Place of the first of the keys that the user gave.
inline SourceLocation place_of(const ParameterSet& section,
                               std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (section.is_given(key)) return section.where(key);
  }
  return {};
}

}  // namespace gamer
