#pragma once

#include "gamer/image/plane.h"
#include "gamer/image/wcs_affine.h"
#include "processing/geometry.h"
#include "processing/kernel.h"

namespace gamer {

/// Pixels of another size on an image's field. The outermost pixels are treated as reaching the
/// edges of the input.
struct ResampleGrid {
  int width = 0, height = 0;
  double step_x = 1, step_y = 1;  ///< size of an output pixel, in input pixels
  double first_x = 0,
         first_y = 0;  ///< left and lower edge, in input pixels from the input's edge

  bool operator==(const ResampleGrid&) const = default;
};

/// A grid of pixels with sides 1/factor as long, about the same middle. The outermost pixels reach
/// over the edges where side * factor is not whole. Throws std::invalid_argument where the factor
/// is not positive or a side exceeds an int.
ResampleGrid grid_of_factor(int width, int height, double factor);
/// A grid of width x height pixels over the whole input.
ResampleGrid grid_of_size(int input_width, int input_height, int width, int height);

PixelMap resample_map(const ResampleGrid& grid);

/// The flux of the input in the pixels of another grid, along x and then along y.
///
/// Let C be the running sum of a row's pixels, known at their edges. Between edges C is
/// interpolated, C(x) = sum a_e(x) C_e over the edges e. An output pixel is C(right) - C(left). The
/// flux of every input pixel is thus kept exactly. The a_e reproduce straight lines (sum a_e = 1,
/// sum a_e (e - x) = 0), so that an even image stays even. The a_e by kernel:
///
/// - `area`: linear, which is the exact overlap of pixels.
/// - `bilinear`: quadratic B-spline, the integral over the output pixel of the surface linear
///   between pixel centres. Smooths a little, also where the step is 1.
/// - `bicubic`, `lanczos3`, `lanczos5`: the kernel, max(1, step) times as wide, which removes the
///   details that output pixels cannot show. A step of 1 changes nothing.
///
/// `nearest` takes the input pixel at the output pixel's middle; it keeps the flux on average only.
///
/// Beyond its edges the image is mirrored, and output pixels end at the edges, so all flux is kept.
/// `brightness` divides by the input area that a pixel covers. Missing pixels: see missing_share.
PlanePtr resample(PlanePtr source, const ResampleGrid& grid, Kernel kernel, PixelValues values);

}  // namespace gamer
