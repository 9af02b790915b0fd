#pragma once

namespace gamer {

// A ray of footprint w resolves a share of an octave of frequency f: 1 where f w is below
// fade_begin, 0 from fade_end on, the smoothstep between them. An octave has most of its power at
// 0.4 to 0.9 f. The mean over a square of side w keeps (sinc(pi k w))^2 of the power at wave number
// k: half of the amplitude at k w = 0.6.
inline constexpr double fade_begin = 0.15;
inline constexpr double fade_end = 0.9;

/// The share of an octave that a ray resolves, for `cycles` = f w.
constexpr double seen_share(double cycles) {
  const double u = (fade_end - cycles) / (fade_end - fade_begin);
  if (u <= 0) return 0;
  return u < 1 ? u * u * (3 - 2 * u) : 1;
}

}  // namespace gamer
