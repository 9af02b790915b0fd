#include "image/fits/fits_number.h"

#include <fmt/format.h>

#include <algorithm>

namespace gamer {

std::string fits_number(double value) {
  std::string text = fmt::format("{}", value);
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos) {
    text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  }
  std::replace(text.begin(), text.end(), 'e', 'E');
  return text;
}

}  // namespace gamer
