#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

/// One octave of a sum: weight * P(frequency * x + offset), its lattice hashed with `seed`.
struct Octave {
  float frequency = 1;
  float weight = 1;
  float offset[3] = {0, 0, 0};
  std::uint32_t seed = 0;
};

/// A base noise P(x) in three dimensions: mean 0, features of size 1, a function of position and
/// seed only. Lattice points are hashed as 32-bit integers, so that P repeats after 2^32 cells at
/// the earliest. Coordinates are single precision: the sum is smooth while
/// |frequency * x + offset| stays below 1e5.
class Noise {
 public:
  virtual ~Noise() = default;

  virtual std::string_view name() const = 0;
  virtual std::string_view description() const = 0;
  /// Variance over space.
  virtual double variance() const = 0;
  /// Bound of |P|.
  virtual double bound() const = 0;

  /// out[i] = sum over octaves of weight * P(frequency * p_i + offset).
  virtual void sum(const Points& points, std::span<const Octave> octaves, float* out) const = 0;
};

/// All kinds; to add one, add its maker here.
std::span<const Noise* const> noise_kinds();

std::vector<std::string> noise_names();

/// Throws InputError for an unknown name, with near ones.
const Noise& find_noise(const std::string& name);

/// Improved Perlin noise (Perlin 2002): sum over the 8 corners c of the cell of
/// prod_d w_d * g_c . (x - c), w = 1 - s(f) or s(f), s = 6f^5 - 15f^4 + 10f^3, g_c one of the 12
/// vectors (+-1, +-1, 0) and permutations. Variance 35054270/480729249.
const Noise& perlin_noise();

/// Simplex noise (Perlin 2001) with a kernel of radius^2 1/2, hence continuous: 76.8857 times the
/// sum over the 4 corners of max(1/2 - r^2, 0)^4 g . r, the same 12 gradients.
const Noise& simplex_noise();

}  // namespace gamer
