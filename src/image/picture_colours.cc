#include "gamer/image/picture_colours.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gamer {
namespace {

/// The level from which on a picture with a shoulder becomes white more slowly.
constexpr double knee = 0.7;

/// c F(I)/I of lupton_stretch(), which may exceed 1.
std::array<double, 3> asinh_stretch(const std::array<double, 3>& rgb, double slope, double scale) {
  const double intensity = (rgb[0] + rgb[1] + rgb[2]) / 3;
  if (!(intensity > 0)) return {0, 0, 0};
  const double factor = scale * std::asinh(slope * intensity) / intensity;
  return {rgb[0] * factor, rgb[1] * factor, rgb[2] * factor};
}

}  // namespace

std::array<double, 3> lupton_stretch(const std::array<double, 3>& rgb, double slope, double scale) {
  std::array<double, 3> stretched = asinh_stretch(rgb, slope, scale);
  const double largest = *std::ranges::max_element(stretched);
  if (largest > 1) {
    for (double& channel : stretched) channel /= largest;
  }
  return stretched;
}

std::array<double, 3> PictureTone::light(const std::array<double, 3>& rgb) const {
  std::array<double, 3> light;
  for (std::size_t c = 0; c < 3; ++c) light[c] = std::max(rgb[c] - black[c], 0.0) * factor[c];
  return light;
}

std::array<double, 3> PictureTone::colour(const std::array<double, 3>& rgb) const {
  return lupton_stretch(light(rgb), slope, scale);
}

PictureColours::PictureColours(const PictureTone& tone, const PictureStyle& style, int channels)
    : tone_(tone),
      saturation_(style.saturation),
      has_shoulder_(style.seeing > 0 || style.contrast > 1) {
  if (!(tone.slope > 0) || !(tone.scale > 0)) {
    // There is no light, and any stretch serves the sky.
    tone_.factor = {0, 0, 0};
    tone_.slope = tone_.scale = 1;
  }
  if (style.brightness != 1) {
    const double white = std::sinh(1 / tone_.scale);
    tone_.slope *= style.brightness;
    tone_.scale = 1 / std::asinh(style.brightness * white);
  }
  if (style.contrast != 1) {
    const double stretched = std::sinh(reference_level / tone_.scale) / style.contrast;
    tone_.slope /= style.contrast;
    tone_.scale = reference_level / std::asinh(stretched);
  }
  const double stretched = std::sinh(style.sky / tone_.scale);
  sky_ = stretched / tone_.slope;
  // The stretch multiplies noise of the intensity by its derivative, and noise of colours by the
  // ratio of stretched to unstretched intensity. The noise of a single channel is noise of the
  // intensity. With three channels this holds for a third of the variance; the rest changes
  // colours.
  const double derivative = tone_.scale * tone_.slope / std::hypot(1.0, stretched);
  const double ratio = sky_ > 0 ? style.sky / sky_ : derivative;
  const double colours = channels == 1 ? 0 : 2.0 / 3;
  grain_ =
      style.grain / std::sqrt((1 - colours) * derivative * derivative + colours * ratio * ratio);
}

std::array<double, 3> PictureColours::colour(const std::array<double, 3>& rgb,
                                             const std::array<double, 3>& noise) const {
  std::array<double, 3> light = tone_.light(rgb);
  const double intensity = (light[0] + light[1] + light[2]) / 3;
  for (std::size_t c = 0; c < 3; ++c) {
    if (saturation_ != 1) {
      light[c] = std::max(intensity + saturation_ * (light[c] - intensity), 0.0);
    }
    const double photons = grain_ > 0 ? std::sqrt(1 + light[c] / std::max(sky_, grain_)) : 0;
    light[c] = std::max(light[c] + sky_ + grain_ * photons * noise[c], 0.0);
  }
  if (!has_shoulder_) return lupton_stretch(light, tone_.slope, tone_.scale);
  std::array<double, 3> colour = asinh_stretch(light, tone_.slope, tone_.scale);
  for (double& channel : colour) {
    if (channel > knee) channel = 1 - (1 - knee) * std::exp((knee - channel) / (1 - knee));
  }
  return colour;
}

std::array<double, 8> PictureTone::numbers() const {
  return {black[0], black[1], black[2], factor[0], factor[1], factor[2], slope, scale};
}

PictureTone PictureTone::of_numbers(const std::array<double, 8>& numbers) {
  const auto& n = numbers;
  return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6], n[7]};
}

}  // namespace gamer
