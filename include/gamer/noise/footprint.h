#pragma once

namespace gamer {

// A ray of footprint w sees an octave of frequency f by 1 where f w is below fade_begin, by 0 from
// fade_end on, as the smoothstep between. An octave has most of its power at 0.4 to 0.9 f. Over a
// square of side w that of wave number k keeps (sinc(pi k w))^2: half of its amplitude at k w =
// 0.6.
inline constexpr double fade_begin = 0.15;
inline constexpr double fade_end = 0.9;

}  // namespace gamer
