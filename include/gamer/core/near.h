#pragma once

#include <span>
#include <string>
#include <string_view>

namespace gamer {

/// The known names close to `name` as "; did you mean 'a' or 'b'?", or "" when none is close. Close
/// means a Damerau-Levenshtein distance (optimal string alignment, ASCII case ignored) of at most 1
/// + length/4 and below the length of the longer name. Synonyms ("scale_length" for rh) count as
/// nearest. At most three names are given, nearest first.
std::string did_you_mean(std::string_view name, std::span<const std::string> known);

/// The text with the letters of ASCII in lower case.
std::string lower(std::string_view text);

/// `text` in single quotes for a message of one line: control characters are escaped, and texts
/// longer than 200 bytes are cut.
std::string in_quotes(std::string_view text);

}  // namespace gamer
