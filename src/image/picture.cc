#include "gamer/image/picture.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <stdexcept>

#include "gamer/image/png_table.h"
#include "image/picture_grain.h"
#include "image/picture_psf.h"
#include "image/picture_size.h"
#include "image/write_file.h"

namespace gamer {
namespace {

constexpr std::size_t most_samples = std::size_t{1} << 20;
constexpr double black_quantile = 0.05;
/// Distance of the 5 % quantile below the middle of a Gaussian, sigmas.
constexpr double black_sigmas = 1.645;
/// sigma of a Gaussian divided by its median absolute deviation.
constexpr double sigma_per_median = 1.4826;
/// Pixels count as light if they are this many sigmas above the sky.
constexpr double light_sigmas = 3;
constexpr double balance = 0.5;
constexpr double white_quantile = 0.9999;
constexpr double reference_light = 0.8;
/// Among the brightest pixels that together hold the share `reference_light`, only the brightest
/// fifth, the middle, may exceed `middle_level`. Otherwise the middle of a galaxy without a bulge
/// would be white.
constexpr double middle_share = 0.2;
constexpr double middle_level = 0.54;
/// This limit needs a middle with more than so many times the pixels that may be beyond white.
constexpr double least_middle = 10;
/// Limits of a group of pixels in the balance of green. A group ends when its sums are this many
/// sigmas above the sky in all channels, or when it has the largest number of pixels.
constexpr double group_sigmas = 30;
constexpr int most_grouped = 4096;

/// Weight of each plane in each channel; there is one channel (grey) or three.
std::vector<std::vector<double>> channel_weights(int planes,
                                                 const std::vector<double>& wavelengths) {
  if (!wavelengths.empty() && wavelengths.size() != static_cast<std::size_t>(planes)) {
    throw std::invalid_argument("picture: wavelengths and planes differ in number");
  }
  if (planes == 1) return {{1.0}};
  std::vector<int> order(planes);
  std::iota(order.begin(), order.end(), 0);
  if (!wavelengths.empty()) {
    std::ranges::stable_sort(order, [&](int a, int b) { return wavelengths[a] > wavelengths[b]; });
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

/// Replaces values that are not finite by 0.
void drop_missing(double* values, int count) {
  for (int i = 0; i < count; ++i) values[i] = std::isfinite(values[i]) ? values[i] : 0;
}

/// Writes one channel of a row: `row_of(plane)` points to the plane's values in that row.
template <class RowOf>
void mix_row(const std::vector<double>& weights, int width, RowOf row_of, double* to) {
  std::fill_n(to, width, 0.0);
  for (std::size_t plane = 0; plane < weights.size(); ++plane) {
    const double weight = weights[plane];
    if (weight == 0) continue;
    const double* from = row_of(plane);
    for (int x = 0; x < width; ++x) to[x] += weight * from[x];
  }
  drop_missing(to, width);
}

class MixedPlane final : public Plane {
 public:
  MixedPlane(std::vector<PlanePtr> sources, std::vector<double> weights)
      : Plane(sources.front()->width(), sources.front()->height()) {
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if (weights[i] == 0) continue;
      sources_.push_back(std::move(sources[i]));
      weights_.push_back(weights[i]);
    }
  }

  Tile tile() const override { return sources_.front()->tile(); }

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    if (sources_.size() == 1 && weights_[0] == 1) {
      sources_[0]->read(area, out, stride);
      for (int row = 0; row < area.height; ++row) drop_missing(out + row * stride, area.width);
      return;
    }
    const std::size_t count = static_cast<std::size_t>(area.width) * area.height;
    std::vector<std::vector<double>> values(sources_.size());
    for (std::size_t plane = 0; plane < sources_.size(); ++plane) {
      values[plane].resize(count);
      sources_[plane]->read(area, values[plane].data(), area.width);
    }
    for (int row = 0; row < area.height; ++row) {
      const std::size_t first = static_cast<std::size_t>(row) * area.width;
      mix_row(
          weights_, area.width, [&](std::size_t plane) { return values[plane].data() + first; },
          out + row * stride);
    }
  }

 private:
  std::vector<PlanePtr> sources_;
  std::vector<double> weights_;
};

/// A plane of an image, which must outlive the plane.
class ImageView final : public Plane {
 public:
  ImageView(const Image& image, int plane)
      : Plane(image.width(), image.height()), values_(image.plane(plane)) {}

  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    for (int row = 0; row < area.height; ++row) {
      const std::size_t first = (static_cast<std::size_t>(area.y) + row) * width() + area.x;
      std::copy_n(values_ + first, area.width, out + row * stride);
    }
  }

 private:
  const double* values_;
};

std::vector<PlanePtr> views(const Image& image) {
  std::vector<PlanePtr> planes;
  for (int plane = 0; plane < image.planes(); ++plane) {
    planes.push_back(std::make_shared<ImageView>(image, plane));
  }
  return planes;
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

/// Evenly spread pixels of a channel, and their differences from their right neighbours.
struct Sample {
  std::vector<double> values, differences;
};

Sample take_sample(const Plane& channel, int threads, std::size_t stride) {
  Sample sample;
  std::size_t next = 0;
  const auto width = static_cast<std::size_t>(channel.width());
  for_each_band(channel, threads, [&](const Area& area, const double* values) {
    const std::size_t first = static_cast<std::size_t>(area.y) * width;
    const std::size_t end = first + static_cast<std::size_t>(area.height) * width;
    for (; next < end; next += stride) {
      const double* value = values + (next - first);
      sample.values.push_back(*value);
      const bool has_neighbour = (next + 1) % width != 0;
      if (has_neighbour) sample.differences.push_back(std::abs(value[1] - value[0]));
    }
  });
  return sample;
}

Sky measure_sky(const Sample& sample, std::optional<double> noise) {
  std::vector<double> values = sample.values, differences = sample.differences;
  const double low = quantile(values, black_quantile);
  if (noise) return {low + black_sigmas * *noise, *noise};
  const double middle = quantile(values, 0.5);
  double sigma = 0;
  if (!differences.empty()) {
    sigma = std::min(sigma_per_median * quantile(differences, 0.5) / std::sqrt(2.0),
                     (middle - low) / black_sigmas);
  }
  return {low + black_sigmas * sigma, sigma};
}

/// Calls use(light) with v - black of each channel in the pixels in which some channel is light. A
/// choice of pixels by channel would lose most of a faint channel's light and change the colour.
template <class Use>
void for_each_light(const std::vector<std::vector<double>>& channels,
                    const std::array<double, 3>& black, const std::array<double, 3>& sigma,
                    const Use& use) {
  for (std::size_t i = 0; i < channels.front().size(); ++i) {
    std::array<double, 3> light{};
    bool is_light = false;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      light[c] = channels[c][i] - black[c];
      is_light = is_light || light[c] > light_sigmas * sigma[c];
    }
    if (is_light) use(light);
  }
}

/// The excess of green at which half of the light is greener: g over the geometric mean of r and b,
/// each times its factor. Sums over groups of successive pixels count. A group ends as soon as its
/// noise is small in all channels, so that groups are single pixels where there is no noise.
double median_green(const std::vector<std::vector<double>>& channels,
                    const std::array<double, 3>& black, const std::array<double, 3>& sigma,
                    const std::array<double, 3>& factor) {
  struct Group {
    double excess, light;
  };
  std::vector<Group> groups;
  std::array<double, 3> sum{};
  int pixels = 0;
  double whole = 0;
  const auto end_group = [&] {
    const double r = factor[0] * sum[0], g = factor[1] * sum[1], b = factor[2] * sum[2];
    const double excess = !(g > 0) ? 0 : r > 0 && b > 0 ? g / std::sqrt(r * b) : HUGE_VAL;
    groups.push_back({excess, std::max(r + g + b, 0.0)});
    whole += groups.back().light;
    sum.fill(0);
    pixels = 0;
  };
  for_each_light(channels, black, sigma, [&](const std::array<double, 3>& light) {
    const double sigmas = group_sigmas * std::sqrt(++pixels);
    bool is_clear = true;
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += light[c];
      is_clear = is_clear && sum[c] > sigmas * sigma[c];
    }
    if (is_clear || pixels == most_grouped) end_group();
  });
  if (pixels > 0) end_group();
  std::ranges::stable_sort(groups, {}, &Group::excess);
  double below = 0;
  for (const Group& group : groups) {
    below += group.light;
    if (!(2 * below >= whole)) continue;
    return whole > 0 && group.excess > 0 && std::isfinite(group.excess) ? group.excess : 1;
  }
  return 1;
}

/// The slope for which asinh(slope value)/asinh(slope white) is `level`; this ratio grows with the
/// slope.
double solve_slope(double value, double level, double white) {
  constexpr double nearly_linear = 1e-3, steepest = 1e30;
  constexpr int bisections = 100;
  double low = std::log(nearly_linear / white), high = std::log(steepest / white);
  for (int i = 0; i < bisections; ++i) {
    const double middle = (low + high) / 2;
    const double slope = std::exp(middle);
    if (std::asinh(slope * value) > level * std::asinh(slope * white)) {
      high = middle;
    } else {
      low = middle;
    }
  }
  return std::exp((low + high) / 2);
}

/// The number of the largest of descending values that sum to a share of their total.
std::size_t count_at_light(std::span<const double> descending, double share) {
  const double total = std::accumulate(descending.begin(), descending.end(), 0.0);
  double sum = 0;
  for (std::size_t i = 0; i < descending.size(); ++i) {
    sum += descending[i];
    if (sum >= share * total) return i + 1;
  }
  return descending.size();
}

/// The quantile of `white_quantile` of descending values, interpolated between two of them.
double quantile_of_white(std::span<const double> descending) {
  const double place = (1 - white_quantile) * static_cast<double>(descending.size());
  const auto above = static_cast<std::size_t>(place);
  const std::size_t below = std::min(above + 1, descending.size() - 1);
  return std::lerp(descending[above], descending[below], place - static_cast<double>(above));
}

/// Slope and scale for sampled pixels whose black and factors are known.
void choose_stretch(const std::vector<std::vector<double>>& channels, double threshold,
                    PictureTone& tone) {
  std::vector<double> lit, peaks;
  for (std::size_t i = 0; i < channels.front().size(); ++i) {
    double sum = 0, peak = 0;
    for (const std::vector<double>& channel : channels) {
      sum += channel[i];
      peak = std::max(peak, channel[i]);
    }
    const double intensity = sum / static_cast<double>(channels.size());
    if (!(intensity > threshold)) continue;
    lit.push_back(intensity);
    peaks.push_back(peak / intensity);
  }
  if (lit.empty()) return;
  std::vector<double> sorted = lit;
  std::ranges::sort(sorted, std::greater<>());
  const double white = quantile_of_white(sorted);
  const std::size_t bright = count_at_light(sorted, reference_light);
  tone.slope = solve_slope(sorted[bright - 1], reference_level, white);
  const double middle = middle_share * static_cast<double>(bright);
  if (middle > least_middle * (1 - white_quantile) * static_cast<double>(sorted.size())) {
    const double edge = sorted[static_cast<std::size_t>(middle)];
    tone.slope = std::min(tone.slope, solve_slope(edge, middle_level, white));
  }
  // The scale follows the largest channel, not the mean: otherwise a red core would be a flat disc.
  std::vector<double>& largest = peaks;
  for (std::size_t i = 0; i < lit.size(); ++i) largest[i] *= std::asinh(tone.slope * lit[i]);
  std::ranges::sort(largest, std::greater<>());
  tone.scale = 1 / quantile_of_white(largest);
}

/// Writes the picture's rows from the top: calls `take(rgb)` with 3 * width values.
template <class Take>
void for_each_picture_row(const Image& channels, const PictureTone& tone, const PictureStyle& style,
                          Take take) {
  const PictureColours colours(tone, style, channels.planes());
  const auto width = static_cast<std::size_t>(channels.width());
  const auto planes = static_cast<std::size_t>(channels.planes());
  PictureGrain grain(style, channels.width(), channels.height(), channels.planes());
  const std::vector<double> even(width * planes);
  std::vector<std::uint16_t> row(width * 3);
  for (int y = channels.height() - 1; y >= 0; --y) {
    const std::span<const double> noise = style.grain > 0 ? grain.row(y) : even;
    std::uint16_t* out = row.data();
    for (int x = 0; x < channels.width(); ++x) {
      const double* pixel_noise = noise.data() + static_cast<std::size_t>(x) * planes;
      std::array<double, 3> light, noises;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t plane = planes == 1 ? 0 : c;
        light[c] = channels.at(x, y, static_cast<int>(plane));
        noises[c] = pixel_noise[plane];
      }
      for (const double channel : colours.colour(light, noises)) *out++ = to_16_bits(channel);
    }
    take(row);
  }
}

class PictureWriter final : public ImageWriter {
 public:
  PictureWriter(const OutputOptions& options, const ImageHeader& header)
      : options_(options),
        planes_(header.planes()),
        width_(header.width),
        faces_(header.faces),
        weights_(channel_weights(planes_, header.wavelengths)),
        factors_(channel_factors(planes_, header.wavelengths,
                                 light_of_unit(header.wavelengths, zero_points_of(header)))),
        channels_(picture_extent(header).first, picture_extent(header).second,
                  static_cast<int>(weights_.size())),
        written_(static_cast<std::size_t>(header.height)) {
    if (faces_.empty()) faces_.resize(1);
    if (picture_format(options.path.string()) == PictureFormat::bmp) return;
    for (const TextTable& table : header.tables) tables_.push_back(pack_png_table(table));
  }

  void write_rows(int first, int count, std::span<const double> values) override {
    const int width = width_, height = static_cast<int>(written_.size());
    const int face_height = height / static_cast<int>(faces_.size());
    if (first < 0 || count < 0 || first > height - count ||
        values.size() != static_cast<std::size_t>(count) * planes_ * width) {
      throw std::invalid_argument("picture: rows outside the image");
    }
    for (int row = 0; row < count; ++row) {
      const double* planes = values.data() + static_cast<std::size_t>(row) * planes_ * width;
      const ImageFace& face = faces_[(first + row) / face_height];
      const int x = face.column * width;
      const int y = face.row * face_height + (first + row) % face_height;
      for (std::size_t channel = 0; channel < weights_.size(); ++channel) {
        mix_row(
            weights_[channel], width, [&](std::size_t plane) { return planes + plane * width; },
            &channels_.at(x, y, static_cast<int>(channel)));
      }
    }
    std::fill_n(written_.begin() + first, count, true);
  }

  void finish() override {
    check_all_written(written_, options_.path, "row", 0);
    const PictureTone tone = options_.tone ? PictureTone::of_numbers(*options_.tone)
                                           : automatic_tone(views(channels_), 1, {}, {}, factors_);
    PictureFileOptions options;
    options.name = options_.path.string();
    options.format = picture_format(options.name).value_or(PictureFormat::png);
    options.overwrite = options_.overwrite;
    options.tables = std::move(tables_);
    if (options_.style.seeing > 0) blur(channels_, picture_psf(options_.style));
    PictureFile file(options, channels_.width(), channels_.height());
    for_each_picture_row(channels_, tone, options_.style,
                         [&](std::span<const std::uint16_t> row) { file.write_row(row); });
    file.finish();
  }

 private:
  OutputOptions options_;
  int planes_, width_;
  std::vector<ImageFace> faces_;
  std::vector<std::vector<double>> weights_;
  std::array<double, 3> factors_;
  Image channels_;
  std::vector<bool> written_;
  std::vector<std::vector<unsigned char>> tables_;  ///< of a PNG
};

}  // namespace

std::pair<int, int> picture_extent(const ImageHeader& header) {
  if (header.faces.empty()) return {header.width, header.height};
  const int height = header.height / static_cast<int>(header.faces.size());
  int columns = 0, rows = 0;
  for (const ImageFace& face : header.faces) {
    columns = std::max(columns, face.column + 1);
    rows = std::max(rows, face.row + 1);
  }
  return {columns * header.width, rows * height};
}

std::uint64_t picture_memory(int width, int height, int planes, const PictureStyle& style) {
  const std::uint64_t channels = planes == 1 ? 1 : 3;
  // Bytes per sampled pixel: values and differences of each channel, and copies for quantiles.
  constexpr std::uint64_t per_sample = 10 * sizeof(double);
  return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * channels *
             sizeof(double) +
         most_samples * per_sample + (style.seeing > 0 ? blur_memory(width, height, style) : 0);
}

std::vector<PlanePtr> picture_channels(const std::vector<PlanePtr>& planes,
                                       const std::vector<double>& wavelengths) {
  std::vector<PlanePtr> channels;
  for (std::vector<double>& weights :
       channel_weights(static_cast<int>(planes.size()), wavelengths)) {
    channels.push_back(std::make_shared<MixedPlane>(planes, std::move(weights)));
  }
  return channels;
}

PictureTone automatic_tone(std::span<const PlanePtr> channels, int threads,
                           const std::optional<std::array<double, 3>>& black,
                           const std::optional<std::array<double, 3>>& factor,
                           const std::array<double, 3>& channel_factors,
                           std::optional<double> noise) {
  const std::size_t planes = channels.size();
  const std::size_t count = static_cast<std::size_t>(channels[0]->width()) *
                            static_cast<std::size_t>(channels[0]->height());
  const std::size_t stride = (count + most_samples - 1) / most_samples;
  PictureTone tone;
  std::vector<std::vector<double>> samples;
  std::array<double, 3> sigma{};
  for (std::size_t c = 0; c < planes; ++c) {
    Sample sample = take_sample(*channels[c], threads, stride);
    const Sky sky = measure_sky(sample, noise);
    sigma[c] = sky.sigma;
    tone.black[c] = black ? (*black)[c] : sky.level;
    samples.push_back(std::move(sample.values));
  }
  std::array<double, 3> light{};
  for_each_light(samples, tone.black, sigma, [&](const std::array<double, 3>& of_pixel) {
    for (std::size_t c = 0; c < planes; ++c) light[c] += channel_factors[c] * of_pixel[c];
  });
  const double mean_light =
      std::accumulate(light.begin(), light.end(), 0.0) / static_cast<double>(planes);
  for (std::size_t c = 0; c < planes; ++c) {
    if (light[c] > 0 && mean_light > 0) tone.factor[c] = std::pow(mean_light / light[c], balance);
  }
  for (std::size_t c = 0; c < planes; ++c) tone.factor[c] *= channel_factors[c];
  // Stars differ in redness or blueness, but are never green.
  if (planes == 3 && *std::ranges::min_element(light) > 0) {
    tone.factor[1] /= median_green(samples, tone.black, sigma, tone.factor);
  }
  if (factor) tone.factor = *factor;
  double variance = 0;
  for (std::size_t c = 0; c < planes; ++c) {
    for (double& value : samples[c]) value = std::max(value - tone.black[c], 0.0) * tone.factor[c];
    if (light[c] > 0) {
      variance += std::pow(tone.factor[c] * sigma[c] / static_cast<double>(planes), 2);
    }
  }
  if (planes == 1) {
    tone.black.fill(tone.black[0]);
    tone.factor.fill(tone.factor[0]);
  }
  choose_stretch(samples, light_sigmas * std::sqrt(variance), tone);
  return tone;
}

std::uint16_t to_16_bits(double value) {
  if (std::isnan(value)) return 0;
  return static_cast<std::uint16_t>(std::lround(65535 * std::clamp(value, 0.0, 1.0)));
}

std::vector<double> picture_white(const PictureTone& tone, int planes,
                                  const std::vector<double>& wavelengths) {
  if (!(tone.slope > 0) || !(tone.scale > 0)) return {};
  const double channel = std::sinh(1 / tone.scale) / tone.slope;
  const auto weights = channel_weights(planes, wavelengths);
  std::vector<double> white;
  for (std::size_t p = 0; p < static_cast<std::size_t>(planes); ++p) {
    std::size_t own = 0;
    for (std::size_t c = 1; c < weights.size(); ++c) {
      if (weights[c][p] > weights[own][p]) own = c;
    }
    white.push_back(channel / tone.factor[own]);
  }
  return white;
}

std::vector<double> light_of_unit(const std::vector<double>& wavelengths,
                                  const std::vector<double>& zero_points) {
  std::vector<double> light;
  if (wavelengths.empty() || zero_points.empty()) return light;
  if (wavelengths.size() != zero_points.size()) {
    throw std::invalid_argument("picture: wavelengths and zero points differ in number");
  }
  for (std::size_t p = 0; p < wavelengths.size(); ++p) {
    light.push_back(std::pow(10, -0.4 * (zero_points[p] - zero_points[0])) *
                    std::pow(wavelengths[0] / wavelengths[p], 2));
  }
  return light;
}

std::array<double, 3> channel_factors(int planes, const std::vector<double>& wavelengths,
                                      const std::vector<double>& light) {
  if (planes == 1 || light.empty()) return {1, 1, 1};
  const auto weights = channel_weights(planes, wavelengths);
  std::array<double, 3> factors{};
  for (std::size_t c = 0; c < factors.size(); ++c) {
    factors[c] = std::inner_product(light.begin(), light.end(), weights[c].begin(), 0.0);
  }
  const double mean = std::cbrt(factors[0] * factors[1] * factors[2]);
  if (!std::isfinite(mean) || !(mean > 0)) return {1, 1, 1};
  for (double& factor : factors) factor /= mean;
  return factors;
}

std::vector<double> zero_points_of(const ImageHeader& header) {
  std::vector<double> zero_points;
  for (const std::vector<Card>& cards : header.plane_cards) {
    const auto found = std::ranges::find(cards, "MAGZERO", &Card::key);
    const double* zero_point = found == cards.end() ? nullptr : std::get_if<double>(&found->value);
    if (zero_point == nullptr) return {};
    zero_points.push_back(*zero_point);
  }
  if (zero_points.size() != static_cast<std::size_t>(header.planes())) return {};
  return zero_points;
}

PictureTone choose_tone(const Image& image, const std::vector<double>& wavelengths,
                        const std::vector<double>& zero_points,
                        const std::optional<std::array<double, 3>>& black,
                        std::optional<double> noise) {
  return automatic_tone(
      picture_channels(views(image), wavelengths), 1, black, {},
      channel_factors(image.planes(), wavelengths, light_of_unit(wavelengths, zero_points)), noise);
}

Picture make_picture(const Image& image, const std::vector<double>& wavelengths,
                     const std::vector<double>& zero_points) {
  const std::vector<PlanePtr> planes = picture_channels(views(image), wavelengths);
  Image channels(image.width(), image.height(), static_cast<int>(planes.size()));
  for (std::size_t c = 0; c < planes.size(); ++c) {
    planes[c]->read(planes[c]->whole(), channels.plane(static_cast<int>(c)));
  }
  const PictureTone tone = automatic_tone(
      views(channels), 1, {}, {},
      channel_factors(image.planes(), wavelengths, light_of_unit(wavelengths, zero_points)));
  Picture picture{image.width(), image.height(), {}};
  for_each_picture_row(channels, tone, {}, [&](const std::vector<std::uint16_t>& row) {
    picture.rgb.insert(picture.rgb.end(), row.begin(), row.end());
  });
  return picture;
}

std::unique_ptr<ImageWriter> make_picture_writer(const OutputOptions& options,
                                                 const ImageHeader& header) {
  return std::make_unique<PictureWriter>(options, header);
}

}  // namespace gamer
