#pragma once

#include <vector>

#include "gamer/render/renderer.h"

namespace gamer {

/// Measured properties of one galaxy alone, dimmed only by its own dust.
struct GalaxyMeasure {
  /// [plane] Ratio of light with dust to light without dust. Where the flux is fixed, the light
  /// without dust is dust_free_flux(), not that of the rays.
  std::vector<double> attenuation;
  /// [plane] Light of the rays without dust, as a share of dust_free_flux(); 1 where the flux is
  /// not fixed.
  std::vector<double> dust_free;
  /// PlacedGalaxy::light_factors of a galaxy of fixed flux; empty for other galaxies.
  std::vector<double> light_factors;
  double half_light_radius = 0;  ///< scene units; circle around the centre, first plane, with dust
  /// Ellipticity from second moments of the light of the first plane, with dust, about its
  /// centroid. With the axes N (up in the image) and E (left), e1 + i e2 = (Q_NN - Q_EE + 2 i
  /// Q_NE)/(Q_NN + Q_EE). The position angle is half the phase.
  double e1 = 0, e2 = 0;
  double optical_depth = 0;  ///< through the centre, first plane
  RenderCounts counts;       ///< of the rays, where the flux is fixed

  /// All numbers but light_factors and counts, for messages between ranks; unpacked() is the
  /// inverse.
  std::vector<double> packed() const;
  /// Length of packed() for a number of planes.
  static std::size_t numbers(std::size_t planes) { return 4 + 2 * planes; }
  static GalaxyMeasure unpacked(std::span<const double> numbers);
};

/// The flux of a galaxy without its dust, [plane]: nJy, in orthographic views nJy times scene
/// units^2. With `bulge_only` only bulges count.
std::vector<double> dust_free_flux(const PlacedGalaxy& galaxy, const Camera& camera,
                                   const Spectrum& spectrum, bool bulge_only = false);

/// Whether a galaxy of a sky view has at most 256 pixels across.
bool is_small(const PlacedGalaxy& galaxy, const Camera& camera);

/// Whether a galaxy can be a layer of the image, and be measured with its rays there. The galaxy
/// must be small (is_small()), in a view without a grid of rays, and its pixels must be rectangles
/// of equal area. Its light must take at most 128 MiB while it is measured. None of its stars may
/// be drawn individually.
bool can_be_layer(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                  const Camera& camera);

/// The footprints of the rays with which measure() sees a galaxy. These rays are `ray_distance`
/// times as far apart as those of an image. Galaxies of fixed flux need only the footprints of the
/// image.
FootprintRange measure_footprints(const RenderParameters& parameters, double ray_distance = 2.5);

/// Measures a galaxy of fixed flux with its rays in the image, and makes its layer. `number` is the
/// galaxy's index in the renderer's scene. The renderer must have dust-free planes. Half-light
/// radius and optical depth are found only if `for_table` is true.
GalaxyMeasure measure_fixed(const Renderer& renderer, const PlacedGalaxy& galaxy, int number,
                            const Camera& camera, const Spectrum& spectrum, bool for_table,
                            GalaxyLayer& layer);

/// Measures a galaxy. Where its flux is fixed, rays are those of the image; else they are parallel
/// to the line of sight, and `ray_distance` times as far apart.
GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Camera& camera, const Spectrum& spectrum, double ray_distance = 2.5);

}  // namespace gamer
