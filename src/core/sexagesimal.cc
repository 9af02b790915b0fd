#include "core/sexagesimal.h"

#include <array>
#include <cmath>

#include "core/text.h"

namespace gamer {
namespace {

std::optional<double> plain_number(std::string_view text) {
  const std::optional<double> value = number_of<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

}  // namespace

std::optional<double> parse_angle(std::string_view text, double unit) {
  const bool is_negative = text.starts_with('-');
  if (is_negative || text.starts_with('+')) text.remove_prefix(1);
  // A second sign is wrong.
  if (text.starts_with('-') || text.starts_with('+')) return std::nullopt;
  const double sign = is_negative ? -1 : 1;
  if (text.find(':') == std::string_view::npos) {
    const auto degrees = plain_number(text);
    if (!degrees) return std::nullopt;
    return sign * *degrees;
  }
  constexpr double sixty = 60;
  constexpr std::array<double, 3> sizes = {1, sixty, sixty * sixty};
  double sum = 0;
  for (std::size_t part = 0; part < sizes.size(); ++part) {
    const std::size_t colon = text.find(':');
    const auto value = plain_number(text.substr(0, colon));
    const bool is_last = colon == std::string_view::npos;
    const bool fits = value && *value >= 0 && (part == 0 || *value < sixty) &&
                      (is_last || *value == std::floor(*value));
    if (!fits || (is_last && part == 0)) return std::nullopt;
    sum += *value / sizes[part];
    if (is_last) return sign * unit * sum;
    text.remove_prefix(colon + 1);
  }
  return std::nullopt;
}

}  // namespace gamer
