#include <algorithm>
#include <array>
#include <numbers>

#include "gamer/scene/catalogue.h"

namespace gamer {
namespace {

enum class Dimension { none, angle, distance, wavelength, magnitude, image };

struct Unit {
  std::string_view name;
  Dimension dimension;
  double size;  ///< in the dimension's smallest unit, so that ratios of whole numbers are exact
};

constexpr double degree = 3.6e6;  ///< mas
constexpr double radian = degree * 180 / std::numbers::pi;
constexpr double hour_angle = 15 * degree;

constexpr std::array known_units = {
    Unit{"", Dimension::none, 1},
    Unit{"mas", Dimension::angle, 1},
    Unit{"arcsec", Dimension::angle, 1e3},
    Unit{"arcmin", Dimension::angle, 6e4},
    Unit{"deg", Dimension::angle, degree},
    Unit{"degree", Dimension::angle, degree},
    Unit{"degrees", Dimension::angle, degree},
    Unit{"hourangle", Dimension::angle, hour_angle},
    Unit{"rad", Dimension::angle, radian},
    Unit{"radian", Dimension::angle, radian},
    Unit{"pc", Dimension::distance, 1},
    Unit{"kpc", Dimension::distance, 1e3},
    Unit{"Mpc", Dimension::distance, 1e6},
    Unit{"Gpc", Dimension::distance, 1e9},
    Unit{"Angstrom", Dimension::wavelength, 1},
    Unit{"angstrom", Dimension::wavelength, 1},
    Unit{"Angstroms", Dimension::wavelength, 1},
    Unit{"AA", Dimension::wavelength, 1},
    Unit{"nm", Dimension::wavelength, 10},
    Unit{"um", Dimension::wavelength, 1e4},
    Unit{"micron", Dimension::wavelength, 1e4},
    Unit{"m", Dimension::wavelength, 1e10},
    Unit{"mag", Dimension::magnitude, 1},
    Unit{"mag(AB)", Dimension::magnitude, 1},
    Unit{"ABmag", Dimension::magnitude, 1},
    Unit{"pixel", Dimension::image, 1},
    Unit{"pixels", Dimension::image, 1},
    Unit{"pix", Dimension::image, 1},
};

const Unit* find_unit(std::string_view name) {
  const auto* const found =
      std::ranges::find_if(known_units, [&](const Unit& unit) { return unit.name == name; });
  return found == known_units.end() ? nullptr : found;
}

}  // namespace

std::optional<double> unit_factor(std::string_view from, std::string_view to) {
  const Unit* const a = find_unit(from);
  const Unit* const b = find_unit(to);
  if (a == nullptr || b == nullptr || a->dimension != b->dimension) return std::nullopt;
  return a->size / b->size;
}

}  // namespace gamer
