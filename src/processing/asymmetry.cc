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

Asymmetry asymmetry_about(const Image& image, double x, double y, double radius,
                          const SkyNoise& sky) {
  const Ellipses circle(x, y);
  const int left = std::max(0, static_cast<int>(std::floor(x - radius)));
  const int right = std::min(image.width() - 1, static_cast<int>(std::ceil(x + radius)));
  const int bottom = std::max(0, static_cast<int>(std::floor(y - radius)));
  const int top = std::min(image.height() - 1, static_cast<int>(std::ceil(y + radius)));
  if (left > right || bottom > top) return {x, y, 0, 0};
  // A pixel at p meets the turned coordinate 2 x - p.
  const double whole_x = std::floor(2 * x), whole_y = std::floor(2 * y);
  const auto weights_x = turned_weights(2 * x - whole_x);
  const auto weights_y = turned_weights(2 * y - whole_y);
  std::vector<Sums> rows(static_cast<std::size_t>(top - bottom) + 1);
  parallel_for(rows.size(), [&](std::size_t i) {
    const int row = bottom + static_cast<int>(i);
    Sums& sums = rows[i];
    for (int column = left; column <= right; ++column) {
      const double overlap = circle.overlap(column, row, radius);
      if (overlap == 0) continue;
      const double value = image.at(column, row);
      const double turned = turned_value(image, static_cast<int>(whole_x) - column,
                                         static_cast<int>(whole_y) - row, weights_x, weights_y);
      sums.difference += overlap * std::fabs(value - turned);
      sums.light += overlap * std::fabs(value);
      sums.area += overlap;
    }
  });
  Sums all;
  for (const Sums& row : rows) {
    all.difference += row.difference;
    all.light += row.light;
    all.area += row.area;
  }
  const double noise = sky.asymmetry(2 * x - whole_x, 2 * y - whole_y) * all.area / all.light;
  return {x, y, all.difference / all.light - noise, noise};
}

Asymmetry least_asymmetry(const Image& image, double x, double y, double radius,
                          const SkyNoise& sky) {
  constexpr double last_step = 0.01;
  constexpr double first_share = 1.0 / 32;
  constexpr int most_steps = 100;  // of one length
  std::map<std::pair<double, double>, Asymmetry> known;
  const auto at = [&](double px, double py) -> const Asymmetry& {
    const auto [place, is_new] = known.try_emplace({px, py});
    if (is_new) place->second = asymmetry_about(image, px, py, radius, sky);
    return place->second;
  };
  Asymmetry best = at(x, y);
  // Steps are powers of two, so that places come out equal and are computed once.
  double step = std::exp2(std::floor(std::log2(std::max(radius * first_share, 2 * last_step))));
  for (; step > last_step; step /= 2) {
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
