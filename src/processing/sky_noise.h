#pragma once

#include <optional>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// The contribution of the noise of empty sky to sums of differences, per pixel. It is measured in
/// the image's corners, or follows from white noise of a given sigma.
///
/// *Corners.* Each corner has the largest square, of 8 to 64 pixels, that keeps clear of a circle
/// about the galaxy. A plane fitted by least squares is subtracted, so that gradients of the sky or
/// of faint outskirts do not count as noise.
class SkyNoise {
 public:
  /// White Gaussian noise of sigma >= 0; 0 means none.
  explicit SkyNoise(double sigma) : white_(sigma) {}
  /// Measured beyond the circle of `clear_radius` about (x, y), from 0. Without a free corner the
  /// noise counts as 0.
  SkyNoise(const Image& image, double x, double y, double clear_radius);

  /// Number of corners measured.
  int corners() const { return static_cast<int>(boxes_.size()); }
  /// Standard deviation of a pixel; NaN where no corner is free.
  double sigma() const;
  /// Mean |B - B180|, where B180 is turned by 180 degrees about a point whose coordinates have
  /// these fractions of half a pixel, each in [0, 1[; see turned_weights().
  double asymmetry(double fraction_x, double fraction_y) const;
  /// Mean max(0, B - Bs), where Bs is the mean over a square of `width` pixels.
  double roughness(double width) const;

 private:
  std::optional<double> white_;
  std::vector<Image> boxes_;
};

}  // namespace gamer
