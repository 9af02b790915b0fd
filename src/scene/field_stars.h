#pragma once

#include <functional>

#include <glm/vec3.hpp>

#include "gamer/scene/star_settings.h"

namespace gamer {

/// A star of the sky's field; section [stars].
struct FieldStar {
  glm::dvec3 direction;
  double magnitude;
  double temperature;  ///< K
};

/// The magnitude for which the share u of the objects is brighter. Counts of objects rise as
/// 10^(slope m).
double magnitude_at(double bright, double faint, double slope, double u);

/// Number of temperatures of field stars, evenly spaced in ln T over the range.
inline constexpr int field_temperatures = 48;
double field_temperature(const FieldStarParameters& parameters, int i);

/// Calls take() for every field star in the cells of the sky whose enclosing circle satisfies
/// holds(direction, radius in rad). Cells are a quarter of a degree high, and at most as wide. A
/// star is a function of the seed, its cell and its number in the cell, so its place does not
/// depend on the image. The number in a cell is a Poisson variate; magnitudes follow dN/dm ~
/// 10^(slope m).
void visit_field_stars(const FieldStarParameters& parameters,
                       const std::function<bool(const glm::dvec3& direction, double radius)>& holds,
                       const std::function<void(const FieldStar& star)>& take);

}  // namespace gamer
