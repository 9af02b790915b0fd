#pragma once

#include <span>
#include <string>
#include <string_view>

namespace gamer {

/// The known names close to `name` as "; did you mean 'a' or 'b'?", or "" when none is.
/// Close: Damerau-Levenshtein distance (optimal string alignment, ASCII case ignored) of at most
/// 1 + length/4 and less than the longer of the two, so that something is shared. Nearest first, at
/// most three names.
std::string did_you_mean(std::string_view name, std::span<const std::string> known);

/// `text` in single quotes, fit for a message on one line: control characters become escapes, what
/// exceeds 200 bytes is cut.
std::string in_quotes(std::string_view text);

}  // namespace gamer
