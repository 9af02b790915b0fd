#include "gamer/job/attenuation.h"

#include <algorithm>

#include "gamer/render/galaxy_measure.h"

namespace gamer {
namespace {

// How much coarser than the image a galaxy's attenuation is measured, and the coarsest that helps.
constexpr double coarser = 3;
constexpr double coarsest_tolerance = 0.01;
// Distance of the rays, relative to those of an image.
constexpr double ray_distance = 2;

RenderParameters coarse(RenderParameters parameters) {
  double& tolerance = parameters.sampling.tolerance;
  tolerance = std::max(tolerance, std::min(coarser * tolerance, coarsest_tolerance));
  return parameters;
}

}  // namespace

bool is_observed(const PlacedGalaxy& placed, const PhotometrySettings& photometry, PixelUnit unit) {
  return unit != PixelUnit::relative && photometry.attenuated.value_or(!placed.is_absolute) &&
         std::ranges::any_of(placed.galaxy->components(),
                             [](const auto& component) { return component->absorbs(); });
}

FootprintRange attenuation_footprints(const RenderParameters& parameters) {
  return measure_footprints(measure_accuracy(coarse(parameters), ray_distance));
}

void apply_attenuation(const RenderParameters& parameters, const Camera& camera,
                       const Bandpass& reference, const Ranks& ranks, int threads, Scene& scene) {
  Spectrum band;
  band.planes = {
      {reference.name(), reference.pivot(), std::make_shared<const Bandpass>(reference)}};
  band.igm = parameters.spectrum.igm;
  std::vector<PlacedGalaxy*> observed;
  for (PlacedGalaxy& placed : scene.galaxies) {
    if (is_observed(placed, parameters.photometry, scene.unit)) observed.push_back(&placed);
  }
  const RenderParameters rough = coarse(parameters);
  const Accuracy accuracy = measure_accuracy(rough, ray_distance);
  const auto count = static_cast<int>(observed.size());
  constexpr int blocks_per_thread = 16;
  const int block = std::max(1, count / (blocks_per_thread * ranks.size() * threads));
  const std::vector<double> seen = ranks.compute_together(
      even_blocks(count, block), 1, threads, [&](RowRange rows, std::span<double> values) {
        for (int row = rows.first; row < rows.last; ++row) {
          PlacedGalaxy galaxy = *observed[static_cast<std::size_t>(row)];
          if (galaxy.is_absolute) galaxy.redshift = 0;
          values[static_cast<std::size_t>(row - rows.first)] =
              measure(galaxy, rough, accuracy, camera, band).attenuation.front();
        }
      });
  for (std::size_t row = 0; row < observed.size(); ++row) {
    if (seen[row] > 0) observed[row]->brightness /= seen[row];
  }
}

}  // namespace gamer
