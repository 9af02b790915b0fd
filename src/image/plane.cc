#include "gamer/image/plane.h"

#include <algorithm>
#include <future>
#include <stdexcept>
#include <utility>

#include "gamer/core/cancellation.h"
#include "gamer/core/parallel_for.h"

namespace gamer {
namespace {

/// Pixels of a tile: 2 MiB of doubles, so that a few of them stay in a core's cache.
constexpr int tile_pixels = 1 << 18;

class ChangedPlane final : public Plane {
 public:
  ChangedPlane(PlanePtr source, PixelChange change)
      : Plane(source->width(), source->height()),
        source_(std::move(source)),
        change_(std::move(change)) {}

  Tile tile() const override { return source_->tile(); }

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    source_->read(area, out, stride);
    if (stride == area.width) {
      change_(area, out);
      return;
    }
    for (int row = 0; row < area.height; ++row) {
      change_({area.x, area.y + row, area.width, 1}, out + row * stride);
    }
  }

 private:
  PlanePtr source_;
  PixelChange change_;
};

}  // namespace

Plane::Plane(int width, int height) : width_(width), height_(height) {
  if (width < 1 || height < 1) throw std::invalid_argument("a plane without pixels");
}

Plane::Tile Plane::tile() const { return {width_, std::clamp(tile_pixels / width_, 1, height_)}; }

MemoryPlane::MemoryPlane(int width, int height, std::vector<double> values)
    : Plane(width, height), values_(std::move(values)) {
  if (values_.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    throw std::invalid_argument("a plane's values are not width * height");
  }
}

void MemoryPlane::read(const Area& area, double* out, std::ptrdiff_t stride) const {
  for (int row = 0; row < area.height; ++row) {
    const std::size_t first = (static_cast<std::size_t>(area.y) + row) * width() + area.x;
    std::copy_n(values_.data() + first, area.width, out + row * stride);
  }
}

PlanePtr memory_plane(const Image& image, int plane) {
  const double* first = image.plane(plane);
  const std::size_t count = static_cast<std::size_t>(image.width()) * image.height();
  return std::make_shared<MemoryPlane>(image.width(), image.height(),
                                       std::vector<double>(first, first + count));
}

PlanePtr changed(PlanePtr source, PixelChange change) {
  return std::make_shared<ChangedPlane>(std::move(source), std::move(change));
}

void for_each_band(const Plane& plane, int threads,
                   const std::function<void(const Area& area, const double* values)>& take) {
  const Plane::Tile wanted = plane.tile();
  const int tile_width = std::clamp(wanted.width, 1, plane.width());
  const int tile_height = std::clamp(wanted.height, 1, plane.height());
  const int columns = (plane.width() + tile_width - 1) / tile_width;
  // Tiles that are whole rows: a band has one tile for each thread.
  const int rows_of_tiles = columns == 1 ? std::max(threads, 1) : 1;
  const auto band_height = static_cast<int>(
      std::min<long long>(static_cast<long long>(tile_height) * rows_of_tiles, plane.height()));
  const std::size_t band_size = static_cast<std::size_t>(plane.width()) * band_height;
  const Cancellation* const cancellation = CancellationScope::current();
  const auto make = [&](int y, std::vector<double>& values) {
    const int height = std::min(band_height, plane.height() - y);
    const int rows = (height + tile_height - 1) / tile_height;
    const auto make_tile = [&](std::size_t i) {
      const int index = static_cast<int>(i);
      const int row = index / columns * tile_height, x = index % columns * tile_width;
      const Area area = {x, y + row, std::min(tile_width, plane.width() - x),
                         std::min(tile_height, height - row)};
      plane.read(area, values.data() + static_cast<std::ptrdiff_t>(row) * plane.width() + x,
                 plane.width());
    };
    const CancellationScope scope(cancellation);
    parallel_for(static_cast<std::size_t>(columns) * rows, make_tile, {}, threads);
  };
  const auto give = [&](int y, const std::vector<double>& values) {
    take({0, y, plane.width(), std::min(band_height, plane.height() - y)}, values.data());
  };
  std::vector<double> values(band_size);
  if (threads < 2 || band_height == plane.height()) {
    for (int y = 0; y < plane.height(); y += band_height) {
      make(y, values);
      give(y, values);
    }
    return;
  }
  // The next band is made while this thread handles the current one.
  std::vector<double> next(band_size);
  make(0, values);
  for (int y = 0; y < plane.height(); y += band_height) {
    std::future<void> made;
    if (y + band_height < plane.height()) {
      made = std::async(std::launch::async, make, y + band_height, std::ref(next));
    }
    give(y, values);
    if (made.valid()) made.get();
    values.swap(next);
  }
}

void for_each_block(const Area& area, int side, const std::function<void(const Area& block)>& use) {
  for (int y = 0; y < area.height; y += side) {
    for (int x = 0; x < area.width; x += side) {
      use({area.x + x, area.y + y, std::min(side, area.width - x),
           std::min(side, area.height - y)});
    }
  }
}

Image evaluate(const Plane& plane, int threads) {
  Image image(plane.width(), plane.height(), 1);
  for_each_band(plane, threads, [&](const Area& area, const double* values) {
    const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
    std::copy_n(values, count, &image.at(0, area.y));
  });
  return image;
}

}  // namespace gamer
