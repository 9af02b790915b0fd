#include "processing/segmentation.h"

#include <algorithm>
#include <limits>

#include "gamer/core/error.h"
#include "processing/smoothing.h"

namespace gamer {

Pieces connected_pieces(const std::vector<bool>& inside, int width, int height) {
  Pieces pieces;
  pieces.labels.assign(inside.size(), 0);
  std::vector<std::size_t> open;
  for (std::size_t start = 0; start < inside.size(); ++start) {
    if (!inside[start] || pieces.labels[start] != 0) continue;
    const int label = static_cast<int>(pieces.sizes.size()) + 1;
    std::size_t size = 0;
    open.assign(1, start);
    pieces.labels[start] = label;
    while (!open.empty()) {
      const std::size_t pixel = open.back();
      open.pop_back();
      ++size;
      const int x = static_cast<int>(pixel % static_cast<std::size_t>(width));
      const int y = static_cast<int>(pixel / static_cast<std::size_t>(width));
      for (int row = std::max(0, y - 1); row <= std::min(height - 1, y + 1); ++row) {
        for (int column = std::max(0, x - 1); column <= std::min(width - 1, x + 1); ++column) {
          const std::size_t next = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                   static_cast<std::size_t>(column);
          if (!inside[next] || pieces.labels[next] != 0) continue;
          pieces.labels[next] = label;
          open.push_back(next);
        }
      }
    }
    pieces.sizes.push_back(size);
  }
  return pieces;
}

std::vector<bool> galaxy_pixels(const Image& image, const Ellipses& ellipses, double petrosian) {
  constexpr double sigma_share = 0.2, half_width = 0.5;
  const Image smooth = gaussian_mean(image, sigma_share * petrosian);
  const int width = image.width(), height = image.height();
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  double sum = 0, area = 0;
  double brightest = -std::numeric_limits<double>::infinity();
  std::size_t brightest_pixel = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const int x = static_cast<int>(i % static_cast<std::size_t>(width));
    const int y = static_cast<int>(i / static_cast<std::size_t>(width));
    const double value = smooth.at(x, y);
    const double overlap = ellipses.overlap(x, y, petrosian + half_width) -
                           ellipses.overlap(x, y, petrosian - half_width);
    sum += overlap * value;
    area += overlap;
    if (value > brightest && ellipses.radius(x, y) <= petrosian) {
      brightest = value;
      brightest_pixel = i;
    }
  }
  std::vector<bool> bright(size);
  for (std::size_t i = 0; i < size; ++i) bright[i] = smooth.plane(0)[i] >= sum / area;
  const Pieces pieces = connected_pieces(bright, width, height);
  const int galaxy = pieces.labels[brightest_pixel];
  for (std::size_t i = 0; i < size; ++i) bright[i] = galaxy != 0 && pieces.labels[i] == galaxy;
  if (galaxy == 0 || pieces.sizes[static_cast<std::size_t>(galaxy) - 1] < 2) {
    throw InputError("the galaxy's segmentation has fewer than two pixels");
  }
  return bright;
}

}  // namespace gamer
