#include "processing/mid_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "processing/segmentation.h"
#include "processing/smoothing.h"

namespace gamer {
namespace {

double multimode(const Image& image, const std::vector<bool>& galaxy) {
  constexpr double smoothing_width = 3;
  constexpr int quantile_count = 50;
  const Image smooth = box_mean(image, smoothing_width);
  std::vector<double> values;
  for (std::size_t i = 0; i < galaxy.size(); ++i) {
    if (galaxy[i]) values.push_back(smooth.plane(0)[i]);
  }
  std::ranges::sort(values);
  double largest = 0;
  std::vector<bool> bright(galaxy.size());
  for (int q = 0; q < quantile_count; ++q) {
    const double threshold = values[values.size() * static_cast<std::size_t>(q) / quantile_count];
    for (std::size_t i = 0; i < galaxy.size(); ++i) {
      bright[i] = galaxy[i] && smooth.plane(0)[i] >= threshold;
    }
    Pieces pieces = connected_pieces(bright, image.width(), image.height());
    if (pieces.sizes.size() < 2) continue;
    std::ranges::sort(pieces.sizes, std::greater<>());
    largest = std::max(largest,
                       static_cast<double>(pieces.sizes[1]) / static_cast<double>(pieces.sizes[0]));
  }
  return largest;
}

/// The brightest of a pixel and its eight neighbours in the galaxy; the last one among equals.
std::size_t brightest_neighbour(const Image& image, const std::vector<bool>& galaxy,
                                std::size_t pixel) {
  const auto width = static_cast<std::size_t>(image.width());
  const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
  std::size_t best = pixel;
  const double* values = image.plane(0);
  for (int row = std::max(0, y - 1); row <= std::min(image.height() - 1, y + 1); ++row) {
    for (int column = std::max(0, x - 1); column <= std::min(image.width() - 1, x + 1); ++column) {
      const std::size_t next =
          static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
      if (!galaxy[next]) continue;
      if (std::pair(values[next], next) > std::pair(values[best], best)) best = next;
    }
  }
  return best;
}

/// The maximum that the steepest ascent from each pixel of the galaxy reaches.
std::vector<std::size_t> maxima(const Image& image, const std::vector<bool>& galaxy) {
  std::vector<std::size_t> above(galaxy.size());
  for (std::size_t i = 0; i < galaxy.size(); ++i) {
    above[i] = galaxy[i] ? brightest_neighbour(image, galaxy, i) : i;
  }
  for (std::size_t i = 0; i < galaxy.size(); ++i) {
    std::size_t top = i;
    while (above[top] != top) top = above[top];
    // Every pixel of the path leads to the top from now on.
    for (std::size_t step = i; above[step] != top && step != top;) {
      step = std::exchange(above[step], top);
    }
  }
  return above;
}

}  // namespace

MidStatistics mid_statistics(const Image& image, const std::vector<bool>& galaxy) {
  const auto width = static_cast<std::size_t>(image.width());
  const std::vector<std::size_t> tops = maxima(gaussian_mean(image, 1), galaxy);
  std::vector<double> fluxes(galaxy.size());
  double area = 0, flux = 0, x = 0, y = 0;
  for (std::size_t i = 0; i < galaxy.size(); ++i) {
    if (!galaxy[i]) continue;
    const double value = image.plane(0)[i];
    fluxes[tops[i]] += value;
    flux += value;
    x += value * static_cast<double>(i % width);
    y += value * static_cast<double>(i / width);
    ++area;
  }
  const auto first = std::ranges::max_element(fluxes);
  const auto top = static_cast<std::size_t>(first - fluxes.begin());
  const double brightest = std::exchange(*first, 0);
  const double second = *std::ranges::max_element(fluxes);
  MidStatistics result;
  result.multimode = multimode(image, galaxy);
  result.intensity = second / brightest;
  result.deviation = std::hypot(static_cast<double>(top % width) - x / flux,
                                static_cast<double>(top / width) - y / flux) /
                     std::sqrt(area / std::numbers::pi);
  return result;
}

}  // namespace gamer
