#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "gamer/noise/noise.h"

namespace gamer {

// A lattice point (i, j, k) has the words a = i px + sx, b = j py + sy, c = k pz + sz modulo 2^32,
// with three words s from the seed. Odd multipliers spread each coordinate over all bits. With
// h = a ^ b ^ c and g = a + b, both cut into halves of 16 bits,
//
//     m = h_low g_low + h_high g_high modulo 2^16
//
// and floor(12 m / 2^16) chooses the gradient. Exclusive or, unlike a sum, leaves no lattice vector
// along which h repeats. Multiplication by a constant would leave the hash linear. A product of two
// words that differ from point to point does not. In tests neighbours at many distances and the
// corners of a cell are independent. Each gradient has a probability within 2e-4 of 1/12.
inline constexpr std::uint32_t lattice_px = 0x9E3779B1u;
inline constexpr std::uint32_t lattice_py = 0x85EBCA77u;
inline constexpr std::uint32_t lattice_pz = 0xC2B2AE3Du;

// Further numbers of a point, for noises with vector values. The halves of h and g count as signed,
// and m has all its 32 bits. With w = lattice_again (m ^ h) the numbers are w_high and w_high ^
// w_low.
inline constexpr std::uint32_t lattice_again = 0x2C1B3C6Du;

/// 1.5 2^23: in cell_origin + n, |n| <= 2^22, the last bits are those of the whole number n.
inline constexpr float cell_origin = 12582912.0f;
inline constexpr std::uint32_t cell_origin_bits = 0x4B400000u;

inline constexpr std::uint32_t gradient_count = 12;

/// The words that a seed adds to the three coordinates.
struct LatticeSeed {
  std::uint32_t x, y, z;
};

/// A mix of a word's bits. Every bit of the result depends on every bit of the word, so that near
/// seeds give unrelated lattices. [C. Wellons, hash-prospector, "lowbias32"]
constexpr std::uint32_t mix32(std::uint32_t word) {
  word = (word ^ (word >> 16)) * 0x7FEB352Du;
  word = (word ^ (word >> 15)) * 0x846CA68Bu;
  return word ^ (word >> 16);
}

constexpr LatticeSeed lattice_seed(std::uint32_t seed) {
  constexpr std::uint32_t step = 0x9E3779B9u;
  const std::uint32_t x = mix32(seed + step);
  const std::uint32_t y = mix32(x + step);
  return {x, y, mix32(y + step)};
}

/// The seed that gives equal words where cells count from cell_origin_bits.
constexpr LatticeSeed from_cell_origin(LatticeSeed seed) {
  return {seed.x - cell_origin_bits * lattice_px, seed.y - cell_origin_bits * lattice_py,
          seed.z - cell_origin_bits * lattice_pz};
}

/// The identifications of points that a lattice allows: none, translations or periods in x, or any.
enum class Lattices { open, helical, cyclic };

/// Octaves, and the simplest identification that serves all of their lattices.
struct OctaveList {
  const Octave* first;
  std::size_t count;
  Lattices lattices;
};

/// A noise that a kernel evaluates on a lattice.
class LatticeNoise final : public Noise {
 public:
  struct Traits {
    std::string_view name, description;
    double variance, bound;
    bool identifies;
  };
  /// Writes a combination of octaves. Sums may have several components, with an array of `out`
  /// each.
  using Evaluate = void (*)(const Combination& combination, const Points& points,
                            const OctaveList& octaves, std::span<float* const> out);
  LatticeNoise(const Traits& traits, Evaluate evaluate) : traits_(traits), evaluate_(evaluate) {}

  std::string_view name() const override { return traits_.name; }
  std::string_view description() const override { return traits_.description; }
  double variance() const override { return traits_.variance; }
  double bound() const override { return traits_.bound; }
  bool identifies() const override { return traits_.identifies; }
  void sum(const Points& points, std::span<const Octave> octaves, float* out) const override {
    evaluate_({}, points, list(octaves), {&out, 1});
  }
  void combine(const Combination& combination, const Points& points,
               std::span<const Octave> octaves, float* out) const override {
    evaluate_(combination, points, list(octaves), {&out, 1});
  }
  void sum_vector(const Points& points, std::span<const Octave> octaves,
                  std::span<float* const> out) const override {
    evaluate_({}, points, list(octaves), out);
  }

 private:
  /// Throws InputError where this noise cannot evaluate the octaves.
  OctaveList list(std::span<const Octave> octaves) const;

  Traits traits_;
  Evaluate evaluate_;
};

/// The period of an index.
struct LatticeCycle {
  float period, inverse, half_inverse;  ///< 0 for none
  float last;            ///< cell_origin + the index before the next period; 0 for none
  std::uint32_t across;  ///< from the word of `last` to that of the next index
};

/// An octave's identification as IdentifiedLattice applies it.
struct LatticeWrap {
  LatticeCycle x, y, z;
  float shear;               ///< of j for one period of i
  std::uint32_t word_shear;  ///< what one period of i subtracts from the word of j
  bool cycles;               ///< whether y or z has a period
};

inline LatticeWrap lattice_wrap(const Octave& octave) {
  std::int32_t p = octave.translation[0], q = octave.translation[1];
  std::int32_t x = octave.period[0], y = octave.period[1], z = octave.period[2];
  if (p == 0) {
    if (q != 0) y = std::abs(q);
    p = x;
    q = 0;
  } else if (p < 0) {
    p = -p;
    q = -q;
  }
  const auto cycle = [](std::int32_t n, std::uint32_t step) -> LatticeCycle {
    if (n == 0) return {0, 0, 0, 0, 0};
    const auto period = static_cast<float>(n);
    return {period, 1 / period, 0.5f / period, cell_origin + period - 1,
            step - static_cast<std::uint32_t>(n) * step};
  };
  return {cycle(p, lattice_px),
          cycle(y, lattice_py),
          cycle(z, lattice_pz),
          static_cast<float>(q),
          static_cast<std::uint32_t>(q) * lattice_py,
          y != 0 || z != 0};
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

/// The highest byte of a gradient's component in single precision, as +-2 or 0.
struct alignas(16) GradientBytes {
  std::uint8_t x[16] = {};
  std::uint8_t y[16] = {};
  std::uint8_t z[16] = {};

  constexpr GradientBytes() {
    const auto byte = [](float component) -> std::uint8_t {
      return component == 0 ? 0x00 : component > 0 ? 0x40 : 0xC0;
    };
    for (int i = 0; i < 16; ++i) {
      x[i] = byte(gradient_table.x[i]);
      y[i] = byte(gradient_table.y[i]);
      z[i] = byte(gradient_table.z[i]);
    }
  }
};
inline constexpr GradientBytes gradient_bytes;

inline constexpr double perlin_variance = 35054270.0 / 480729249.0;
inline constexpr double perlin_bound = 1.03636;
/// The variance of one number, 1/3, times (int s^2 + (1 - s)^2 df)^3.
inline constexpr double value_variance = 181.0 / 231 * 181 / 231 * 181 / 231 / 3;
inline constexpr double value_bound = 1;
inline constexpr double cell_variance = 1.0 / 3;
inline constexpr double cell_bound = 1;
/// The step of the hash between components of cell noise.
inline constexpr std::uint32_t cell_step = 0x9E3779B9u;
inline constexpr double simplex_scale = 76.8857;
/// scale^2 2 (2/3) int (1/2 - r^2)^8 r^2 d^3r: 2 lattice points per unit volume, <(g . r)^2> =
/// 2 r^2/3.
inline constexpr double simplex_variance = 0.154037;
/// sqrt(<(dP/dx)^2>/<P^2>) = sqrt(20), where 3 <(dP/dx)^2> = scale^2 2 (2/3) times the integral of
/// 3 t^8 - 16 t^7 r^2 + 64 t^6 r^4 over space, t = 1/2 - r^2.
inline constexpr double simplex_steepness = 4.4721360;
inline constexpr double simplex_bound = 1.00003;

}  // namespace gamer
