#pragma once

#include <array>

#include "gamer/image/picture_style.h"

namespace gamer {

/// The level of the faint disk in an automatic tone, which contrast does not change.
inline constexpr double reference_level = 0.28;

/// The colour-preserving asinh stretch of Lupton et al. 2004 (PASP 116, 133). With the intensity I
/// = (r + g + b)/3, each channel c becomes c F(I)/I,
///   F(I) = scale asinh(slope I),
/// and all three are divided by the largest where that exceeds 1. Hue thus depends only on the
/// ratios of the channels. The paper's Q and alpha are slope = alpha Q, scale = 1/Q. Channels are
/// >= 0; black stays black.
std::array<double, 3> lupton_stretch(const std::array<double, 3>& rgb, double slope, double scale);

/// The numbers that make_picture() chooses for its channels. The colour of the pixel (r, g, b) is
/// lupton_stretch() of its light().
struct PictureTone {
  std::array<double, 3> black{};
  std::array<double, 3> factor = {1, 1, 1};
  double slope = 0;  ///< slope = scale = 0 where the image has no light
  double scale = 0;

  /// factor_c max(c - black_c, 0).
  std::array<double, 3> light(const std::array<double, 3>& rgb) const;
  std::array<double, 3> colour(const std::array<double, 3>& rgb) const;

  /// Black, factor, slope, scale.
  std::array<double, 8> numbers() const;
  static PictureTone of_numbers(const std::array<double, 8>& numbers);
};

/// Colours of pixels by a tone and a style.
///
/// *Brightness* b is a factor on the slope of the tone's stretch, scale asinh(slope I). The light
/// sinh(1/scale)/slope stays white: 1/asinh(b sinh(1/scale)) replaces the scale. A stretch that is
/// nearly linear changes little.
///
/// *Contrast* k divides the slope of that stretch. The light of the level 0.28 keeps its level, by
/// another scale. With k > 1 fainter light becomes darker, and the brightest parts exceed 1.
///
/// *Saturation* s. A channel c of a pixel of intensity I becomes I + s (c - I), at least 0.
///
/// *Sky and grain.* All channels then get the light whose stretch is the level `sky`, and noise.
/// The noise is normal, and independent in each of the `channels` (1 or 3), apart from a common
/// slope with seeing. The noise has the standard deviation `grain` in a picture of the sky alone,
/// but light below 0 counts as 0. Noise is light too, which the stretch shows less in bright parts.
/// Like photon noise, the noise of a channel of light L is sqrt(1 + L/S) times that of the sky. S
/// is the sky's light, or the light of the noise where this is larger.
///
/// *Shoulder*, where the style has seeing or k > 1. Each channel c F(I)/I of the stretch, here v,
/// becomes 1 - 0.3 exp(-(v - 0.7)/0.3) where v > 0.7. The level 1 becomes 0.89. The middle of a
/// bright star thus is white, as film and detectors show it.
class PictureColours {
 public:
  PictureColours(const PictureTone& tone, const PictureStyle& style, int channels);

  /// The colour of a pixel with this noise, normal of mean 0 and sigma 1. The three values of a
  /// single channel are equal.
  std::array<double, 3> colour(const std::array<double, 3>& rgb,
                               const std::array<double, 3>& noise) const;

 private:
  PictureTone tone_;
  double saturation_;
  bool has_shoulder_;
  double sky_ = 0, grain_ = 0;  ///< light
};

}  // namespace gamer
