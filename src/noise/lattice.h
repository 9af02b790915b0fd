#pragma once

#include <cstdint>

namespace gamer {

// A lattice point (i, j, k) of seed s is combined as (i * px) ^ (j * py) ^ (k * pz) ^ s modulo
// 2^32: odd multipliers spread each coordinate over all bits, and exclusive or, unlike a sum,
// leaves no lattice vector along which the hash repeats. One multiplication after folding the high
// half down then mixes all bits into the top four (tests: neighbours at many distances are
// independent).
inline constexpr std::uint32_t lattice_px = 0x9E3779B1u;
inline constexpr std::uint32_t lattice_py = 0x85EBCA77u;
inline constexpr std::uint32_t lattice_pz = 0xC2B2AE3Du;
inline constexpr std::uint32_t lattice_multiplier = 0x7FEB352Du;
inline constexpr int lattice_fold = 15;

/// The 12 gradients of Perlin 2002, four of them twice, by four hash bits: for bits b, u = x if b <
/// 8 else y; v = y if b < 4, x if b is 12 or 14, else z; bit 0 negates u, bit 1 negates v.
struct alignas(64) GradientTable {
  float x[16] = {1, -1, 1, -1, 1, -1, 1, -1, 0, 0, 0, 0, 1, 0, -1, 0};
  float y[16] = {1, 1, -1, -1, 0, 0, 0, 0, 1, -1, 1, -1, 1, -1, 1, -1};
  float z[16] = {0, 0, 0, 0, 1, 1, -1, -1, 1, 1, -1, -1, 0, 1, 0, -1};
};
inline constexpr GradientTable gradient_table;

/// 2002's improved noise, s(f) and the constants of both kinds.
inline constexpr double perlin_variance = 35054270.0 / 480729249.0;
inline constexpr double perlin_bound = 1.03632;
inline constexpr double simplex_scale = 76.8857;
inline constexpr double simplex_variance = 0.3925 * 0.3925;
inline constexpr double simplex_bound = 1.0;

}  // namespace gamer
