#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "gamer/render/galaxy_index.h"
#include "gamer/render/medium.h"
#include "gamer/render/stars/star_fields.h"

namespace gamer {

/// A finder of the stars of star fields that an image draws individually.
class StarPainter {
 public:
  /// Pixels [left, right) x [bottom, top).
  struct Tile {
    int left, right, bottom, top;
  };
  /// A star as seen by the camera. The order of stars is equal for all tiles that see them.
  struct Seen {
    int galaxy;
    std::size_t emitter;           ///< Medium::emitter()
    glm::dvec2 pixel;              ///< from 0
    std::span<const double> flux;  ///< [plane] in the unit of the sums: brightness times sr
    std::span<const double> dust_free;
    std::size_t field;   ///< number in StarFields::fields()
    glm::dvec3 place;    ///< in the scene
    double distance;     ///< 1 in an orthographic view
    double luminosity;   ///< in the population's unit
    double weight;       ///< w(q): the share of its light that is in `flux`
    double temperature;  ///< K; NaN where all stars of the field have one spectrum
  };
  /// How much paint() finds out about each star. `places` needs no march through dust, and leaves
  /// fluxes empty.
  enum class Detail { places, light };

  /// How far the light of stars reaches, by its strength. A star's light is the largest of its
  /// fluxes without dust, each times `light_of_flux`. With `is_brightness` this light is divided by
  /// the area of the star's pixel.
  struct Reach {
    /// Stars with at most this light add no light beyond `margin` pixels. Classes ascend by light.
    /// The last class has all other stars.
    struct Class {
      double light, margin;
    };
    /// Index of the class of a star with this light.
    std::size_t of(double light) const;
    std::vector<Class> classes;
    std::vector<double> light_of_flux;  ///< [plane]
    bool is_brightness = false;
    double least_area = 0;  ///< a lower bound of the areas of pixels within the widest margin
  };

  StarPainter(std::shared_ptr<const Scene> scene, const Camera& camera, const Medium& medium,
              const GalaxyIndex& index, std::shared_ptr<const StarFields> fields);

  /// Calls take() for every star whose reach includes some pixel of the tile.
  void paint(const Tile& tile, const Reach& reach, const std::function<void(const Seen&)>& take,
             RenderCounts& counts, Detail detail = Detail::light) const;
  /// Calls take() for every star within `margin` pixels of the tile.
  void paint(const Tile& tile, double margin, const std::function<void(const Seen&)>& take,
             RenderCounts& counts, Detail detail = Detail::light) const;

 private:
  /// The data that give the flux of a field's stars.
  struct Look {
    double unit;  ///< ratio of flux at distance 1 to luminosity, for weights of 1
    std::size_t emitter;
    /// [grid temperature][plane * basis nodes + j]: SpectralBasis::weights(). There is one set if
    /// all stars share a spectrum.
    std::vector<std::vector<double>> weights;
    std::vector<double> most;  ///< [plane] upper bound of the sum of weights over the nodes
  };
  struct Batch;

  /// The rays of a tile and a margin; nothing where no pixel shows sky.
  std::optional<GalaxyIndex::Ball> rays_of(const Tile& tile, double margin) const;
  /// `rays` has a ball for each class of the reach.
  void paint_field(std::size_t number, const Tile& tile, const Reach& reach,
                   std::span<const std::optional<GalaxyIndex::Ball>> rays,
                   std::span<const int> dusty, Batch& batch,
                   const std::function<void(const Seen&)>& take, RenderCounts& counts) const;
  void flush(std::size_t number, std::span<const int> dusty, Batch& batch,
             const std::function<void(const Seen&)>& take, RenderCounts& counts) const;
  /// Keeps the batch's candidates that are stars.
  void sift(const StarFields::Field& field, Batch& batch, RenderCounts& counts) const;
  /// Finds the optical depths of all dust up to the batch's stars, at the spectral nodes.
  void find_depths(std::span<const int> dusty, Batch& batch, RenderCounts& counts) const;
  /// Measures the dust columns of the batch's lines; their steps are halved until the accuracy is
  /// met.
  void measure_columns(Batch& batch, RenderCounts& counts) const;
  /// Adds the first nodes of the batch's segments, or nodes half way between the existing nodes.
  void add_nodes(Batch& batch, bool is_first, RenderCounts& counts) const;

  std::shared_ptr<const Scene> scene_;
  Camera camera_;
  const Medium& medium_;
  const GalaxyIndex& index_;
  std::shared_ptr<const StarFields> fields_;
  std::vector<Look> looks_;         ///< of each field
  std::vector<std::size_t> order_;  ///< order of the fields, independent of the scene's rows
};

}  // namespace gamer
