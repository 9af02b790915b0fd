#pragma once

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "gamer/render/renderer.h"
#include "render/light_sums.h"

namespace gamer {

// Types shared by the files of Renderer: renderer.cc, pixel_cells.cc, galaxy_layers.cc and
// star_discs.cc.

// Number of rays that are integrated together. They fill batches after refinement, and their nodes
// fit the second-level cache.
constexpr std::size_t rays_at_once = 256;

/// Whether a ray comes within a distance of a galaxy's ball, scene units.
inline bool is_within(const Ray& ray, const PlacedGalaxy& placed, double distance) {
  const glm::dvec3 offset = ray.origin - placed.centre;
  const double along = glm::dot(offset, ray.direction);
  const double reach = placed.bounding_radius + distance;
  return glm::dot(offset, offset) - along * along <= reach * reach;
}

/// A ray of a pixel.
struct Renderer::Sample {
  int pixel;
  int row;  ///< row of LightSums
  double x, y;
  double weight;     ///< share of the pixel's area
  double size;       ///< side of its cell or sub-pixel, pixels
  double footprint;  ///< side of the pixel or sub-pixel that sets the footprint, pixels
};

/// Arrays of one call.
struct Renderer::Workspace {
  int left = 0;
  std::vector<std::optional<Ray>> middles;  ///< rays through the middles of pixels from `left` on
  std::vector<Sample> samples;
  double finest_cell = 0;        ///< smallest cell of the pixel being refined, pixels
  std::size_t most_samples = 0;  ///< limit of `samples` for this pixel
  std::vector<glm::dvec2> places;
  std::vector<std::optional<Ray>> rays;
  std::vector<int> near_pixel, near_ray;
  std::vector<Hit> hits;
  std::vector<std::size_t> hit_ends;
  std::vector<std::span<const Hit>> hits_of_ray;
  std::vector<double> seen, dust_free, depth, part, through;  ///< by spectral plane
  /// A galaxy near the pixels that are rendered, with its layer.
  struct LayerOf {
    int galaxy;
    const GalaxyLayer* layer;
  };
  std::vector<LayerOf> layers;
  std::vector<const LayerOf*> in_pixel;  ///< nearest first
  std::vector<GalaxyLayer> made_layers;
  RayLight light;

  /// Calls use(samples) for at most rays_at_once samples at a time, while at least `least` wait.
  template <class Use>
  void use_samples(std::size_t least, const Use& use) {
    std::size_t done = 0;
    while (samples.size() - done >= least) {
      const std::size_t count = std::min(samples.size() - done, rays_at_once);
      use(std::span<const Sample>(samples).subspan(done, count));
      done += count;
    }
    samples.erase(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(done));
  }
};

}  // namespace gamer
