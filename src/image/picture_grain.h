#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "gamer/image/picture_style.h"

namespace gamer {

/// The noise of a picture's pixels, normal of sigma 1 in each channel.
///
/// Without seeing, pixels are independent. With seeing, the picture is one that has been resampled
/// and stacked. White noise is then convolved with (1, 4, 1)/6 along rows and columns, the cubic
/// B-spline, and scaled to sigma 1. A slope across the picture is added, as flat fields leave it.
/// At an edge it differs from the middle by `common_slope` sigmas in all channels, and by
/// `own_slope` sigmas in a direction of each channel. All pictures have equal directions.
class PictureGrain {
 public:
  PictureGrain(const PictureStyle& style, int width, int height, int channels);

  /// The noise of a row, [x][channel]. It is valid until the next call. Rows may come in any order.
  std::span<const double> row(int y);

  static constexpr double common_slope = 0.5, own_slope = 0.2;

 private:
  struct WhiteRow {
    int number = -1;
    std::vector<double> values;
  };
  /// White noise of a row, which may be one row beyond a stacked picture. The last three are kept.
  std::span<const double> white(int y);
  double slope(int x, int y, int channel) const;

  std::uint64_t key_;
  bool is_stacked_;
  int width_, height_, channels_;
  std::vector<std::array<double, 2>> slopes_;  ///< [channel] along x and y
  std::array<WhiteRow, 3> white_;
  std::vector<double> noise_, sum_;
};

}  // namespace gamer
