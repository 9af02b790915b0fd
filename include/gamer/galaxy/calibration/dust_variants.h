#pragma once

#include <array>
#include <numbers>

namespace gamer {

/// Dust that a ray does not resolve takes less light than smooth dust of equal mean. The light of
/// such a ray is therefore the mean over three *variants*. In each, the hidden noise of all dust is
/// so many standard deviations from its mean (the three-point Gauss-Hermite rule).
inline constexpr std::array<double, 3> dust_deviations = {0, std::numbers::sqrt3,
                                                          -std::numbers::sqrt3};
inline constexpr std::array<double, 3> dust_variant_weights = {2.0 / 3, 1.0 / 6, 1.0 / 6};

}  // namespace gamer
