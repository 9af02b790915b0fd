#pragma once

#include <initializer_list>
#include <string_view>

#include "gamer/core/parameter.h"

namespace gamer {

/// Place of the first of the keys that the user gave.
inline SourceLocation place_of(const ParameterSet& section,
                               std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (section.is_given(key)) return section.where(key);
  }
  return {};
}

}  // namespace gamer
