#include "image/wavelength_axis.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

namespace gamer {
namespace {

/// Relative accuracy to which wavelengths of a linear axis are equally spaced.
constexpr double linear_tolerance = 1e-9;

/// A linear axis of wavelengths where they are equally spaced; else of the planes' numbers.
LinearAxis plane_axis(const std::vector<double>& wavelengths) {
  const LinearAxis numbers = {"PLANE", "", 1, 1, 1};
  if (wavelengths.empty()) return numbers;
  const std::size_t count = wavelengths.size();
  const double first = wavelengths.front();
  const double step = (wavelengths.back() - first) / static_cast<double>(count - 1);
  if (step == 0) return numbers;
  for (std::size_t i = 0; i < count; ++i) {
    const double linear = first + step * static_cast<double>(i);
    if (!(std::abs(wavelengths[i] - linear) <= linear_tolerance * std::abs(wavelengths[i]))) {
      return numbers;
    }
  }
  return {"WAVE", "Angstrom", 1, first, step};
}

}  // namespace

void append_axis(std::vector<Card>& cards, int number, const LinearAxis& axis) {
  const auto key = [number](const char* name) { return fmt::format("{}{}", name, number); };
  cards.push_back({key("CTYPE"), axis.type, ""});
  if (!axis.unit.empty()) cards.push_back({key("CUNIT"), axis.unit, ""});
  cards.push_back({key("CRPIX"), axis.reference_pixel, "reference pixel"});
  cards.push_back({key("CRVAL"), axis.reference_value, "coordinate there"});
  cards.push_back({key("CDELT"), axis.step, "step per pixel"});
}

void append_third_axis(std::vector<Card>& cards, const std::vector<double>& wavelengths,
                       const std::vector<std::string>& plane_axes) {
  const LinearAxis axis = plane_axis(wavelengths);
  append_axis(cards, 3, axis);
  // "CDi_j", then the letter of an alternate description.
  constexpr std::size_t letter_place = 5;
  std::set<std::string> letters;
  for (const std::string& record : plane_axes) {
    if (record.starts_with("CD1_") || record.starts_with("CD2_")) {
      letters.insert(record.substr(letter_place, record[letter_place] == ' ' ? 0 : 1));
    }
  }
  for (const std::string& letter : letters) {
    cards.push_back({"CD3_3" + letter, letter.empty() ? axis.step : 1, "step per pixel"});
  }
}

}  // namespace gamer
