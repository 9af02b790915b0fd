#pragma once

#include "gamer/image/plane.h"
#include "gamer/image/wcs_affine.h"
#include "processing/kernel.h"

namespace gamer {

struct Rotation {
  double angle = 0;  ///< deg, counter-clockwise with row 0 at the bottom, about the middle
  Kernel kernel = Kernel::lanczos3;
  /// Whether the image grows to hold the whole turned image; otherwise it keeps its size.
  bool full_canvas = false;
  double fill = 0;  ///< value outside the image; NaN: missing
};

struct PlaneSize {
  int width = 0;
  int height = 0;

  bool operator==(const PlaneSize&) const = default;
};

/// Size of the turned image. Multiples of 90 degrees swap the sides on any canvas. Otherwise it is
/// the old size, or |w cos| + |h sin| by |w sin| + |h cos|, rounded up.
PlaneSize rotated_size(int width, int height, const Rotation& rotation);
PixelMap rotation_map(int width, int height, const Rotation& rotation);

/// Turns an image. Multiples of 90 degrees copy pixels. Otherwise a pixel whose centre falls on (x,
/// y) is sum k(x - i) k(y - j) v_ij / (sum k(x - i) sum k(y - j)). An even image thus stays even.
/// The k are corrected as in interpolation_weights(). A turn keeps the area of pixels, and
/// therefore the flux of a well-sampled image. Lanczos kernels keep the flux of a Gaussian to
/// 1.2e-4 for sigma = 1.5 pixels and to 2e-5 for 2 pixels. Kernels are tabulated to 4e-8 of the
/// central weight. Missing pixels: see missing_share; the outside is `fill`. Throws
/// std::invalid_argument for Kernel::area, an angle that is not finite, or a size that exceeds an
/// int.
PlanePtr rotate(PlanePtr source, const Rotation& rotation);

}  // namespace gamer
