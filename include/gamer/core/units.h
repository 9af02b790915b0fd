#pragma once

#include <numbers>

namespace gamer {

inline constexpr double full_turn = 2 * std::numbers::pi;             ///< rad
inline constexpr double degree = std::numbers::pi / 180;              ///< rad
inline constexpr double arcsecond = std::numbers::pi / (180 * 3600);  ///< rad
inline constexpr double square_arcsecond = arcsecond * arcsecond;     ///< sr

}  // namespace gamer
