#pragma once

#include "gamer/image/plane.h"
#include "gamer/image/wcs_affine.h"

namespace gamer {

/// Behaviour of pixel values when the size of pixels changes.
enum class PixelValues {
  flux,       ///< they add up
  brightness  ///< they average
};

/// Limit of missing input. An output pixel is missing where missing pixels have at least this share
/// of the absolute weights of its input. Below this limit the present pixels are scaled up to stand
/// for all. A missing pixel has at least a quarter of the weight in the nearest pixel of a turned
/// image, so that no missing pixel vanishes.
inline constexpr double missing_share = 0.25;

/// Direction in which an image is mirrored.
enum class FlipAxis {
  x,  ///< left becomes right
  y,  ///< bottom becomes top
  both
};
PlanePtr flip(PlanePtr source, FlipAxis axis);
PixelMap flip_map(int width, int height, FlipAxis axis);

/// The pixels of `box`. Throws std::invalid_argument where it is empty or reaches outside the
/// image.
PlanePtr crop(PlanePtr source, const Area& box);
PixelMap crop_map(const Area& box);
/// The box of width x height pixels about a place, which may reach outside the image. Where two
/// boxes are equally near, it is the upper right one.
Area box_about(const PixelPosition& middle, int width, int height);

/// Numbers of pixels to add at each side.
struct Margins {
  int left = 0, right = 0, bottom = 0, top = 0;

  bool operator==(const Margins&) const = default;
};
/// Adds pixels of value `fill` (NaN: missing) around an image. Throws std::invalid_argument where a
/// margin is negative or a side exceeds an int.
PlanePtr pad(PlanePtr source, const Margins& margins, double fill);
PixelMap pad_map(const Margins& margins);

/// The pixels of `box`, which may reach outside the image; there they are `fill` (NaN: missing).
/// The map is crop_map(). Throws std::invalid_argument where the box and the image have no common
/// pixel.
PlanePtr window(PlanePtr source, const Area& box, double fill);

/// Turns by `count` times 90 degrees, counter-clockwise with row 0 at the bottom; negative counts
/// turn clockwise. Odd counts swap the sides. Pixels are copied.
PlanePtr quarter_turns(PlanePtr source, int count);
PixelMap quarter_turns_map(int width, int height, int count);

/// Combines blocks of nx x ny pixels, from the lower left, to their sum or mean. Incomplete blocks
/// at the right and top are left out. Missing pixels: see missing_share. Throws
/// std::invalid_argument where no block is complete.
PlanePtr bin(PlanePtr source, int nx, int ny, PixelValues values);
PixelMap bin_map(int nx, int ny);

}  // namespace gamer
