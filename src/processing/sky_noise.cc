#include "processing/sky_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/no_value.h"
#include "processing/asymmetry.h"
#include "processing/smoothing.h"

namespace gamer {
namespace {

constexpr int least_side = 8, most_side = 64;

/// Side of the largest square in a corner at (dx, dy) from the centre that keeps clear of a circle.
int side_of_corner(double dx, double dy, double clear_radius, int limit) {
  for (int side = std::min(most_side, limit); side >= least_side; --side) {
    const double x = std::max(0.0, dx - side), y = std::max(0.0, dy - side);
    if (std::hypot(x, y) >= clear_radius) return side;
  }
  return 0;
}

/// The square of that side at (left, bottom) less a plane fitted to it; nothing where a pixel is
/// missing.
std::optional<Image> without_plane(const Image& image, int left, int bottom, int side) {
  Image box(side, side, 1);
  const double middle = (side - 1) / 2.0;
  double sum = 0, along_x = 0, along_y = 0, squares = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double value = image.at(left + x, bottom + y);
      if (!std::isfinite(value)) return std::nullopt;
      box.at(x, y) = value;
      sum += value;
      along_x += value * (x - middle);
      along_y += value * (y - middle);
      squares += (x - middle) * (x - middle);
    }
  }
  const double mean = sum / side / side;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      box.at(x, y) -= mean + (along_x * (x - middle) + along_y * (y - middle)) / squares;
    }
  }
  return box;
}

}  // namespace

SkyNoise::SkyNoise(const Image& image, double x, double y, double clear_radius) {
  const int limit = std::min(image.width(), image.height()) / 2;
  for (const bool right : {false, true}) {
    for (const bool top : {false, true}) {
      const double dx = right ? image.width() - 0.5 - x : x + 0.5;
      const double dy = top ? image.height() - 0.5 - y : y + 0.5;
      const int side = side_of_corner(dx, dy, clear_radius, limit);
      if (side == 0) continue;
      auto box = without_plane(image, right ? image.width() - side : 0,
                               top ? image.height() - side : 0, side);
      if (box) boxes_.push_back(std::move(*box));
    }
  }
}

double SkyNoise::sigma() const {
  if (white_) return *white_;
  double squares = 0, count = 0;
  for (const Image& box : boxes_) {
    for (int y = 0; y < box.height(); ++y) {
      for (int x = 0; x < box.width(); ++x) squares += box.at(x, y) * box.at(x, y);
    }
    count += static_cast<double>(box.width()) * box.height();
  }
  return count > 0 ? std::sqrt(squares / count) : no_value;
}

double SkyNoise::asymmetry(double fraction_x, double fraction_y) const {
  const auto weights_x = turned_weights(fraction_x), weights_y = turned_weights(fraction_y);
  if (white_) {
    double sum_x = 0, sum_y = 0;
    for (std::size_t i = 0; i < weights_x.size(); ++i) {
      sum_x += weights_x[i] * weights_x[i];
      sum_y += weights_y[i] * weights_y[i];
    }
    // The mean |v| of a normal distribution.
    return *white_ * std::sqrt(2 / std::numbers::pi * (1 + sum_x * sum_y));
  }
  double sum = 0, count = 0;
  for (const Image& box : boxes_) {
    const int last = box.width() - 1;
    // Turned pixels need four neighbours within the box.
    for (int y = 1; y + 2 <= last; ++y) {
      for (int x = 1; x + 2 <= last; ++x) {
        const double turned = turned_value(box, last - x, last - y, weights_x, weights_y);
        sum += std::fabs(box.at(x, y) - turned);
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0;
}

double SkyNoise::roughness(double width) const {
  if (white_) {
    const double pixels = std::max(1.0, width * width);
    return *white_ * std::sqrt((1 - 1 / pixels) / (2 * std::numbers::pi));
  }
  double sum = 0, count = 0;
  for (const Image& box : boxes_) {
    const Image smooth = box_mean(box, width);
    for (int y = 0; y < box.height(); ++y) {
      for (int x = 0; x < box.width(); ++x) {
        sum += std::max(0.0, box.at(x, y) - smooth.at(x, y));
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace gamer
