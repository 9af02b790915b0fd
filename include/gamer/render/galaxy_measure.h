#pragma once

#include <cstddef>
#include <vector>

#include "gamer/render/renderer.h"

namespace gamer {

/// What a galaxy is, measured on rays through it alone: parallel to the line of sight, through its
/// own dust and nothing else, as finely as sampling.tolerance asks.
struct GalaxyMeasure {
  std::vector<double> attenuation;  ///< of each plane: light with dust over light without
  double half_light_radius = 0;     ///< scene units; around its centre, first plane, as seen
  /// Second moments of the light of the first plane, as seen, about its centroid: with the axes
  /// N (up in the image) and E (left), e1 + i e2 = (Q_NN - Q_EE + 2 i Q_NE)/(Q_NN + Q_EE), so that
  /// the position angle is half its phase.
  double e1 = 0, e2 = 0;
  double optical_depth = 0;  ///< through the centre, first plane
};

/// The footprints of the stamps on which galaxies are measured.
FootprintRange measure_footprints(const RenderParameters& parameters);

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Camera& camera, const Spectrum& spectrum);

}  // namespace gamer
