#pragma once

#include <utility>

#include "gamer/image/plane.h"
#include "gamer/image/wcs_affine.h"

namespace gamer {

/// What happens to pixel values when pixels become larger or smaller.
enum class PixelValues {
  flux,       ///< they add up
  brightness  ///< they average
};

/// An output pixel is missing where missing pixels carry this much of the weight that it gives its
/// input, weights taken without their sign; otherwise the present ones stand for all. A quarter:
/// the pixel of a turned image that lies nearest to a missing one gives it at least that much, so
/// no missing pixel vanishes.
inline constexpr double missing_share = 0.25;

/// Mirrors an image.
enum class FlipAxis {
  x,  ///< left becomes right
  y,  ///< bottom becomes top
  both
};
PlanePtr flip(PlanePtr source, FlipAxis axis);
PixelMap flip_map(int width, int height, FlipAxis axis);

/// The pixels of `box`. Throws std::invalid_argument where it reaches outside or is empty.
PlanePtr crop(PlanePtr source, const Area& box);
PixelMap crop_map(const Area& box);

/// Pixels to add.
struct Margins {
  int left = 0, right = 0, bottom = 0, top = 0;

  bool operator==(const Margins&) const = default;
};
/// Pixels of value `fill` (NaN: missing) around an image. Throws std::invalid_argument where a
/// margin is negative or the sum exceeds an int.
PlanePtr pad(PlanePtr source, const Margins& margins, double fill);
PixelMap pad_map(const Margins& margins);

/// Turns by `count` times 90 degrees, counter-clockwise with row 0 at the bottom; negative counts
/// turn clockwise. Sizes swap for odd ones. Pixels are copied.
PlanePtr quarter_turns(PlanePtr source, int count);
PixelMap quarter_turns_map(int width, int height, int count);

/// Blocks of nx x ny pixels, from the lower left, become one: their sum or their mean. Blocks that
/// are not whole, at the right and top, are left out. Missing pixels: missing_share. Throws
/// std::invalid_argument where no block is whole.
PlanePtr bin(PlanePtr source, int nx, int ny, PixelValues values);
PixelMap bin_map(int nx, int ny);

}  // namespace gamer
