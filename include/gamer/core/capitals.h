#pragma once

#include <string>
#include <string_view>

namespace gamer {

/// The text with its ASCII letters as capitals, whatever the locale.
inline std::string in_capitals(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return result;
}

}  // namespace gamer
