#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// Pixels [x, x + width) x [y, y + height) of a plane, counted from 0.
struct Area {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  bool operator==(const Area&) const = default;
};

/// One plane of pixels whose values are made on demand: a stored image, or an operation on other
/// planes. Work on a plane of any size thus needs memory only for the area read. Row 0 is the
/// bottom. Missing pixels are NaN.
class Plane {
 public:
  /// Throws std::invalid_argument when a side is not positive.
  Plane(int width, int height);
  virtual ~Plane() = default;
  Plane& operator=(Plane&&) = delete;

  int width() const { return width_; }
  int height() const { return height_; }
  Area whole() const { return {0, 0, width_, height_}; }

  /// Writes pixel (area.x + i, area.y + j) to out[j * stride + i]. `area` lies within the plane;
  /// stride >= area.width. Safe from several threads at a time. Throws what the sources throw.
  virtual void read(const Area& area, double* out, std::ptrdiff_t stride) const = 0;
  void read(const Area& area, double* out) const { read(area, out, area.width); }

  /// Size of the areas with the least cost per pixel; the plane's edges cut them.
  struct Tile {
    int width = 0;
    int height = 0;
  };
  /// The size of this plane's tiles; by default whole rows, together about 2^18 pixels.
  virtual Tile tile() const;

 private:
  int width_, height_;
};

using PlanePtr = std::shared_ptr<const Plane>;

/// Pixels in memory, bottom row first.
class MemoryPlane final : public Plane {
 public:
  /// Throws std::invalid_argument unless there are width * height values.
  MemoryPlane(int width, int height, std::vector<double> values);
  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override;

 private:
  std::vector<double> values_;
};

/// A copy of one plane of an image.
PlanePtr memory_plane(const Image& image, int plane = 0);

/// A change of pixels in place: values[j * area.width + i] is pixel (area.x + i, area.y + j).
/// Several threads may call the change at a time, for any areas. changed() applies it to `source`.
using PixelChange = std::function<void(const Area& area, double* values)>;
PlanePtr changed(PlanePtr source, PixelChange change);

/// Splits the plane into bands of whole rows, bottom first. `threads` threads make a band's tiles,
/// then this thread calls `take(area, values)`; within another parallel_for() all threads of that
/// loop may help. Throws Cancelled, and exceptions of `take` and of the plane. Where several tiles
/// of a band fail, the exception is that of the first one.
void for_each_band(const Plane& plane, int threads,
                   const std::function<void(const Area& area, const double* values)>& take);

/// Calls `use(block)` for blocks of at most side x side pixels that cover the area. The function
/// serves planes that would read too much of their sources for a large area.
void for_each_block(const Area& area, int side, const std::function<void(const Area& block)>& use);

/// The whole plane in memory: an Image of one plane.
Image evaluate(const Plane& plane, int threads = 1);

}  // namespace gamer
