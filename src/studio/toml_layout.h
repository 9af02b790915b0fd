#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// The places of the parts of a TOML text, in bytes. The text must be valid: parse_toml() has read
/// it.

/// A key with its value: "noise.k0 = 3".
struct TomlPair {
  std::vector<std::string> key;  ///< its parts
  std::size_t key_begin = 0;
  std::size_t value_begin = 0, value_end = 0;
  std::size_t line_begin = 0, line_end = 0;  ///< the lines, with the end of the last
};

/// A header with the pairs below it; the first section has no header.
struct TomlSection {
  std::vector<std::string> path;
  bool is_list = false;         ///< [[path]]
  std::size_t lead = 0;         ///< the beginning of comments right above the header
  std::size_t body = 0;         ///< the line behind the header
  std::size_t end = 0;          ///< where the next section's `lead` is, or the text's end
  std::size_t content_end = 0;  ///< behind the last line that is not blank
  std::vector<TomlPair> pairs;
};

std::vector<TomlSection> toml_sections(std::string_view text);

/// The members of the inline table that begins at `begin`, a brace. They have no lines.
std::vector<TomlPair> inline_members(std::string_view text, std::size_t begin);

/// The parts of a dotted key.
std::vector<std::string> key_parts(std::string_view key);

}  // namespace gamer
