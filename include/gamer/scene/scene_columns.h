#pragma once

#include <cstddef>

#include "gamer/core/parameter.h"

namespace gamer {

/// Indices of a scene's columns in scene_columns().
namespace column {
enum Column : std::size_t {
  galaxy,
  x,
  y,
  z,
  ra,
  dec,
  dx,
  dy,
  px,
  py,
  ox,
  oy,
  oz,
  inclination,
  axis_ratio,
  pa,
  size,
  size_kpc,
  size_arcsec,
  half_light_radius,
  half_light_radius_kpc,
  sersic_index,
  bulge_fraction,
  bulge_radius_ratio,
  magnitude,
  apparent_magnitude,
  redshift,
  distance,
  g1,
  g2,
  kappa,
  sed,
  overrides,
  seed,
  id
};
}  // namespace column

/// The declared columns of a scene, whatever file it comes from.
const ParameterTable& scene_columns();

}  // namespace gamer
