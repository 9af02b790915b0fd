#include "gamer/core/printable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace gamer {
namespace {

std::uint8_t byte_at(std::string_view text, std::size_t i) {
  return static_cast<std::uint8_t>(text[i]);
}

/// Length in bytes of the UTF-8 character that begins `text`; 0 where it is not printable.
std::size_t printing_length(std::string_view text) {
  constexpr std::uint8_t delete_code = 0x7F, first_tail = 0x80, last_tail = 0xBF;
  // The first byte gives the number of bytes.
  const std::uint8_t first = byte_at(text, 0);
  if (first < first_tail) return first >= ' ' && first != delete_code ? 1 : 0;
  const auto length = static_cast<std::size_t>(std::countl_one(first));
  if (length < 2 || length > 4 || length > text.size()) return 0;
  constexpr int tail_bits = 6;
  std::uint32_t code = first & (delete_code >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const std::uint8_t tail = byte_at(text, i);
    if (tail < first_tail || tail > last_tail) return 0;
    code = code << tail_bits | (tail - first_tail);
  }
  // A character must have its shortest form. U+0080 to U+009F are control characters; UTF-16's
  // surrogates are no characters.
  constexpr std::array<std::uint32_t, 5> first_code = {0, 0, 0xA0, 0x800, 0x10000};
  constexpr std::uint32_t first_half = 0xD800, last_half = 0xDFFF, last = 0x10FFFF;
  const bool is_half = code >= first_half && code <= last_half;
  return code >= first_code[length] && code <= last && !is_half ? length : 0;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = printing_length(text);
    if (length > 0) {
      result += text.substr(0, length);
    } else if (text[0] == '\n') {
      result += "\\n";
    } else if (text[0] == '\r') {
      result += "\\r";
    } else if (text[0] == '\t') {
      result += "\\t";
    } else {
      result += fmt::format("\\x{:02x}", byte_at(text, 0));
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return result;
}

std::string json_string(std::string_view text) {
  std::string result = "\"";
  while (!text.empty()) {
    const std::size_t length = printing_length(text);
    if (text[0] == '"' || text[0] == '\\') result += '\\';
    if (length > 0) {
      result += text.substr(0, length);
    } else {
      result += fmt::format("\\u{:04x}", byte_at(text, 0));
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result + '"';
}

}  // namespace gamer
