#pragma once

#include <limits>

namespace gamer {

/// The number of missing pixels and empty cells.
inline constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

}  // namespace gamer
