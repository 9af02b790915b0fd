#pragma once

#include <span>
#include <string>
#include <string_view>

namespace gamer {

/// The known names close to `name` as "; did you mean 'a' or 'b'?", or "" when none is.
/// Close: Damerau-Levenshtein distance (case ignored) of at most 1 + length/4, nearest first, at
/// most three names.
std::string did_you_mean(std::string_view name, std::span<const std::string> known);

}  // namespace gamer
