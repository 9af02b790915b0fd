#include "gamer/core/printable.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>

namespace gamer {
namespace {

std::uint8_t byte_at(std::string_view text, std::size_t i) {
  return static_cast<std::uint8_t>(text[i]);
}

/// Bytes of the character of UTF-8 that `text` begins with; 0 where it is none that prints.
std::size_t printing_length(std::string_view text) {
  constexpr std::uint8_t kDelete = 0x7F, kFirstTail = 0x80, kLastTail = 0xBF;
  // The first byte says how many there are; what would encode less than that is wrong.
  const std::uint8_t first = byte_at(text, 0);
  if (first < kFirstTail) return first >= ' ' && first != kDelete ? 1 : 0;
  const auto length = static_cast<std::size_t>(std::countl_one(first));
  if (length < 2 || length > 4 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if (byte_at(text, i) < kFirstTail || byte_at(text, i) > kLastTail) return 0;
  }
  // U+0080 to U+009F are control characters too.
  constexpr std::uint8_t kOverlong = 0xC1, kControls = 0xC2, kLastControl = 0x9F;
  if (first <= kOverlong || (first == kControls && byte_at(text, 1) <= kLastControl)) return 0;
  return length;
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

}  // namespace gamer
