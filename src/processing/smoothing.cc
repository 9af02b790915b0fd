#include "processing/smoothing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "gamer/core/parallel_for.h"

namespace gamer {
namespace {

/// A line smoothed by symmetric weights: weights[|i|] of the pixel at distance i. With `by_part`
/// the weights of the pixels within the line sum to 1; otherwise those of an endless line do.
void smooth_line(const double* in, std::ptrdiff_t step, int size,
                 const std::vector<double>& weights, bool by_part, double* out) {
  const int reach = static_cast<int>(weights.size()) - 1;
  double whole = weights[0];
  for (int i = 1; i <= reach; ++i) whole += 2 * weights[static_cast<std::size_t>(i)];
  for (int i = 0; i < size; ++i) {
    double sum = 0, weight = 0;
    for (int j = std::max(0, i - reach); j <= std::min(size - 1, i + reach); ++j) {
      const double part = weights[static_cast<std::size_t>(std::abs(j - i))];
      sum += part * in[j * step];
      weight += part;
    }
    out[i * step] = sum / (by_part ? weight : whole);
  }
}

/// The means of a line over boxes of `width`: sums of whole pixels and of parts at both ends.
void mean_line(const double* in, std::ptrdiff_t step, int size, double width, double* out) {
  const int reach = static_cast<int>(std::ceil((width - 1) / 2));
  const double side = (width - 1) / 2 - (reach - 1);
  const double share = reach > 0 ? side : 0;
  std::vector<double> sums(static_cast<std::size_t>(size) + 1);
  for (int i = 0; i < size; ++i) {
    sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + in[i * step];
  }
  for (int i = 0; i < size; ++i) {
    const int inner = std::max(reach - 1, 0);
    const int first = std::max(0, i - inner), last = std::min(size - 1, i + inner);
    double sum = sums[static_cast<std::size_t>(last) + 1] - sums[static_cast<std::size_t>(first)];
    double weight = last - first + 1;
    if (i - reach >= 0 && reach > 0) {
      sum += share * in[(i - reach) * step];
      weight += share;
    }
    if (i + reach < size && reach > 0) {
      sum += share * in[(i + reach) * step];
      weight += share;
    }
    out[i * step] = sum / weight;
  }
}

/// Applies `line(in, step, size, out)` along x, then along y.
template <class Line>
Image by_lines(const Image& image, Line line) {
  const int width = image.width(), height = image.height();
  Image along_x(width, height, 1), result(width, height, 1);
  parallel_for(static_cast<std::size_t>(height), [&](std::size_t y) {
    const std::size_t start = y * static_cast<std::size_t>(width);
    line(image.plane(0) + start, 1, width, along_x.plane(0) + start);
  });
  parallel_for(static_cast<std::size_t>(width), [&](std::size_t x) {
    line(along_x.plane(0) + x, width, height, result.plane(0) + x);
  });
  return result;
}

}  // namespace

Image present_pixels(const Image& image) {
  Image present = image;
  const auto size = static_cast<std::ptrdiff_t>(image.width()) * image.height();
  for (double* value = present.plane(0); value != present.plane(0) + size; ++value) {
    if (!std::isfinite(*value)) *value = 0;
  }
  return present;
}

Image box_mean(const Image& image, double width) {
  return by_lines(image, [width](const double* in, std::ptrdiff_t step, int size, double* out) {
    mean_line(in, step, size, std::max(1.0, width), out);
  });
}

Image gaussian_mean(const Image& image, double sigma) {
  constexpr double cut = 4;
  std::vector<double> weights;
  for (int i = 0; i <= static_cast<int>(cut * sigma + 0.5); ++i) {
    weights.push_back(sigma > 0 ? std::exp(-0.5 * (i / sigma) * (i / sigma)) : 1);
  }
  return by_lines(image, [&weights](const double* in, std::ptrdiff_t step, int size, double* out) {
    smooth_line(in, step, size, weights, false, out);
  });
}

}  // namespace gamer
