#include "image/wavelength_axis.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "image/fits_cards.h"

namespace gamer {
namespace {

/// Wavelengths are a linear axis when they are equally spaced to this relative accuracy.
constexpr double kLinearTolerance = 1e-9;

constexpr const char* kCoordinateTable = "WCS-TABLE";
constexpr const char* kCoordinateColumn = "WAVELENGTH";
constexpr const char* kAngstrom = "Angstrom";

/// The wavelengths as a linear axis, where they are one.
std::optional<LinearAxis> linear_wavelengths(const std::vector<double>& wavelengths) {
  const std::size_t count = wavelengths.size();
  const double first = wavelengths.front();
  const double step = (wavelengths.back() - first) / static_cast<double>(count - 1);
  if (step == 0) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    const double linear = first + step * static_cast<double>(i);
    if (!(std::abs(wavelengths[i] - linear) <= kLinearTolerance * std::abs(wavelengths[i]))) {
      return std::nullopt;
    }
  }
  return LinearAxis{"WAVE", kAngstrom, 1, first, step};
}

/// Greisen et al. 2006 (A&A 446, 747; "paper III"), section 6: the axis is a look-up table in an
/// extension. Returns the step of its index.
double append_table_axis(std::vector<Card>& cards) {
  const LinearAxis index = {"WAVE-TAB", kAngstrom, 1, 1, 1};
  append_axis(cards, 3, index);
  cards.push_back({"PS3_0", std::string(kCoordinateTable), "extension with the coordinates"});
  cards.push_back({"PS3_1", std::string(kCoordinateColumn), "column with the coordinates"});
  cards.push_back({"PV3_1", 1LL, "EXTVER of that extension"});
  cards.push_back({"PV3_2", 1LL, "EXTLEVEL of that extension"});
  cards.push_back({"PV3_3", 1LL, "axis within the coordinate array"});
  return index.step;
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

bool is_tabulated(const std::vector<double>& wavelengths) {
  return !wavelengths.empty() && !linear_wavelengths(wavelengths);
}

void append_third_axis(std::vector<Card>& cards, const std::vector<double>& wavelengths,
                       const std::vector<std::string>& plane_axes) {
  LinearAxis axis = {"PLANE", "", 1, 1, 1};
  if (is_tabulated(wavelengths)) {
    axis.step = append_table_axis(cards);
  } else {
    if (!wavelengths.empty()) axis = *linear_wavelengths(wavelengths);
    append_axis(cards, 3, axis);
  }
  // "CDi_j", then the letter of an alternate description.
  constexpr std::size_t kLetter = 5;
  std::set<std::string> letters;
  for (const std::string& record : plane_axes) {
    if (record.starts_with("CD1_") || record.starts_with("CD2_")) {
      letters.insert(record.substr(kLetter, record[kLetter] == ' ' ? 0 : 1));
    }
  }
  for (const std::string& letter : letters) {
    cards.push_back({"CD3_3" + letter, letter.empty() ? axis.step : 1, "step per pixel"});
  }
}

void write_coordinate_table(FitsFile& file, const std::vector<double>& wavelengths,
                            const std::vector<Card>& common) {
  const auto count = static_cast<long>(wavelengths.size());
  std::string name = kCoordinateColumn, form = fmt::format("{}D", count), unit = kAngstrom;
  char *names[] = {name.data()}, *forms[] = {form.data()}, *units[] = {unit.data()};
  file.call(fits_create_tbl, BINARY_TBL, LONGLONG{1}, 1, names, forms, units, kCoordinateTable);
  long shape[] = {1, count};
  file.call(fits_write_tdim, 1, 2, shape);
  write_cards(file, common);
  write_cards(file, {{"EXTVER", 1LL, ""}, {"EXTLEVEL", 1LL, ""}});
  file.call(fits_write_col_dbl, 1, LONGLONG{1}, LONGLONG{1}, LONGLONG{count},
            const_cast<double*>(wavelengths.data()));
}

}  // namespace gamer
