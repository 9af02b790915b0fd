#pragma once

#include <cstdint>

namespace gamer {

// A lattice point (i, j, k) is combined as (i px + sx) ^ (j py + sy) ^ (k pz + sz) modulo 2^32,
// with three words s from the seed. Odd multipliers spread each coordinate over all bits. Exclusive
// or, unlike a sum, leaves no lattice vector along which the hash repeats; the seed is added before
// it because -n is nearly the complement of n: without, (-i, -j) would combine to the same as (i,
// j).
//
// With h the combination and its high half folded down, the top sixteen bits of h (h + m), times 12
// and divided by 2^16, choose the gradient: the square mixes what one multiplication by a constant
// would leave linear (tests: neighbours at many distances are independent).
inline constexpr std::uint32_t lattice_px = 0x9E3779B1u;
inline constexpr std::uint32_t lattice_py = 0x85EBCA77u;
inline constexpr std::uint32_t lattice_pz = 0xC2B2AE3Du;
inline constexpr int lattice_fold = 13;
inline constexpr std::uint32_t lattice_addend = 0x2C1B3C6Du;

/// The words that a seed adds to the three coordinates.
struct LatticeSeed {
  std::uint32_t x, y, z;
};
constexpr LatticeSeed lattice_seed(std::uint32_t seed) {
  return {seed ^ 0x9E3779B9u, (seed ^ 0x7F4A7C15u) * 0x27D4EB2Fu,
          (seed ^ 0xF39CC060u) * 0x165667B1u};
}

/// The 12 gradients of Perlin 2002 in his order, without the four that his table repeats, which
/// favour y. For index b: u = x if b < 8 else y; v = y if b < 4 else z; bit 0 negates u, bit 1
/// negates v.
struct alignas(64) GradientTable {
  float x[16] = {1, -1, 1, -1, 1, -1, 1, -1, 0, 0, 0, 0};
  float y[16] = {1, 1, -1, -1, 0, 0, 0, 0, 1, -1, 1, -1};
  float z[16] = {0, 0, 0, 0, 1, 1, -1, -1, 1, 1, -1, -1};
};
inline constexpr GradientTable gradient_table;

inline constexpr double perlin_variance = 35054270.0 / 480729249.0;
inline constexpr double perlin_bound = 1.03636;
inline constexpr double simplex_scale = 76.8857;
/// scale^2 2 (2/3) int (1/2 - r^2)^8 r^2 d^3r: 2 lattice points per unit volume, <(g . r)^2> =
/// 2 r^2/3.
inline constexpr double simplex_variance = 0.154037;
inline constexpr double simplex_bound = 1.00003;

}  // namespace gamer
