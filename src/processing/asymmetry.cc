#include "processing/asymmetry.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "gamer/core/parallel_for.h"
#include "processing/aperture.h"
#include "processing/kernel.h"

namespace gamer {
namespace {

struct Sums {
  double difference = 0, light = 0, area = 0;
};

}  // namespace

std::array<double, 4> turned_weights(double fraction) {
  std::array<double, 4> weights{};
  for (int i = 0; i < 4; ++i) {
    weights[static_cast<std::size_t>(i)] = kernel_value(Kernel::bicubic, i - 1 - fraction);
  }
  return weights;
}

double turned_value(const Image& image, int x, int y, const std::array<double, 4>& weights_x,
                    const std::array<double, 4>& weights_y) {
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    const int row = y - 1 + j;
    const double weight_y = weights_y[static_cast<std::size_t>(j)];
    if (weight_y == 0 || row < 0 || row >= image.height()) continue;
    double row_sum = 0;
    for (int i = 0; i < 4; ++i) {
      const int column = x - 1 + i;
      if (column < 0 || column >= image.width()) continue;
      row_sum += weights_x[static_cast<std::size_t>(i)] * image.at(column, row);
    }
    sum += weight_y * row_sum;
  }
  return sum;
}

namespace {

/// Adds the pixels [left, right] of one row and their differences from the turned image.
void add_row(const Image& image, const Ellipses& circle, double radius, int row, int left,
             int right, Sums& sums) {
  constexpr double diagonal = 0.75;  ///< more than half of a pixel's
  const double whole_x = std::floor(2 * circle.x()), whole_y = std::floor(2 * circle.y());
  const auto weights_x = turned_weights(2 * circle.x() - whole_x);
  const auto weights_y = turned_weights(2 * circle.y() - whole_y);
  // The pixel at p is compared with the image at 2 x - p, x the centre. Rows are interpolated
  // first.
  const int first = static_cast<int>(whole_x) - right - 1;
  std::vector<double> line(static_cast<std::size_t>(right - left) + 4);
  for (std::size_t k = 0; k < weights_y.size(); ++k) {
    const int y = static_cast<int>(whole_y) - row - 1 + static_cast<int>(k);
    if (weights_y[k] == 0 || y < 0 || y >= image.height()) continue;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const int x = first + static_cast<int>(i);
      if (x >= 0 && x < image.width()) line[i] += weights_y[k] * image.at(x, y);
    }
  }
  const double dy = row - circle.y();
  const double inside = std::max(0.0, radius - diagonal);
  for (int column = left; column <= right; ++column) {
    const double dx = column - circle.x();
    const bool is_whole = dx * dx + dy * dy < inside * inside;
    const double overlap = is_whole ? 1 : circle.overlap(column, row, radius);
    if (overlap == 0) continue;
    const auto place = static_cast<std::size_t>(right - column);
    double turned = 0;
    for (std::size_t k = 0; k < weights_x.size(); ++k) turned += weights_x[k] * line[place + k];
    const double value = image.at(column, row);
    sums.difference += overlap * std::fabs(value - turned);
    sums.light += overlap * std::fabs(value);
    sums.area += overlap;
  }
}

}  // namespace

Asymmetry asymmetry_about(const Image& image, double x, double y, double radius,
                          const SkyNoise& sky) {
  const Ellipses circle(x, y);
  const int left = std::max(0, static_cast<int>(std::floor(x - radius)));
  const int right = std::min(image.width() - 1, static_cast<int>(std::ceil(x + radius)));
  const int bottom = std::max(0, static_cast<int>(std::floor(y - radius)));
  const int top = std::min(image.height() - 1, static_cast<int>(std::ceil(y + radius)));
  if (left > right || bottom > top) return {x, y, 0, 0};
  std::vector<Sums> rows(static_cast<std::size_t>(top - bottom) + 1);
  parallel_for(rows.size(), [&](std::size_t i) {
    add_row(image, circle, radius, bottom + static_cast<int>(i), left, right, rows[i]);
  });
  Sums all;
  for (const Sums& row : rows) {
    all.difference += row.difference;
    all.light += row.light;
    all.area += row.area;
  }
  const double noise =
      sky.asymmetry(2 * x - std::floor(2 * x), 2 * y - std::floor(2 * y)) * all.area / all.light;
  return {x, y, all.difference / all.light - noise, noise};
}

Asymmetry least_asymmetry(const Image& image, double x, double y, double radius,
                          const SkyNoise& sky) {
  constexpr int last_power = -6;  // 1/64 pixel
  constexpr double first_share = 1.0 / 32;
  constexpr int most_steps = 100;  // of one length
  std::map<std::pair<double, double>, Asymmetry> known;
  const auto at = [&](double px, double py) -> const Asymmetry& {
    const auto [place, is_new] = known.try_emplace({px, py});
    if (is_new) place->second = asymmetry_about(image, px, py, radius, sky);
    return place->second;
  };
  Asymmetry best = at(x, y);
  // Steps are powers of two, so that the places of different steps coincide and are computed once.
  const int first = static_cast<int>(std::floor(std::log2(radius * first_share)));
  for (int power = std::max(first, last_power); power >= last_power; --power) {
    const double step = std::exp2(power);
    for (int i = 0; i < most_steps; ++i) {
      const Asymmetry middle = best;
      for (const int dy : {-1, 0, 1}) {
        for (const int dx : {-1, 0, 1}) {
          const Asymmetry& next = at(middle.x + dx * step, middle.y + dy * step);
          if (next.value < best.value) best = next;
        }
      }
      if (best.x == middle.x && best.y == middle.y) break;
    }
  }
  return best;
}

}  // namespace gamer
