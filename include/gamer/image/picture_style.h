#pragma once

#include <cstdint>

#include "gamer/core/parameter.h"

namespace gamer {

/// What a picture has besides the stretch of its tone (PictureTone). Levels are those of the
/// finished picture, where white is 1.
struct PictureStyle {
  double brightness = 1;         ///< factor on the stretch's slope; white stays white
  double contrast = 1;           ///< divides the stretch's slope; a fixed level stays
  double saturation = 1;         ///< 0 is grey, 1 keeps the colours
  double seeing = 0;             ///< FWHM of a point, pixels; 0 shows the pixels as they are
  double spikes = 0;             ///< share of a point's light in diffraction spikes, with seeing
  double sky = 0;                ///< level of pixels without light
  double grain = 0;              ///< standard deviation of the noise of pixels without light
  std::uint64_t grain_seed = 1;  ///< at most most_grain_seed; another number gives other noise

  static constexpr std::uint64_t most_grain_seed = 1000000000;
  static constexpr double least_seeing = 0.1, most_seeing = 32;
  /// The values of brightness and contrast.
  static Interval factors() { return Interval::closed(0.01, 100); }
};

}  // namespace gamer
