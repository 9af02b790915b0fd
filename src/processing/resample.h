#pragma once

#include "gamer/image/plane.h"
#include "gamer/image/wcs_affine.h"
#include "processing/geometry.h"
#include "processing/kernel.h"

namespace gamer {

/// Pixels of another size on the same piece of the world. The outermost ones are taken to reach the
/// edges of the input.
struct ResampleGrid {
  int width = 0, height = 0;
  double step_x = 1, step_y = 1;  ///< an output pixel, in input pixels
  double first_x = 0,
         first_y = 0;  ///< left and lower edge, in input pixels from those of the input

  bool operator==(const ResampleGrid&) const = default;
};

/// Pixels 1/factor as large on a side, about the same middle; the outermost reach over the edges
/// where the sides times the factor are not whole. Throws std::invalid_argument where the factor is
/// not positive or a side exceeds an int.
ResampleGrid grid_of_factor(int width, int height, double factor);
/// width x height pixels over the whole of the input.
ResampleGrid grid_of_size(int input_width, int input_height, int width, int height);

PixelMap resample_map(const ResampleGrid& grid);

/// The flux of the input in the pixels of another grid, along x and then along y.
///
/// Along a row let C be the running sum of the pixels, known at their edges. Between edges it is
/// interpolated, C(x) = sum a_e(x) C_e, and an output pixel is C(right) - C(left): so every input
/// pixel's flux is kept exactly, and, since the a_e are made to reproduce straight lines
/// (sum a_e = 1, sum a_e (e - x) = 0), an even image stays even. The a_e:
///
/// - `area`: linear, which is the exact overlap of pixels.
/// - `bilinear`: quadratic B-spline, the integral over the output pixel of the surface linear
///   between pixel centres. Smooths a little, also where the step is 1.
/// - `bicubic`, `lanczos3`, `lanczos5`: the kernel, max(1, step) times as wide, so that what the
///   output pixels cannot show is taken away. A step of 1 changes nothing.
///
/// `nearest` takes the input pixel at the output pixel's middle, and the flux only on average.
///
/// Beyond its edges the image goes on mirrored, and output pixels count no further than the edges:
/// all flux arrives. `brightness` divides by the input area that a pixel covers. Missing pixels:
/// missing_share.
PlanePtr resample(PlanePtr source, const ResampleGrid& grid, Kernel kernel, PixelValues values);

}  // namespace gamer
