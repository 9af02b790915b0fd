#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace gamer {

/// The number that the whole text spells; nothing for other texts and for numbers out of range.
template <class Number>
std::optional<Number> number_of(std::string_view text) {
  Number number{};
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error != std::errc() || end != last) return std::nullopt;
  return number;
}

/// The text without a leading plus sign, which std::from_chars() rejects.
inline std::string_view without_plus(std::string_view text) {
  return text.substr(text.starts_with('+') ? 1 : 0);
}

/// Whether the character is an ASCII letter or digit, whatever the locale.
inline bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// The text without the characters of `blanks` at its ends.
inline std::string_view trimmed(std::string_view text, std::string_view blanks = " ") {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

/// The parts of a text between commas, at least one.
inline std::vector<std::string> split_at_commas(std::string_view text) {
  std::vector<std::string> parts;
  for (std::size_t comma; (comma = text.find(',')) != text.npos; text.remove_prefix(comma + 1)) {
    parts.emplace_back(text.substr(0, comma));
  }
  parts.emplace_back(text);
  return parts;
}

/// Removes "<length>:<bytes>", a netstring without its comma, from the start of `packed`. Returns
/// its bytes, or nothing where there is none.
inline std::optional<std::string> take_netstring(std::string_view& packed) {
  std::size_t length = 0;
  const auto [end, error] = std::from_chars(packed.data(), packed.data() + packed.size(), length);
  const std::size_t head = static_cast<std::size_t>(end - packed.data()) + 1;
  if (error != std::errc() || head > packed.size() || length > packed.size() - head) return {};
  std::string text(packed.substr(head, length));
  packed.remove_prefix(head + length);
  return text;
}

}  // namespace gamer
