#pragma once

#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

enum class Combination { sum, difference, product, mean };

/// Combines planes of equal size pixel by pixel: their sum, the first minus all others, the product
/// or the mean. A pixel missing (NaN) in one plane is missing in the result. With `skip_missing`
/// (sum and mean only) the present pixels are combined; at least one is needed. Throws InputError
/// for planes of different size, std::invalid_argument for no planes.
PlanePtr combined(std::vector<PlanePtr> planes, Combination combination, bool skip_missing = false);

/// factor v + offset.
PlanePtr scaled(PlanePtr plane, double factor, double offset);

}  // namespace gamer
