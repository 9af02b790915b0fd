#pragma once

#include <cstddef>
#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

/// A plane that is read in square blocks of `side` pixels. It serves changes in which a row needs
/// many rows of the source. Square blocks need the fewest pixels of the source.
class BlockedPlane : public Plane {
 public:
  Tile tile() const override { return {side_, side_}; }

  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    std::vector<double> values;
    for_each_block(area, side_, [&](const Area& block) {
      read_block(block, out + (block.y - area.y) * stride + block.x - area.x, stride, values);
    });
  }

 protected:
  BlockedPlane(int width, int height, int side) : Plane(width, height), side_(side) {}

  /// Fills `out` with one block. `values` is memory for pixels of the source.
  virtual void read_block(const Area& block, double* out, std::ptrdiff_t stride,
                          std::vector<double>& values) const = 0;

 private:
  int side_;
};

}  // namespace gamer
