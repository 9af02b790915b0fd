#include "gamer/image/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <stdexcept>

#include "gamer/core/error.h"
#include "image/image_suffix.h"
#include "image/picture_file.h"
#include "image/picture_size.h"

namespace gamer {
namespace {

constexpr std::size_t kMostSamples = std::size_t{1} << 20;
constexpr double kBlackQuantile = 0.05;
/// Distance of that quantile below the middle of a Gaussian, sigmas.
constexpr double kBlackSigmas = 1.645;
/// sigma of a Gaussian over its median absolute deviation.
constexpr double kSigmaPerMedian = 1.4826;
/// Pixels count as light when they are this many sigmas above the sky.
constexpr double kLightSigmas = 3;
constexpr double kBalance = 0.5;
constexpr double kWhiteQuantile = 0.9999;
constexpr double kReferenceLight = 0.8;
constexpr double kReferenceLevel = 0.28;

/// How much each plane gives to each channel: one channel (grey) or three.
std::vector<std::vector<double>> channel_weights(int planes,
                                                 const std::vector<double>& wavelengths) {
  if (!wavelengths.empty() && wavelengths.size() != static_cast<std::size_t>(planes)) {
    throw std::invalid_argument("picture: wavelengths and planes differ in number");
  }
  if (planes == 1) return {{1.0}};
  std::vector<int> order(planes);
  std::iota(order.begin(), order.end(), 0);
  if (!wavelengths.empty()) {
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return wavelengths[a] > wavelengths[b]; });
  }
  std::vector<std::vector<double>> weights(3, std::vector<double>(planes));
  if (planes == 2) {
    weights[0][order[0]] = 1;
    weights[1] = {0.5, 0.5};
    weights[2][order[1]] = 1;
    return weights;
  }
  for (int channel = 0; channel < 3; ++channel) {
    const int first = channel * planes / 3, last = (channel + 1) * planes / 3;
    for (int i = first; i < last; ++i) weights[channel][order[i]] = 1.0 / (last - first);
  }
  return weights;
}

/// The channels of one row. `row_of(plane)` points to the plane's values in it, `out(channel)` to
/// where the channel goes.
template <class RowOf, class Out>
void mix_row(const std::vector<std::vector<double>>& weights, int width, RowOf row_of, Out out) {
  for (std::size_t channel = 0; channel < weights.size(); ++channel) {
    double* to = out(static_cast<int>(channel));
    std::fill_n(to, width, 0.0);
    for (std::size_t plane = 0; plane < weights[channel].size(); ++plane) {
      const double weight = weights[channel][plane];
      if (weight == 0) continue;
      const double* from = row_of(static_cast<int>(plane));
      for (int x = 0; x < width; ++x) to[x] += weight * from[x];
    }
    std::replace_if(
        to, to + width, [](double value) { return !std::isfinite(value); }, 0.0);
  }
}

double quantile(std::vector<double>& values, double fraction) {
  const auto rank = static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1));
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

struct Sky {
  double level = 0, sigma = 0;
};

Sky measure_sky(const double* values, std::size_t count, std::size_t stride, int width) {
  std::vector<double> sample, differences;
  for (std::size_t i = 0; i < count; i += stride) {
    sample.push_back(values[i]);
    const bool has_neighbour = (i + 1) % static_cast<std::size_t>(width) != 0;
    if (has_neighbour) differences.push_back(std::abs(values[i + 1] - values[i]));
  }
  const double low = quantile(sample, kBlackQuantile);
  const double middle = quantile(sample, 0.5);
  double sigma = 0;
  if (!differences.empty()) {
    sigma = std::min(kSigmaPerMedian * quantile(differences, 0.5) / std::sqrt(2.0),
                     (middle - low) / kBlackSigmas);
  }
  return {low + kBlackSigmas * sigma, sigma};
}

/// The slope for which asinh(slope reference)/asinh(slope white) is the reference level; the ratio
/// grows with the slope.
double solve_slope(double reference, double white) {
  constexpr double kNearlyLinear = 1e-3, kSteepest = 1e30;
  constexpr int kBisections = 100;
  double low = std::log(kNearlyLinear / white), high = std::log(kSteepest / white);
  for (int i = 0; i < kBisections; ++i) {
    const double middle = (low + high) / 2;
    const double slope = std::exp(middle);
    if (std::asinh(slope * reference) > kReferenceLevel * std::asinh(slope * white)) {
      high = middle;
    } else {
      low = middle;
    }
  }
  return std::exp((low + high) / 2);
}

std::uint16_t to_16_bits(double value) {
  return static_cast<std::uint16_t>(std::lround(65535 * std::clamp(value, 0.0, 1.0)));
}

/// The picture of one channel or three; works in place.
Picture stretch(Image channels) {
  const int planes = channels.planes();
  const auto count = static_cast<std::size_t>(channels.width()) * channels.height();
  Picture picture{channels.width(), channels.height(), std::vector<std::uint16_t>(3 * count)};
  if (count == 0) return picture;
  const std::size_t stride = (count + kMostSamples - 1) / kMostSamples;

  std::vector<double> light(planes), sigma(planes);
  for (int c = 0; c < planes; ++c) {
    double* values = channels.plane(c);
    const Sky sky = measure_sky(values, count, stride, channels.width());
    sigma[c] = sky.sigma;
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = std::max(values[i] - sky.level, 0.0);
      if (values[i] > kLightSigmas * sky.sigma) light[c] += values[i];
    }
  }
  const double mean_light = std::accumulate(light.begin(), light.end(), 0.0) / planes;
  std::vector<double> factors(planes, 0.0);
  for (int c = 0; c < planes; ++c) {
    if (light[c] > 0) factors[c] = std::pow(mean_light / light[c], kBalance);
  }
  // Stars are redder or bluer than each other, never greener.
  if (planes == 3 && *std::min_element(light.begin(), light.end()) > 0) {
    factors[1] = std::sqrt(factors[0] * light[0] * factors[2] * light[2]) / light[1];
  }
  double variance = 0;
  for (int c = 0; c < planes; ++c) {
    if (light[c] <= 0) continue;
    const double factor = factors[c];
    double* values = channels.plane(c);
    std::for_each(values, values + count, [factor](double& value) { value *= factor; });
    variance += std::pow(factor * sigma[c] / planes, 2);
  }

  const auto intensity = [&](std::size_t i) {
    double sum = 0;
    for (int c = 0; c < planes; ++c) sum += channels.plane(c)[i];
    return sum / planes;
  };
  std::vector<double> lit;
  const double threshold = kLightSigmas * std::sqrt(variance);
  for (std::size_t i = 0; i < count; i += stride) {
    const double value = intensity(i);
    if (value > threshold) lit.push_back(value);
  }
  if (lit.empty()) return picture;
  std::sort(lit.begin(), lit.end(), std::greater<>());
  const double white =
      lit[static_cast<std::size_t>((1 - kWhiteQuantile) * static_cast<double>(lit.size()))];
  const double total = std::accumulate(lit.begin(), lit.end(), 0.0);
  double sum = 0, reference = lit.back();
  for (const double value : lit) {
    sum += value;
    if (sum >= kReferenceLight * total) {
      reference = value;
      break;
    }
  }
  const double slope = solve_slope(reference, white);
  // The largest channel, not the mean, must fit: a red core would be a flat disc.
  std::vector<double> largest;
  for (std::size_t i = 0; i < count; i += stride) {
    const double mean = intensity(i);
    if (!(mean > threshold)) continue;
    double peak = 0;
    for (int c = 0; c < planes; ++c) peak = std::max(peak, channels.plane(c)[i]);
    largest.push_back(peak / mean * std::asinh(slope * mean));
  }
  const auto place =
      static_cast<std::ptrdiff_t>((1 - kWhiteQuantile) * static_cast<double>(largest.size()));
  std::nth_element(largest.begin(), largest.begin() + place, largest.end(), std::greater<>());
  const double scale = 1 / largest[static_cast<std::size_t>(place)];
  for (int y = 0; y < channels.height(); ++y) {
    std::uint16_t* out =
        &picture.rgb[static_cast<std::size_t>(channels.height() - 1 - y) * channels.width() * 3];
    for (int x = 0; x < channels.width(); ++x) {
      const auto value = [&](int c) { return channels.at(x, y, planes == 1 ? 0 : c); };
      for (const double channel : lupton_stretch({value(0), value(1), value(2)}, slope, scale)) {
        *out++ = to_16_bits(channel);
      }
    }
  }
  return picture;
}

class PictureWriter final : public ImageWriter {
 public:
  PictureWriter(const OutputOptions& options, const ImageHeader& header)
      : options_(options),
        planes_(header.planes()),
        weights_(channel_weights(planes_, header.wavelengths)),
        channels_(header.width, header.height, static_cast<int>(weights_.size())),
        written_(static_cast<std::size_t>(header.height)) {}

  void write_rows(int first, int count, std::span<const double> values) override {
    const int width = channels_.width();
    if (first < 0 || count < 0 || first > channels_.height() - count ||
        values.size() != static_cast<std::size_t>(count) * planes_ * width) {
      throw std::invalid_argument("picture: rows outside the image");
    }
    for (int row = 0; row < count; ++row) {
      const double* planes = values.data() + static_cast<std::size_t>(row) * planes_ * width;
      mix_row(
          weights_, width,
          [&](int plane) { return planes + static_cast<std::size_t>(plane) * width; },
          [&](int channel) { return &channels_.at(0, first + row, channel); });
    }
    std::fill_n(written_.begin() + first, count, true);
  }

  void finish() override {
    const auto missing = std::find(written_.begin(), written_.end(), false);
    if (missing != written_.end()) {
      throw RunError(fmt::format("{}: row {} was never written", options_.path.string(),
                                 missing - written_.begin()));
    }
    const Picture picture = stretch(std::move(channels_));
    if (image_suffix(options_.path) == ImageSuffix::bmp) {
      write_bmp_file(options_.path, picture, options_.overwrite);
    } else {
      write_png_file(options_.path, picture, options_.overwrite);
    }
  }

 private:
  OutputOptions options_;
  int planes_;
  std::vector<std::vector<double>> weights_;
  Image channels_;
  std::vector<bool> written_;
};

}  // namespace

std::uint64_t picture_memory(int width, int height, int planes) {
  const std::uint64_t channels = planes == 1 ? 1 : 3;
  const std::uint64_t per_pixel = channels * sizeof(double) + 3 * sizeof(std::uint16_t);
  return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * per_pixel +
         3 * kMostSamples * sizeof(double);
}

std::array<double, 3> lupton_stretch(const std::array<double, 3>& rgb, double slope, double scale) {
  const double intensity = (rgb[0] + rgb[1] + rgb[2]) / 3;
  if (!(intensity > 0)) return {0, 0, 0};
  const double factor = scale * std::asinh(slope * intensity) / intensity;
  std::array<double, 3> stretched = {rgb[0] * factor, rgb[1] * factor, rgb[2] * factor};
  const double largest = *std::max_element(stretched.begin(), stretched.end());
  if (largest > 1) {
    for (double& channel : stretched) channel /= largest;
  }
  return stretched;
}

Picture make_picture(const Image& image, const std::vector<double>& wavelengths) {
  const auto weights = channel_weights(image.planes(), wavelengths);
  Image channels(image.width(), image.height(), static_cast<int>(weights.size()));
  for (int y = 0; y < image.height(); ++y) {
    mix_row(
        weights, image.width(),
        [&](int plane) { return image.plane(plane) + static_cast<std::size_t>(y) * image.width(); },
        [&](int channel) { return &channels.at(0, y, channel); });
  }
  return stretch(std::move(channels));
}

std::unique_ptr<ImageWriter> make_picture_writer(const OutputOptions& options,
                                                 const ImageHeader& header) {
  return std::make_unique<PictureWriter>(options, header);
}

}  // namespace gamer
