#pragma once

#include <functional>

#include "gamer/image/plane.h"
#include "processing/psf.h"

namespace gamer {

/// What lies beyond the image's edges: nothing (light that leaves is lost, none comes in); the
/// image mirrored at the outer sides of its edge pixels (... b a | a b ...); the image again.
enum class EdgeMode { zero, reflect, wrap };

struct ConvolutionOptions {
  EdgeMode edge = EdgeMode::zero;
  /// Transform in single precision: errors of about 1e-7 of the brightest pixel within a tile.
  bool is_single = false;
  /// Sides of the Fourier transforms, each at least the stamp's; 0: chosen for speed. Results
  /// differ by rounding only.
  int transform_width = 0;
  int transform_height = 0;
};

/// The convolution out(x, y) = sum over (i, j) of stamp(i, j) source(x - i, y - j).
///
/// *Missing pixels* are NaN and infinities. They are NaN afterwards and spread no further: where
/// the stamp covers some of them, the others count for all, out = S sum_good(stamp source) /
/// sum_good(stamp), S the stamp's sum; NaN where the good ones hold less than 1e-3 of S. What lies
/// beyond the edge (EdgeMode::zero) is no missing pixel.
///
/// *Method.* Stamps of up to 25 pixels directly, larger ones by tiles with FFTW (overlap-save). The
/// tiles' grid is fixed, so the values do not depend on the area that is asked for, nor on threads.
/// Tiles of values near the ends of the floating-point range are scaled by a power of two for it.
/// Error in double precision, and of direct sums: about 1e-15 of the brightest pixel of a tile.
///
/// Throws std::invalid_argument: a stamp with even sides, with values that are not finite or not
/// width * height, transforms smaller than it.
PlanePtr convolved(PlanePtr source, Stamp stamp, const ConvolutionOptions& options = {});

/// Convolves with a stamp that is made when the first pixels are asked for, and again where other
/// planes were convolved in between. Cubes with a large stamp for each plane then need memory for a
/// few stamps only. `make` must return a stamp of `width` x `height`; what it throws, reading
/// throws.
PlanePtr convolved(PlanePtr source, int width, int height, std::function<Stamp()> make,
                   const ConvolutionOptions& options = {});

}  // namespace gamer
