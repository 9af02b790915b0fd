#pragma once

#include <cstdint>
#include <functional>

#include <glm/vec3.hpp>

#include "gamer/scene/render_parameters.h"

namespace gamer {

/// A star of the sky's own field, [stars].
struct FieldStar {
  glm::dvec3 direction;
  double magnitude;
  double temperature;  ///< K
};

/// The temperatures that field stars have: so many, evenly spread in ln T over the range.
inline constexpr int field_temperatures = 48;
double field_temperature(const FieldStarParameters& parameters, int i);

/// Calls take() for every star in the cells of the sky for which holds(direction, radius in rad) is
/// true of a circle around them. Cells are a quarter of a degree high, and wide at the most: a star
/// is a function of the seed, its cell and its number there, and stands where it does whatever the
/// image. Their number in a cell is a Poisson variate, their magnitudes follow dN/dm ~ 10^(slope
/// m).
void visit_field_stars(const FieldStarParameters& parameters,
                       const std::function<bool(const glm::dvec3& direction, double radius)>& holds,
                       const std::function<void(const FieldStar& star)>& take);

}  // namespace gamer
