#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

/// One octave of a sum: weight * P(frequency * x + offset). Its lattice is hashed with `seed`.
///
/// Lattice points may be identified (cubic lattices only, Noise::identifies()), which makes P
/// periodic. A translation (P, Q) identifies (i, j, k) with (i + P, j + Q, k), so that noise at x
/// and x + (P, Q, 0) is equal. Where Q is not 0, noise does not repeat along either axis alone: a
/// helix. Periods, one per axis, make a torus. Both are in cells of the octave; 0 means none. A
/// translation excludes periods of its own axes, and |x Q/P| must stay below 4e6.
struct Octave {
  float frequency = 1;
  float weight = 1;
  float offset[3] = {0, 0, 0};
  std::uint32_t seed = 0;
  std::int32_t translation[2] = {0, 0};
  std::int32_t period[3] = {0, 0, 0};
};

/// The combination of octaves n_k = P(f_k x + o_k) of weights w_k, k = 1, 2, ..., to one value.
struct Combination {
  enum class Kind {
    additive,        ///< sum w_k n_k
    multiplicative,  ///< product of min(max(1 + w_k n_k, 0), 2): mean 1 [Bizard 2018]
    billow,          ///< sum w_k |n_k|
    /// sum w_k s_k, s_k = (offset - |n_k|)^2 min(max(gain s_(k-1), 0), 1), s_0 = 1/gain
    /// [Musgrave, in Ebert et al., Texturing and Modeling, 1998: "ridged multifractal"]
    ridged,
  };
  Kind kind = Kind::additive;
  float ridge_offset = 1;
  float ridge_gain = 2;
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
  /// Upper bound of |P|.
  virtual double bound() const = 0;

  /// Whether octaves may have a translation or periods. If not, the functions below throw
  /// InputError for these octaves. They also throw it if translation and periods contradict each
  /// other.
  virtual bool identifies() const = 0;

  /// out[i] = sum over octaves of weight * P(frequency * p_i + offset).
  virtual void sum(const Points& points, std::span<const Octave> octaves, float* out) const = 0;
  /// Evaluates out[i] = the combination of octaves at p_i.
  virtual void combine(const Combination& combination, const Points& points,
                       std::span<const Octave> octaves, float* out) const = 0;
  /// The sum of a noise with 1 to most_components components: out[0] is sum(), and the others are
  /// independent sums of equal statistics. Components share hashes and all that depends on the
  /// position, so that each costs less than a sum.
  virtual void sum_vector(const Points& points, std::span<const Octave> octaves,
                          std::span<float* const> out) const = 0;
  static constexpr std::size_t most_components = 3;
};

/// All kinds; to add one, add its maker here.
std::span<const Noise* const> noise_kinds();

std::vector<std::string> noise_names();

/// Throws InputError for an unknown name. The message proposes similar names.
const Noise& find_noise(const std::string& name);

/// Improved Perlin noise (Perlin 2002): sum over the 8 corners c of the cell of
/// prod_d w_d * g_c . (x - c), w = 1 - s(f) or s(f), s = 6f^5 - 15f^4 + 10f^3, g_c one of the 12
/// vectors (+-1, +-1, 0) and permutations. Variance 35054270/480729249.
const Noise& perlin_noise();

/// Simplex noise (Perlin 2001) with a kernel of radius^2 1/2, hence continuous: 76.8857 times the
/// sum over the 4 corners of max(1/2 - r^2, 0)^4 g . r, with the 12 gradients of Perlin noise.
const Noise& simplex_noise();

/// Value noise: numbers of the lattice points, uniform in [-1, 1], mixed by the weights of Perlin
/// noise. Variance (181/231)^3/3. The noise is smooth with visible blocks, cheaper than Perlin
/// noise, and has more power at low frequencies.
const Noise& value_noise();

/// Cell noise: one number per cell of the lattice, uniform in [-1, 1]. Variance 1/3; the noise
/// jumps between cells.
const Noise& cell_noise();

}  // namespace gamer
