#include "image/picture_grain.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "gamer/core/random.h"
#include "gamer/core/random_variate.h"

namespace gamer {
namespace {

/// The cubic B-spline at the next pixels and in the middle, divided by the root of the sum of its
/// squares.
const double spline_side = 1 / std::sqrt(18.0), spline_middle = 4 / std::sqrt(18.0);

}  // namespace

PictureGrain::PictureGrain(const PictureStyle& style, int width, int height, int channels)
    : key_(hash_words({style.grain_seed, hash_text(0, "grain of pictures")})),
      is_stacked_(style.seeing > 0),
      width_(width),
      height_(height),
      channels_(channels),
      noise_(static_cast<std::size_t>(width) * static_cast<std::size_t>(channels)) {
  if (!is_stacked_) return;
  // The sky's slope has one direction in all frames of a film, although the frames' seeds differ.
  const auto direction = [&](std::uint64_t number) {
    return 2 * std::numbers::pi * to_unit(hash_words({hash_text(0, "slope of the sky"), number}));
  };
  const double common = direction(0);
  for (int c = 0; c < channels; ++c) {
    const double own = direction(static_cast<std::uint64_t>(c) + 1);
    slopes_.push_back({common_slope * std::cos(common) + own_slope * std::cos(own),
                       common_slope * std::sin(common) + own_slope * std::sin(own)});
  }
}

std::span<const double> PictureGrain::white(int y) {
  // A stacked picture has the rows -1 to height, which are numbered from 0.
  const int number = is_stacked_ ? y + 1 : y;
  WhiteRow& row = white_[static_cast<std::size_t>(number) % white_.size()];
  if (row.number != number) {
    row.number = number;
    row.values.resize(noise_.size() + (is_stacked_ ? 2 * static_cast<std::size_t>(channels_) : 0));
    normal_variates(key_, static_cast<std::uint64_t>(number) * row.values.size(), row.values);
  }
  return row.values;
}

double PictureGrain::slope(int x, int y, int channel) const {
  const auto& [along_x, along_y] = slopes_[static_cast<std::size_t>(channel)];
  const double half_x = std::max(0.5 * (width_ - 1), 0.5);
  const double half_y = std::max(0.5 * (height_ - 1), 0.5);
  const double across = width_ > 1 ? x / half_x - 1 : 0, up = height_ > 1 ? y / half_y - 1 : 0;
  return along_x * across + along_y * up;
}

std::span<const double> PictureGrain::row(int y) {
  if (!is_stacked_) return white(y);
  const std::span<const double> below = white(y - 1), middle = white(y), above = white(y + 1);
  sum_.resize(middle.size());
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    sum_[i] = spline_side * (below[i] + above[i]) + spline_middle * middle[i];
  }
  // `sum_` begins one pixel to the left of the row.
  const auto next = static_cast<std::size_t>(channels_);
  std::size_t i = 0;
  for (int x = 0; x < width_; ++x) {
    for (int c = 0; c < channels_; ++c, ++i) {
      noise_[i] = spline_side * (sum_[i] + sum_[i + 2 * next]) + spline_middle * sum_[i + next] +
                  slope(x, y, c);
    }
  }
  return noise_;
}

}  // namespace gamer
