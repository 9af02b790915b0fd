#pragma once

#include <limits>

namespace gamer {

/// The number that stands for none, in missing pixels and empty cells.
inline constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

}  // namespace gamer
