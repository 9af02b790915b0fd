#include "processing/polar_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/no_value.h"
#include "gamer/core/parallel_for.h"

namespace gamer {

DiskPlane::Pixel DiskPlane::pixel(double r, double azimuth) const {
  const double along = r * std::cos(azimuth);
  const double across = r * std::sin(azimuth) * std::cos(inclination);
  const double c = std::cos(angle), s = std::sin(angle);
  return {x + along * c - across * s, y + along * s + across * c};
}

double PolarGrid::row_step() const {
  return (is_logarithmic ? std::log(outer / inner) : outer - inner) / rows;
}

double PolarGrid::azimuth_step() const { return 2 * std::numbers::pi / columns; }

double PolarGrid::radius(double row) const {
  return is_logarithmic ? inner * std::exp(row * row_step()) : inner + row * row_step();
}

double bilinear(const Image& image, double x, double y) {
  const double left = std::floor(x), bottom = std::floor(y);
  if (!(left >= 0 && bottom >= 0 && x <= image.width() - 1 && y <= image.height() - 1)) {
    return no_value;
  }
  const int x0 = static_cast<int>(left), y0 = static_cast<int>(bottom);
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const double u = x - left, v = y - bottom;
  return (1 - v) * ((1 - u) * image.at(x0, y0) + u * image.at(x1, y0)) +
         v * ((1 - u) * image.at(x0, y1) + u * image.at(x1, y1));
}

Image polar_map(const Image& image, const DiskPlane& disk, const PolarGrid& grid) {
  Image map(grid.columns, grid.rows, 1);
  parallel_for(static_cast<std::size_t>(grid.rows), [&](std::size_t j) {
    const auto row = static_cast<double>(j);
    const double depth = grid.radius(row + 1) - grid.radius(row);
    const double arc = grid.radius(row + 1) * grid.azimuth_step();
    const int by_radius = std::max(1, static_cast<int>(std::ceil(depth)));
    const int by_azimuth = std::max(1, static_cast<int>(std::ceil(arc)));
    for (int i = 0; i < grid.columns; ++i) {
      double sum = 0;
      int count = 0;
      for (int k = 0; k < by_radius; ++k) {
        const double r = grid.radius(row + (k + 0.5) / by_radius);
        for (int l = 0; l < by_azimuth; ++l) {
          const DiskPlane::Pixel pixel =
              disk.pixel(r, (i + (l + 0.5) / by_azimuth) * grid.azimuth_step());
          const double value = bilinear(image, pixel.x, pixel.y);
          if (!std::isfinite(value)) continue;
          sum += value;
          ++count;
        }
      }
      map.at(i, static_cast<int>(j)) = count > 0 ? sum / count : no_value;
    }
  });
  return map;
}

}  // namespace gamer
