#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "gamer/render/galaxy_index.h"
#include "gamer/render/medium.h"
#include "gamer/render/stars/star_fields.h"

namespace gamer {

/// Finds the stars of a scene's star fields that an image shows one by one.
class StarPainter {
 public:
  /// Pixels [left, right) x [bottom, top).
  struct Tile {
    int left, right, bottom, top;
  };
  /// A star as it is seen. In a tile's neighbourhood stars come in an order that is the same for
  /// all tiles.
  struct Seen {
    int galaxy;
    std::size_t emitter;           ///< Medium::emitter()
    glm::dvec2 pixel;              ///< from 0
    std::span<const double> flux;  ///< of each plane, in the unit of the sums: brightness times sr
    std::span<const double> dust_free;
  };

  StarPainter(std::shared_ptr<const Scene> scene, const Camera& camera, const Medium& medium,
              const GalaxyIndex& index, std::shared_ptr<const StarFields> fields);

  /// Calls take() for every star that may touch the tile: stars within `margin` pixels of it.
  void paint(const Tile& tile, double margin, const std::function<void(const Seen&)>& take,
             RenderCounts& counts) const;

 private:
  /// What the stars of a field look like.
  struct Look {
    double unit;  ///< flux at the distance 1 over luminosity, for weights of 1
    std::size_t emitter;
    /// [grid temperature][plane * basis nodes + j]: SpectralBasis::weights(); one where all are
    /// alike.
    std::vector<std::vector<double>> weights;
  };
  struct Batch;

  void paint_field(std::size_t number, const Tile& tile, double margin,
                   const GalaxyIndex::Ball& rays, std::span<const int> dusty, Batch& batch,
                   const std::function<void(const Seen&)>& take, RenderCounts& counts) const;
  void flush(std::size_t number, std::span<const int> dusty, Batch& batch,
             const std::function<void(const Seen&)>& take, RenderCounts& counts) const;
  /// Optical depths at the spectral nodes, of all dust up to the batch's stars.
  void find_depths(std::span<const int> dusty, Batch& batch, RenderCounts& counts) const;
  /// Columns of the batch's lines, each halved until the accuracy is met.
  void measure_columns(Batch& batch, RenderCounts& counts) const;
  /// The first nodes of the batch's segments, or those half way between.
  void add_nodes(Batch& batch, bool is_first, RenderCounts& counts) const;

  std::shared_ptr<const Scene> scene_;
  Camera camera_;
  const Medium& medium_;
  const GalaxyIndex& index_;
  std::shared_ptr<const StarFields> fields_;
  std::vector<Look> looks_;         ///< of each field
  std::vector<std::size_t> order_;  ///< of the fields, that does not depend on the scene's rows
};

}  // namespace gamer
