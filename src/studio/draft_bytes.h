#pragma once

#include <string>

#include "studio/draft.h"

namespace gamer {

/// The bytes of `count` slices of a draft from z = `first` on, compressed. Half-precision numbers
/// keep six bits of their mantissa. An error of 0.8 % of a voxel is far below that of the grid.
///
/// A number's code is its half-precision bits, rounded to a multiple of 16 and divided by 16. From
/// the codes of the second and third plane the code of the first plane is subtracted. From those of
/// the other variants the code of the dust is subtracted. Along x each code is replaced by its
/// difference d from the code before, as 2 d or -2 d - 1. These 16-bit numbers stand in the order
/// [number of the voxel][z][y][x]: the high bytes of all, then the low bytes, in zlib's format.
std::string packed_slices(const Draft& draft, int first, int count);

}  // namespace gamer
