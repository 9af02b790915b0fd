#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gamer/core/parameter.h"
#include "gamer/noise/noise.h"

namespace gamer {

/// Parameters of a combination of octaves and its shape, with the names of GAMER section 2.3 where
/// they exist.
struct FractalParameters {
  static constexpr int most_octaves = 32;

  const Noise* kind = nullptr;
  int octaves = 8;             ///< omega
  double k0 = 0;               ///< frequency offset, cycles per galaxy radius
  double frequency_scale = 1;  ///< f_s, cycles per galaxy radius
  double spectral_index = 1;   ///< nu
  double exponent = 1;         ///< alpha
  bool inverse = false;        ///< Theta
  double offset = 0;
  double contrast = 1;
  double floor = 0.1;
  std::uint64_t seed = 1;
  Combination combination = {};
  double amplitude = 1;   ///< a, weight of every octave of the multiplicative combination
  double lacunarity = 0;  ///< l; 0: linear frequencies
  double warp = 0;        ///< root mean square of the displacement along each axis, units of x
  double warp_frequency = 1;
  int warp_octaves = 1;

  /// Octave k = 1 ... omega has frequency f_k = k0 + f_s k or, with a lacunarity, (k0 + f_s) l^(k -
  /// 1). Its weight is f_k^-nu, (f_k/f_1)^-nu for ridges, or a for the multiplicative combination.
  /// Each octave has its own hash seed and offset, so that octaves are independent.
  std::vector<Octave> make_octaves() const;

  /// f_k and its weight, k = 1 ... omega.
  double frequency(int k) const;
  double weight(int k) const;
  /// Whether the combination of octaves is a density by itself, without a shape.
  bool is_density() const;

  /// The declaration of `component.noise`, with these values as defaults.
  ParameterTable table() const;
  /// Replaces the parameters that `values` (of table()) gives. Throws InputError for contradicting
  /// parameters.
  void apply(const ParameterSet& values, const std::string& context);
};

/// Gives an octave its own lattice, with offsets from hash(0), hash(1), hash(2) and the seed from
/// hash(3).
void scatter(Octave& octave, const std::function<std::uint64_t(std::uint64_t)>& hash);

}  // namespace gamer
