#pragma once

#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace gamer {

/// Random numbers are functions of their purpose (seed, object, sample), never of the order of
/// calls.

/// The finaliser of splitmix64 (Steele, Lea & Flood 2014, doi:10.1145/2660193.2660195), with
/// Stafford's variant 13 of the constants. The function is a bijection that mixes all 64 bits;
/// mix64(0) = 0.
constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/// 2^64 divided by the golden ratio: the increment of splitmix64.
inline constexpr std::uint64_t golden_gamma = 0x9e3779b97f4a7c15u;

/// A hash of the words, their order and their number.
constexpr std::uint64_t hash_words(std::initializer_list<std::uint64_t> words) {
  std::uint64_t h = golden_gamma * (words.size() + 1);
  for (const std::uint64_t word : words) h = mix64(h ^ word) + golden_gamma;
  return mix64(h);
}

/// A hash of a seed and a text, such as the name of a component.
constexpr std::uint64_t hash_text(std::uint64_t seed, std::string_view text) {
  for (const char c : text) seed = hash_words({seed, static_cast<unsigned char>(c)});
  return seed;
}

/// End of the interval of the seeds that a user may give: 2^63, above every signed 64-bit integer.
inline constexpr double largest_seed = 0x1p63;

/// The upper 53 bits as a number in [0, 1).
constexpr double to_unit(std::uint64_t x) { return static_cast<double>(x >> 11) * 0x1p-53; }

/// Roberts' R3 sequence (M. Roberts 2018, "The unreasonable effectiveness of quasirandom
/// sequences"): point i is frac(1/2 + i (1/g, 1/g^2, 1/g^3)) with g = 1.2207... This root of g^4 =
/// g + 1 generalises the golden ratio to three dimensions. Fixed-point arithmetic keeps it exact to
/// 2^-53 for i < 2^11 and to i 2^-64 beyond.
struct R3Sequence {
  void point(std::uint64_t i, double out[3]) const {
    constexpr std::uint64_t half = std::uint64_t{1} << 63;
    for (int k = 0; k < 3; ++k) out[k] = to_unit(half + i * steps[k]);
  }

  /// 2^64 g^-1, 2^64 g^-2, 2^64 g^-3, rounded down.
  static constexpr std::uint64_t steps[3] = {0xd1b54a32d192ed03u, 0xabc98388fb8fac02u,
                                             0x8cb92ba72f3d8dd7u};
};

}  // namespace gamer
