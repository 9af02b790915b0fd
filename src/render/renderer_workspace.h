#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "gamer/render/renderer.h"
#include "render/light_sums.h"

namespace gamer {

// Types shared by the files of Renderer: renderer.cc, pixel_cells.cc and star_discs.cc.

/// A ray of a pixel.
struct Renderer::Sample {
  int pixel;
  int row;  ///< row of LightSums
  double x, y;
  double weight;     ///< share of the pixel's area
  double size;       ///< side of its cell or sub-pixel, pixels
  double footprint;  ///< side of the pixel or sub-pixel that sets the footprint
};

/// Arrays of one call.
struct Renderer::Workspace {
  int left = 0;
  std::vector<std::optional<Ray>> middles;  ///< of pixels from `left` on
  std::vector<Sample> samples;
  double finest_cell = 0;        ///< smallest cell of the pixel being refined, pixels
  std::size_t most_samples = 0;  ///< limit of `samples` for this pixel
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
