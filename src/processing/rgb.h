#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "gamer/image/picture.h"
#include "gamer/image/plane.h"
#include "processing/tone.h"

namespace gamer {

/// Values of the red, green and blue channel of a pixel.
using Rgb = std::array<double, 3>;

/// Lupton et al. 2004 (PASP 116, 133). With c' = scale_c (c - minimum_c) and I = (r' + g' + b')/3,
/// channel c becomes c' F(I)/I,
///   F(I) = 0.1 asinh(Q I/stretch)/asinh(0.1 Q),
/// and all three are divided by the largest where that is above 1, so that hue stays; then what is
/// negative is 0, as all three are where I <= 0. Near black F(I) is linear, and 0.1 where
/// I = 0.1 stretch; Q says how soon it bends. The 0.1 is Astropy's (make_lupton_rgb); the paper's
/// F(I) is asinh(alpha Q (I - m))/Q with alpha = 1/stretch.
struct LuptonTone {
  Rgb minimum{};
  Rgb scale = {1, 1, 1};
  double stretch = 1;  ///< > 0, in the unit of scale_c c
  double q = 8;        ///< > 0

  Rgb operator()(const Rgb& rgb) const;
};

/// What a user fixes of it.
struct LuptonChoice {
  std::optional<Rgb> minimum, scale;
  std::optional<double> stretch, q;
};

/// Chooses the rest. minimum and scale: the black and the factors of automatic_tone(). Neither
/// stretch nor Q: its slope and scale, as Q = 10 sinh(0.1/scale) and stretch = Q/slope. stretch
/// alone: Q = 8. Q alone: the stretch for which the same intensity I_1 = sinh(1/scale)/slope
/// becomes
/// 1. Channels are those of picture_channels(), one or three.
LuptonTone choose_lupton(std::span<const PlanePtr> channels, const LuptonChoice& choice,
                         int threads);

/// After STIFF (Bertin 2012, ASP Conf. 461, 263). With x_c = (c - low_c)/(high_c - low_c), at most
/// Y^(1 - 1/luminance_gamma), and the luminance Y = mean of max(x_c, 0), not limited,
///   c' = max(Y + saturation (x_c - mean(x)), 0) Y^(1/luminance_gamma - 1)
/// and the channel is c'^(1/gamma), at most 1. So gamma brightens for the display, luminance_gamma
/// the luminance alone, and a saturation of 0 is grey, of 1 the channels themselves, above 1 more
/// colourful. STIFF's names: GAMMA, GAMMA_FAC, COLOUR_SAT.
struct StiffTone {
  std::array<Limits, 3> limits;
  double gamma = 2.2;
  double luminance_gamma = 1;
  double saturation = 1;

  Rgb operator()(const Rgb& rgb) const;
};

/// Each channel on its own: x_c^(1/gamma), x_c = (c - low_c)/(high_c - low_c) within [0, 1].
struct PlainTone {
  std::array<Limits, 3> limits;
  double gamma = 1;

  Rgb operator()(const Rgb& rgb) const;
};

/// A function from a pixel's values to its colour, for many pixels at a time.
class ColourOf {
 public:
  /// Agrees with LuptonTone to the last bit or two, and takes many pixels at a time.
  ColourOf(const LuptonTone& tone);
  template <class Function>
  requires std::is_invocable_r_v<Rgb, const Function&, const Rgb&> ColourOf(Function function)
      : change_([f = std::move(function)](const Channels& channels, std::size_t count) {
          for (std::size_t i = 0; i < count; ++i) {
            const Rgb colour = f(Rgb{channels[0][i], channels[1][i], channels[2][i]});
            for (std::size_t c = 0; c < channels.size(); ++c) channels[c][i] = colour[c];
          }
        }) {}

  /// Where the values of each channel stand.
  using Channels = std::array<double*, 3>;
  /// Replaces the values of `count` pixels by their colours.
  void operator()(const Channels& channels, std::size_t count) const { change_(channels, count); }

 private:
  std::function<void(const Channels& channels, std::size_t count)> change_;
};

/// How 8 bits come of a value v in [0, 1].
enum class ByteRounding {
  nearest,  ///< of 16 bits, these of v
  down      ///< the whole part of 255 v, as Astropy does
};

/// Writes the picture, its top row the last one of the channels (one for grey, or three of one
/// size), a few rows at a time. Pixels of which a channel is not finite are black. `threads` make
/// the colours. Throws RunError, and what the channels throw.
void write_rgb(const PictureFileOptions& options, std::span<const PlanePtr> channels,
               const ColourOf& colour, ByteRounding rounding, int threads);

}  // namespace gamer
