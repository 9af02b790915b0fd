#include "processing/rgb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "processing/tone_kernel.h"

namespace gamer {
namespace {

/// The fraction f for which Astropy's F(f stretch) = f.
constexpr double bright_fraction = 0.1;
constexpr double default_q = 8;
/// Pixels worked on at a time: enough for whole tiles of compressed files.
constexpr int tile_pixels = 1 << 17;

/// A picture's numbers as a plane: row 0 is the top; red, green and blue are side by side.
class PicturePlane final : public Plane {
 public:
  PicturePlane(std::span<const PlanePtr> channels, const ColourOf& colour, bool down_to_bytes)
      : Plane(3 * channels[0]->width(), channels[0]->height()),
        channels_(channels.begin(), channels.end()),
        colour_(colour),
        down_to_bytes_(down_to_bytes) {}

  Tile tile() const override {
    return {width(), std::clamp(3 * tile_pixels / width(), 1, height())};
  }

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const int first = area.x / 3, last = (area.x + area.width + 2) / 3;
    const Area source = {first, height() - area.y - area.height, last - first, area.height};
    const auto row_pixels = static_cast<std::size_t>(source.width);
    const std::size_t count = row_pixels * static_cast<std::size_t>(source.height);
    const auto values = std::make_unique_for_overwrite<double[]>(channels_.size() * count);
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      channels_[c]->read(source, values.get() + c * count, source.width);
    }
    std::vector<double> rows(3 * row_pixels);
    const ColourOf::Channels rgb = {rows.data(), rows.data() + row_pixels,
                                    rows.data() + 2 * row_pixels};
    for (int y = 0; y < area.height; ++y) {
      const std::size_t start = static_cast<std::size_t>(area.height - 1 - y) * row_pixels;
      for (std::size_t c = 0; c < rgb.size(); ++c) {
        const std::size_t channel = channels_.size() == 1 ? 0 : c;
        std::copy_n(values.get() + channel * count + start, row_pixels, rgb[c]);
      }
      colour_row(rgb, row_pixels);
      double* const to = out + y * stride;
      const int skipped = area.x - 3 * first;
      if (skipped == 0 && area.width % 3 == 0) {
        for (std::size_t x = 0; x < row_pixels; ++x) {
          for (std::size_t c = 0; c < rgb.size(); ++c) to[3 * x + c] = rgb[c][x];
        }
      } else {
        for (int i = 0; i < area.width; ++i) to[i] = rgb[(skipped + i) % 3][(skipped + i) / 3];
      }
    }
  }

 private:
  /// Replaces values by the picture's numbers.
  void colour_row(const ColourOf::Channels& rgb, std::size_t count) const {
    // 0 where all channels are finite, else NaN.
    std::vector<double> missing(count);
    for (std::size_t i = 0; i < count; ++i) {
      missing[i] = (rgb[0][i] - rgb[0][i]) + (rgb[1][i] - rgb[1][i]) + (rgb[2][i] - rgb[2][i]);
    }
    colour_(rgb, count);
    constexpr int byte = 255, byte_in16_bits = 257, most16_bits = 65535;
    const int steps = down_to_bytes_ ? byte : most16_bits;
    const double up_from = down_to_bytes_ ? 1 : 0.5;
    const int factor = down_to_bytes_ ? byte_in16_bits : 1;
    for (double* const values : rgb) {
      for (std::size_t i = 0; i < count; ++i) {
        const double value = values[i] + missing[i];
        // NaN is not above 0.
        const double scaled = steps * (value > 0 ? std::min(value, 1.0) : 0.0);
        const int whole = static_cast<int>(scaled);
        values[i] = factor * (whole + (scaled - whole >= up_from ? 1 : 0));
      }
    }
  }

  std::vector<PlanePtr> channels_;
  const ColourOf& colour_;
  bool down_to_bytes_;
};

}  // namespace

ColourOf::ColourOf(const LuptonTone& tone)
    : change_([tone](const Channels& rgb, std::size_t count) {
        const ToneKernel curve{ToneCurve::asinh,
                               tone.q / tone.stretch,
                               0,
                               1,
                               bright_fraction / std::asinh(bright_fraction * tone.q),
                               false};
        std::vector<double> intensities(count), stretched(count);
        for (std::size_t c = 0; c < rgb.size(); ++c) {
          const double minimum = tone.minimum[c], scale = tone.scale[c];
          for (std::size_t i = 0; i < count; ++i) rgb[c][i] = scale * (rgb[c][i] - minimum);
        }
        for (std::size_t i = 0; i < count; ++i) {
          const double intensity = (rgb[0][i] + rgb[1][i] + rgb[2][i]) / 3;
          intensities[i] = stretched[i] = intensity > 0 ? intensity : 0;
        }
        apply_tone(curve, stretched.data(), count);
        for (std::size_t i = 0; i < count; ++i) {
          const bool is_light = intensities[i] > 0;
          const double factor = stretched[i] / (is_light ? intensities[i] : 1.0);
          const double red = rgb[0][i] * factor, green = rgb[1][i] * factor,
                       blue = rgb[2][i] * factor;
          const double largest = std::max(std::max(std::max(red, green), blue), 1.0);
          rgb[0][i] = is_light ? std::max(red / largest, 0.0) : 0.0;
          rgb[1][i] = is_light ? std::max(green / largest, 0.0) : 0.0;
          rgb[2][i] = is_light ? std::max(blue / largest, 0.0) : 0.0;
        }
      }) {}

LuptonTone choose_lupton(std::span<const PlanePtr> channels, const LuptonChoice& choice,
                         int threads, const Rgb& factors) {
  LuptonTone tone;
  tone.q = choice.q.value_or(default_q);
  if (choice.minimum && choice.scale && choice.stretch) {
    tone.minimum = *choice.minimum;
    tone.scale = *choice.scale;
    tone.stretch = *choice.stretch;
    return tone;
  }
  const PictureTone automatic =
      automatic_tone(channels, threads, choice.minimum, choice.scale, factors);
  tone.minimum = automatic.black;
  tone.scale = automatic.factor;
  const bool is_dark = automatic.slope == 0;
  if (choice.stretch) {
    tone.stretch = *choice.stretch;
  } else if (is_dark) {
    tone.stretch = 1;
  } else if (choice.q) {
    const double one = std::sinh(1 / automatic.scale) / automatic.slope;
    tone.stretch = tone.q * one / std::sinh(std::asinh(bright_fraction * tone.q) / bright_fraction);
  } else {
    tone.q = std::sinh(bright_fraction / automatic.scale) / bright_fraction;
    tone.stretch = tone.q / automatic.slope;
  }
  return tone;
}

Rgb StiffTone::operator()(const Rgb& rgb) const {
  Rgb x, result;
  double luminance = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    x[c] = (rgb[c] - limits[c].low) / (limits[c].high - limits[c].low);
    luminance += std::max(x[c], 0.0) / 3;
  }
  if (!(luminance > 0)) return {0, 0, 0};
  const double boost = std::pow(luminance, 1 / luminance_gamma - 1);
  for (double& value : x) value = std::min(value, 1 / boost);
  const double mean = (x[0] + x[1] + x[2]) / 3;
  for (std::size_t c = 0; c < 3; ++c) {
    const double coloured = std::max(luminance + saturation * (x[c] - mean), 0.0) * boost;
    result[c] = std::min(std::pow(coloured, 1 / gamma), 1.0);
  }
  return result;
}

Rgb PlainTone::operator()(const Rgb& rgb) const {
  Rgb result;
  for (std::size_t c = 0; c < 3; ++c) {
    const double x = (rgb[c] - limits[c].low) / (limits[c].high - limits[c].low);
    result[c] = std::pow(std::clamp(x, 0.0, 1.0), 1 / gamma);
  }
  return result;
}

void write_rgb(const PictureFileOptions& options, std::span<const PlanePtr> channels,
               const ColourOf& colour, ByteRounding rounding, int threads) {
  const bool has_bytes = options.format == PictureFormat::bmp || options.bits == 8;
  const PicturePlane picture(channels, colour, has_bytes && rounding == ByteRounding::down);
  PictureFile file(options, channels[0]->width(), channels[0]->height());
  std::vector<std::uint16_t> row(static_cast<std::size_t>(picture.width()));
  for_each_band(picture, threads, [&](const Area& area, const double* values) {
    for (int y = 0; y < area.height; ++y, values += area.width) {
      std::transform(values, values + area.width, row.begin(),
                     [](double value) { return static_cast<std::uint16_t>(value); });
      file.write_row(row);
    }
  });
  file.finish();
}

}  // namespace gamer
