#pragma once

#include <array>
#include <numbers>

namespace gamer {

/// The deviations of the three dust variants, in standard deviations of the hidden noise from its
/// mean (three-point Gauss-Hermite rule). Dust that a ray does not resolve absorbs less light than
/// smooth dust of equal mean. The light of such a ray is therefore the mean over three variants of
/// all dust.
inline constexpr std::array<double, 3> dust_deviations = {0, std::numbers::sqrt3,
                                                          -std::numbers::sqrt3};
inline constexpr std::array<double, 3> dust_variant_weights = {2.0 / 3, 1.0 / 6, 1.0 / 6};

}  // namespace gamer
