#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "gamer/scene/image_settings.h"

namespace gamer {

/// A galaxy in pixels of an image, as if it were alone and of brightness 1. A pixel has `numbers`
/// numbers, ordered by quantity and within it by spectral plane. First come the light and the
/// transmission of light from behind the galaxy. Then follow the optical depth, the light of each
/// emitting component and the light without dust, where output planes need them.
struct GalaxyLayer {
  ImageRegion region;  ///< of the whole image
  std::size_t numbers = 0;
  std::vector<double> values;  ///< [(row * region.width + column) * numbers + number]

  bool has(int x, int y) const {
    return x >= region.left && x < region.right() && y >= region.bottom && y < region.top();
  }
  /// The place of a pixel's numbers in `values`.
  std::size_t place(int x, int y) const {
    const auto row = static_cast<std::size_t>(y - region.bottom);
    const auto column = static_cast<std::size_t>(x - region.left);
    return (row * static_cast<std::size_t>(region.width) + column) * numbers;
  }
  /// Keeps only the first numbers of each pixel.
  void shorten(std::size_t count) {
    const std::size_t pixels = values.size() / numbers;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      const auto from = values.begin() + static_cast<std::ptrdiff_t>(pixel * numbers);
      std::copy_n(from, count, values.begin() + static_cast<std::ptrdiff_t>(pixel * count));
    }
    numbers = count;
    values.resize(pixels * numbers);
    values.shrink_to_fit();
  }
};

/// Layers of a scene's galaxies that the measurement of their fluxes made, kept for the renderer. A
/// renderer makes other layers itself, with equal bits.
class GalaxyLayers {
 public:
  /// Layers are kept until they take `most_bytes`.
  GalaxyLayers(std::size_t galaxies, std::size_t most_bytes)
      : layers_(galaxies), room_(static_cast<std::ptrdiff_t>(most_bytes)) {}

  /// Keeps a galaxy's layer while there is room. Threads may keep different galaxies at once.
  void keep(std::size_t galaxy, GalaxyLayer layer) {
    const auto bytes = static_cast<std::ptrdiff_t>(layer.values.size() * sizeof(double));
    if (room_.fetch_sub(bytes) >= bytes) layers_[galaxy] = std::move(layer);
  }
  /// A galaxy's layer; null if none is kept.
  const GalaxyLayer* find(std::size_t galaxy) const {
    return layers_[galaxy] ? &*layers_[galaxy] : nullptr;
  }

 private:
  std::vector<std::optional<GalaxyLayer>> layers_;
  std::atomic<std::ptrdiff_t> room_;  ///< bytes
};

}  // namespace gamer
