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

/// The stretch of Lupton et al. 2004 (PASP 116, 133). With c' = scale_c (c - minimum_c) and I = (r'
/// + g' + b')/3, channel c becomes c' F(I)/I,
///   F(I) = 0.1 asinh(Q I/stretch)/asinh(0.1 Q),
/// and all three are divided by the largest where that is above 1, which keeps the hue. Then
/// negative values become 0, and all three are 0 where I <= 0. Near black F(I) is linear; F is 0.1
/// at I = 0.1 stretch. A larger Q bends it earlier. The 0.1 is Astropy's (make_lupton_rgb); the
/// paper's F(I) is asinh(alpha Q (I - m))/Q with alpha = 1/stretch.
struct LuptonTone {
  Rgb minimum{};
  Rgb scale = {1, 1, 1};
  double stretch = 1;  ///< > 0, in the unit of scale_c c
  double q = 8;        ///< > 0
};

/// The values of LuptonTone that the user gives.
struct LuptonChoice {
  std::optional<Rgb> minimum, scale;
  std::optional<double> stretch, q;
};

/// Chooses the values that are not given. minimum and scale are black and factors of
/// automatic_tone(). Without stretch and Q, its slope and scale give Q = 10 sinh(0.1/scale) and
/// stretch = Q/slope. With stretch alone, Q = 8. With Q alone, stretch maps the intensity I_1 =
/// sinh(1/scale)/slope to 1, as automatic_tone() does. Channels are those of picture_channels(),
/// one or three, and `factors` those of channel_factors().
LuptonTone choose_lupton(std::span<const PlanePtr> channels, const LuptonChoice& choice,
                         int threads, const Rgb& factors = {1, 1, 1});

/// The tone of STIFF (Bertin 2012, ASP Conf. 461, 263). With x_c = (c - low_c)/(high_c - low_c), at
/// most Y^(1 - 1/luminance_gamma), and the luminance Y = mean of max(x_c, 0), which is not limited,
///   c' = max(Y + saturation (x_c - mean(x)), 0) Y^(1/luminance_gamma - 1)
/// and the channel is c'^(1/gamma), at most 1. gamma brightens for the display, luminance_gamma the
/// luminance alone. A saturation of 0 gives grey, 1 keeps the channels' ratios, and more
/// strengthens the colours. STIFF's names: GAMMA, GAMMA_FAC, COLOUR_SAT.
struct StiffTone {
  std::array<Limits, 3> limits;
  double gamma = 2.2;
  double luminance_gamma = 1;
  double saturation = 1;

  Rgb operator()(const Rgb& rgb) const;
};

/// A tone for each channel alone: x_c^(1/gamma), x_c = (c - low_c)/(high_c - low_c), in [0, 1].
struct PlainTone {
  std::array<Limits, 3> limits;
  double gamma = 1;

  Rgb operator()(const Rgb& rgb) const;
};

/// A function from pixel values to colours, for many pixels at a time.
class ColourOf {
 public:
  ColourOf(const LuptonTone& tone);
  template <class Function>
  requires std::is_invocable_r_v<Rgb, const Function&, const Rgb&> ColourOf(Function function)
      : change_([f = std::move(function)](const Channels& channels, std::size_t count) {
          for (std::size_t i = 0; i < count; ++i) {
            const Rgb colour = f(Rgb{channels[0][i], channels[1][i], channels[2][i]});
            for (std::size_t c = 0; c < channels.size(); ++c) channels[c][i] = colour[c];
          }
        }) {}

  /// Pointers to the values of each channel.
  using Channels = std::array<double*, 3>;
  /// Replaces the values of `count` pixels by their colours.
  void operator()(const Channels& channels, std::size_t count) const { change_(channels, count); }

 private:
  std::function<void(const Channels& channels, std::size_t count)> change_;
};

/// Rounding of a value v in [0, 1] to 8 bits.
enum class ByteRounding {
  nearest,  ///< nearest to the 16 bits that are nearest to v
  down      ///< whole part of 255 v, as in Astropy
};

/// Writes the picture, a few rows at a time. Its top row is the last row of the channels. There is
/// one channel for grey, or three of equal size. Pixels are black where a channel is not finite.
/// `threads` threads make the colours. Throws RunError, and what the channels throw.
void write_rgb(const PictureFileOptions& options, std::span<const PlanePtr> channels,
               const ColourOf& colour, ByteRounding rounding, int threads);

}  // namespace gamer
