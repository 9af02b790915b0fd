#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "gamer/render/renderer.h"
#include "render/light_sums.h"

namespace gamer {

// What the files of Renderer share: renderer.cc, pixel_cells.cc and star_discs.cc.

/// A ray of a pixel.
struct Renderer::Sample {
  int pixel;
  int row;  ///< of LightSums
  double x, y;
  double weight;     ///< of the pixel's area
  double size;       ///< of the cell or sub-pixel for which it stands, pixels
  double footprint;  ///< of the pixel or sub-pixel
};

/// Arrays of one call.
struct Renderer::Workspace {
  int left = 0;
  std::vector<std::optional<Ray>> middles;  ///< of pixels from `left` on
  std::vector<Sample> samples;
  double finest_cell = 0;        ///< of the pixel that is refined, pixels
  std::size_t most_samples = 0;  ///< up to which that pixel may fill `samples`
  std::vector<glm::dvec2> places;
  std::vector<std::optional<Ray>> rays;
  std::vector<int> near_pixel, near_ray;
  std::vector<Hit> hits;
  std::vector<std::size_t> hit_ends;
  std::vector<std::span<const Hit>> hits_of_ray;
  std::vector<double> seen, dust_free, depth;  ///< by spectral plane
  RayLight light;
};

}  // namespace gamer
