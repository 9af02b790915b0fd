#pragma once

#include <vector>

#include "gamer/render/renderer.h"

namespace gamer {

/// Measured properties of one galaxy alone, dimmed only by its own dust. The rays are parallel to
/// the line of sight.
struct GalaxyMeasure {
  std::vector<double> attenuation;  ///< [plane] ratio of light with dust to light without dust
  double half_light_radius = 0;  ///< scene units; circle around the centre, first plane, with dust
  /// Ellipticity from second moments of the light of the first plane, with dust, about its
  /// centroid. With the axes N (up in the image) and E (left), e1 + i e2 = (Q_NN - Q_EE + 2 i
  /// Q_NE)/(Q_NN + Q_EE). The position angle is half the phase.
  double e1 = 0, e2 = 0;
  double optical_depth = 0;  ///< through the centre, first plane
};

/// The accuracy with which galaxies are measured at sampling.tolerance, by rays `ray_distance`
/// times as far apart as those of an image.
Accuracy measure_accuracy(const RenderParameters& parameters, double ray_distance = 2.5);

/// The footprints of the rays with which galaxies are measured.
FootprintRange measure_footprints(const Accuracy& accuracy);

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Accuracy& accuracy, const Camera& camera, const Spectrum& spectrum);

}  // namespace gamer
