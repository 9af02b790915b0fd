#pragma once

#include <functional>

#include "gamer/image/plane.h"
#include "image/convolution/psf.h"

namespace gamer {

/// Continuation of an image beyond its edges. With `zero` the pixels there are 0, and light that
/// crosses an edge is lost. With `reflect` it is mirrored at the outer sides of the edge pixels
/// (... b a | a b ...). With `wrap` it is repeated.
enum class EdgeMode { zero, reflect, wrap };

struct ConvolutionOptions {
  EdgeMode edge = EdgeMode::zero;
  /// Transforms in single precision: errors of about 1e-7 of the brightest pixel within a tile.
  bool is_single = false;
  /// Sides of the Fourier transforms, each at least the stamp's; 0: chosen for speed. They change
  /// results by rounding only.
  int transform_width = 0;
  int transform_height = 0;
};

/// The convolution out(x, y) = sum over (i, j) of stamp(i, j) source(x - i, y - j).
///
/// *Missing pixels* are NaN and infinities; they become NaN and spread no further. Where the stamp
/// covers missing pixels, the good pixels are scaled up to stand for all: out = S sum_good(stamp
/// source) / sum_good(stamp), where S is the stamp's sum. Where sum_good(stamp) < 1e-3 S, out is
/// NaN. Places beyond the edge (EdgeMode::zero) are no missing pixels.
///
/// *Method.* Stamps of up to 25 pixels are summed directly, larger ones use tiles with FFTW
/// (overlap-save). The grid of tiles is fixed, so values depend neither on the area read nor on
/// threads. Tiles near the ends of the floating-point range are scaled by a power of two. Errors in
/// double precision and of direct sums are about 1e-15 of the tile's brightest pixel.
///
/// Throws std::invalid_argument for a stamp with even sides, with values that are not finite, or
/// with another number of values than width * height. Another error is transforms smaller than the
/// stamp.
PlanePtr convolved(PlanePtr source, Stamp stamp, const ConvolutionOptions& options = {});

/// Convolves with a stamp that is made when pixels are read, and made again if other planes were
/// convolved in between. Cubes with a large stamp per plane thus need memory for only a few stamps.
/// `make` must return a stamp of `width` x `height`. Reading throws what `make` throws.
PlanePtr convolved(PlanePtr source, int width, int height, std::function<Stamp()> make,
                   const ConvolutionOptions& options = {});

}  // namespace gamer
