#pragma once

#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

enum class Combination { sum, difference, product, mean };

/// Pixel by pixel: the sum, the first minus all others, the product or the mean of planes of one
/// size. A pixel that is missing (NaN) in one of them is missing; with `skip_missing` (sum and mean
/// only) it is made of those that are there, and missing where none is. Throws InputError for
/// planes of different size, std::invalid_argument for none.
PlanePtr combined(std::vector<PlanePtr> planes, Combination combination, bool skip_missing = false);

/// factor v + offset.
PlanePtr scaled(PlanePtr plane, double factor, double offset);

}  // namespace gamer
