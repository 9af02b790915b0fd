#include "gamer/processing/rgb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace gamer {
namespace {

/// Where Astropy's F(I) meets its tangent's value.
constexpr double kFraction = 0.1;
constexpr double kDefaultQ = 8;
/// Pixels of a piece of work: large enough for whole tiles of compressed files, small beside them.
constexpr int kTilePixels = 1 << 17;

double mean_of(const Rgb& rgb) { return (rgb[0] + rgb[1] + rgb[2]) / 3; }

/// The picture's numbers as a plane: row 0 the top, red, green and blue side by side.
class PicturePlane final : public Plane {
 public:
  PicturePlane(std::span<const PlanePtr> channels, const ColourOf& colour, bool down_to_bytes)
      : Plane(3 * channels[0]->width(), channels[0]->height()),
        channels_(channels.begin(), channels.end()),
        colour_(colour),
        down_to_bytes_(down_to_bytes) {}

  Tile tile() const override {
    return {width(), std::clamp(3 * kTilePixels / width(), 1, height())};
  }

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const int first = area.x / 3, last = (area.x + area.width + 2) / 3;
    const Area source = {first, height() - area.y - area.height, last - first, area.height};
    const std::size_t count = static_cast<std::size_t>(source.width) * source.height;
    std::vector<std::vector<double>> values(channels_.size());
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      values[c].resize(count);
      channels_[c]->read(source, values[c].data(), source.width);
    }
    std::vector<double> row(static_cast<std::size_t>(source.width) * 3);
    for (int y = 0; y < area.height; ++y) {
      const std::size_t start = static_cast<std::size_t>(area.height - 1 - y) * source.width;
      double* to = row.data();
      for (int x = 0; x < source.width; ++x) {
        Rgb rgb;
        for (std::size_t c = 0; c < 3; ++c) {
          rgb[c] = values[channels_.size() == 1 ? 0 : c][start + x];
        }
        for (const double value : colour(rgb)) *to++ = value;
      }
      std::copy_n(row.begin() + (area.x - 3 * first), area.width, out + y * stride);
    }
  }

 private:
  Rgb colour(const Rgb& rgb) const {
    if (!std::all_of(rgb.begin(), rgb.end(), [](double v) { return std::isfinite(v); })) return {};
    Rgb result = colour_(rgb);
    for (double& value : result) {
      constexpr int kByte = 255, kByteIn16Bits = 257;
      value = down_to_bytes_ ? kByteIn16Bits * std::floor(kByte * std::clamp(value, 0.0, 1.0))
                             : to_16_bits(value);
    }
    return result;
  }

  std::vector<PlanePtr> channels_;
  const ColourOf& colour_;
  bool down_to_bytes_;
};

}  // namespace

Rgb LuptonTone::operator()(const Rgb& rgb) const {
  Rgb light;
  for (std::size_t c = 0; c < 3; ++c) light[c] = scale[c] * (rgb[c] - minimum[c]);
  Rgb result = lupton_stretch(light, q / stretch, kFraction / std::asinh(kFraction * q));
  for (double& value : result) value = std::max(value, 0.0);
  return result;
}

LuptonTone choose_lupton(std::span<const PlanePtr> channels, const LuptonChoice& choice,
                         int threads) {
  LuptonTone tone;
  tone.q = choice.q.value_or(kDefaultQ);
  if (choice.minimum && choice.scale && choice.stretch) {
    tone.minimum = *choice.minimum;
    tone.scale = *choice.scale;
    tone.stretch = *choice.stretch;
    return tone;
  }
  const PictureTone automatic = automatic_tone(channels, threads, choice.minimum, choice.scale);
  tone.minimum = automatic.black;
  tone.scale = automatic.factor;
  const bool is_dark = automatic.slope == 0;
  if (choice.stretch) {
    tone.stretch = *choice.stretch;
  } else if (is_dark) {
    tone.stretch = 1;
  } else if (choice.q) {
    const double one = std::sinh(1 / automatic.scale) / automatic.slope;
    tone.stretch = tone.q * one / std::sinh(std::asinh(kFraction * tone.q) / kFraction);
  } else {
    tone.q = std::sinh(kFraction / automatic.scale) / kFraction;
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
  const double mean = mean_of(x);
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
