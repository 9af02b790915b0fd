#include "gamer/noise/fractal.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/fractal.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "core/math-inl.h"
#include "gamer/core/error.h"
#include "gamer/core/random.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Adds what a footprint sees of one octave.
void AddOctave(std::size_t size, const float* HWY_RESTRICT value,
               const float* HWY_RESTRICT footprint, const OctaveInput& in, SeenNoise& out) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto u = hn::NegMulAdd(hn::Load(d, footprint + i), hn::Set(d, in.fade_slope),
                           hn::Set(d, in.fade_shift));
    u = hn::Min(hn::Max(u, hn::Zero(d)), one);
    const auto seen = hn::Mul(hn::Mul(u, u), hn::NegMulAdd(hn::Set(d, 2.0f), u, hn::Set(d, 3.0f)));
    auto sum = hn::Load(d, out.sum.data() + i);
    sum = hn::MulAdd(hn::Load(d, value + i), hn::Mul(seen, hn::Set(d, in.weight)), sum);
    sum = hn::MulAdd(hn::Sub(one, seen), hn::Set(d, in.weighted_mean), sum);
    hn::Store(sum, d, out.sum.data() + i);
    const auto rest = hn::NegMulAdd(seen, seen, one);
    hn::Store(hn::MulAdd(rest, hn::Set(d, in.share), hn::Load(d, out.hidden.data() + i)), d,
              out.hidden.data() + i);
    hn::Store(hn::MulAdd(rest, hn::Set(d, in.coherent_share), hn::Load(d, out.coherent.data() + i)),
              d, out.coherent.data() + i);
  }
}

/// sum + step * coherent, and what is left hidden.
void Deviate(std::size_t size, const SeenNoise& seen, float step, float* HWY_RESTRICT sum,
             float* HWY_RESTRICT hidden) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto coherent = hn::Load(d, seen.coherent.data() + i);
    const auto root = hn::Sqrt(coherent);
    hn::Store(hn::MulAdd(root, hn::Set(d, step), hn::Load(d, seen.sum.data() + i)), d, sum + i);
    const auto rest = hn::Sub(hn::Load(d, seen.hidden.data() + i), coherent);
    hn::Store(hn::Max(rest, hn::Zero(d)), d, hidden + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(AddOctave);
HWY_EXPORT(Deviate);

namespace {

// Offsets stay within a few cells: they only keep lattice points of different octaves apart, and
// larger ones would cost precision.
constexpr double largest_offset = 16.0;

// An octave of frequency f has most of its power at 0.4 to 0.9 f. Over a square of side w that of
// wave number k keeps (sinc(pi k w))^2: half of its amplitude at k w = 0.6.
constexpr double fade_begin = 0.15;
constexpr double fade_end = 0.9;

// Octaves' own statistics and the corrections of hidden noise are taken over about so many points
// of the cloud, the latter at so many footprints.
constexpr std::size_t octave_points = std::size_t{1} << 16;
constexpr int correction_footprints = 32;

// 2^63, above every 64-bit integer.
constexpr double largest_seed = 0x1p63;

// Of S over the points, relative to independent octaves: below, rounding would take the place of
// the noise.
constexpr double smallest_variation = 1e-4;

// With this floor |v|^-20 stays within single precision.
constexpr double smallest_floor = 1e-2;

}  // namespace

ParameterTable FractalParameters::table() const {
  return {
      {"octaves", ParameterType::integer, "", Interval::closed(1, 32), std::int64_t{octaves},
       "omega, number of octaves; `noise.octaves` of the render parameters where neither says"},
      {"k0", ParameterType::number, "cycles per galaxy radius", Interval::closed(0, 1000), k0,
       "offset of the frequencies k0 + f_s k"},
      {"frequency_scale", ParameterType::number, "cycles per galaxy radius",
       Interval::left_open(0, 1000), frequency_scale, "f_s, spacing of the frequencies"},
      {"spectral_index", ParameterType::number, "", Interval::closed(-10, 10), spectral_index,
       "nu: octave k has weight (k0 + f_s k)^-nu"},
      {"exponent", ParameterType::number, "", Interval::closed(-20, 20), exponent,
       "alpha, power of the shaped noise"},
      {"theta",
       ParameterType::choice,
       "",
       Interval::any(),
       std::string(inverse ? "inverse" : "linear"),
       "shape: linear max(v, 0)^alpha or inverse max(|v|, floor)^-alpha",
       {"linear", "inverse"}},
      {"offset", ParameterType::number, "sigmas", Interval::closed(-10, 10), offset,
       "added to the normalised sum"},
      {"contrast", ParameterType::number, "", Interval::left_open(0, 10), contrast,
       "factor of the normalised sum"},
      {"floor", ParameterType::number, "sigmas", Interval::closed(smallest_floor, 10), floor,
       "least |v| of the inverse shape"},
      {"seed",
       ParameterType::integer,
       "",
       Interval::closed(0, largest_seed),
       {},
       "seed of this component's noise; default: from the galaxy's seed and the component's name"},
  };
}

void FractalParameters::apply(const ParameterSet& values, const std::string& context) {
  octaves = static_cast<int>(values.integer("octaves"));
  k0 = values.number("k0");
  frequency_scale = values.number("frequency_scale");
  spectral_index = values.number("spectral_index");
  exponent = values.number("exponent");
  inverse = values.text("theta") == "inverse";
  offset = values.number("offset");
  contrast = values.number("contrast");
  floor = values.number("floor");
  if (values.has("seed")) seed = static_cast<std::uint64_t>(values.integer("seed"));
  if (!inverse && exponent < 0) {
    throw InputError(values.where("exponent"),
                     context +
                         "exponent below 0 has no meaning where theta is 'linear'; use "
                         "theta = \"inverse\" with a positive exponent");
  }
}

FractalNoise::FractalNoise(const FractalParameters& parameters, double thickness)
    : parameters_(parameters),
      shape_({parameters.exponent, parameters.inverse, parameters.offset, parameters.contrast,
              parameters.floor}) {
  correction_.fill(1.0f);
  double variance = 0;
  for (int k = 1; k <= parameters.octaves; ++k) {
    const double frequency = parameters.k0 + parameters.frequency_scale * k;
    const double weight = std::pow(frequency, -parameters.spectral_index);
    const auto index = static_cast<std::uint64_t>(k);
    Octave octave;
    octave.frequency = static_cast<float>(frequency);
    octave.weight = static_cast<float>(weight);
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      octave.offset[axis] =
          static_cast<float>(largest_offset * to_unit(hash_words({parameters.seed, index, axis})));
    }
    octave.seed = static_cast<std::uint32_t>(hash_words({parameters.seed, index, 3}));
    octaves_.push_back(octave);
    octave_mean_.push_back(0.0);
    octave_variance_.push_back(weight * weight * parameters.kind->variance());
    // The mean of a noise of correlation length 1/(2 f) through the layer.
    coherence_.push_back(1 / (1 + 2 * frequency * thickness));
    variance += weight * weight;
  }
  independent_sigma_ = std::sqrt(variance * parameters.kind->variance());
  sigma_ = independent_sigma_;
}

void FractalNoise::sum(const Points& points, float* out) const {
  parameters_.kind->sum(points, octaves_, out);
}

void FractalNoise::evaluate(const Points& points, float* out) const {
  sum(points, out);
  shape_.apply(standard(), 1 / phi_mean_, points.size, out);
}

bool FractalNoise::hides(double footprint) const {
  return footprint * double{octaves_.back().frequency} > fade_begin;
}

OctaveInput FractalNoise::octave_input(std::size_t k) const {
  double total = 0;
  for (const double variance : octave_variance_) total += variance;
  const double share = octave_variance_[k] / total;
  OctaveInput in{};
  in.weight = octaves_[k].weight;
  in.weighted_mean = static_cast<float>(octave_mean_[k]);
  in.share = static_cast<float>(share);
  in.coherent_share = static_cast<float>(share * coherence_[k]);
  in.fade_slope = static_cast<float>(double{octaves_[k].frequency} / (fade_end - fade_begin));
  in.fade_shift = static_cast<float>(fade_end / (fade_end - fade_begin));
  return in;
}

double FractalNoise::seen_share(double footprint) const {
  double total = 0, seen = 0;
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    const double frequency = double{octaves_[k].frequency};
    const double u =
        std::clamp((fade_end - footprint * frequency) / (fade_end - fade_begin), 0.0, 1.0);
    const double share = u * u * (3 - 2 * u);
    total += octave_variance_[k];
    seen += octave_variance_[k] * share * share;
  }
  return seen / total;
}

void FractalNoise::see(const Points& points, const float* footprint, SeenNoise& out,
                       std::uint64_t& evaluations) const {
  const auto [least, most] = std::minmax_element(footprint, footprint + points.size);
  std::fill_n(out.hidden.data(), padded(points.size), 0.0f);
  std::fill_n(out.coherent.data(), padded(points.size), 0.0f);
  if (!hides(double{*most})) {
    sum(points, out.sum.data());
    evaluations += points.size * octaves_.size();
    return;
  }
  std::fill_n(out.sum.data(), padded(points.size), 0.0f);
  BatchArray value;
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    Octave octave = octaves_[k];
    if (double{*least} * double{octave.frequency} < fade_end) {
      octave.weight = 1;
      parameters_.kind->sum(points, std::span(&octave, 1), value.data());
      evaluations += points.size;
    } else {
      std::fill_n(value.data(), padded(points.size), 0.0f);
    }
    HWY_DYNAMIC_DISPATCH(AddOctave)(points.size, value.data(), footprint, octave_input(k), out);
  }
}

void FractalNoise::expect(std::size_t size, const SeenNoise& seen, float* out) const {
  std::copy_n(seen.sum.data(), padded(size), out);
  shape_.apply_expected(standard(), 1 / phi_mean_, size, seen.hidden.data(), correction_.data(),
                        out);
}

void FractalNoise::expect(std::size_t size, const SeenNoise& seen, double deviation,
                          float* out) const {
  BatchArray hidden;
  HWY_DYNAMIC_DISPATCH(Deviate)
  (size, seen, static_cast<float>(deviation * sigma_), out, hidden.data());
  shape_.apply_expected(standard(), 1 / phi_mean_, size, hidden.data(), correction_.data(), out);
}

CloudMean mean_over(std::span<const WeightedBatch> cloud, std::span<const BatchArray> values) {
  double w = 0, wv = 0, wvv = 0, ww = 0, wwv = 0, wwvv = 0;
  for (std::size_t b = 0; b < cloud.size(); ++b) {
    for (std::size_t i = 0; i < cloud[b].size; ++i) {
      const double weight = cloud[b].weight[i];
      const double value = values[b][i];
      w += weight;
      wv += weight * value;
      wvv += weight * value * value;
      ww += weight * weight;
      wwv += weight * weight * value;
      wwvv += weight * weight * value * value;
    }
  }
  CloudMean result;
  result.mean = wv / w;
  result.square_mean = wvv / w;
  result.error = std::sqrt(std::max(wwvv - result.mean * (2 * wwv - result.mean * ww), 0.0)) / w;
  return result;
}

namespace {

/// By factors of which a share is seen.
void multiply(std::span<const WeightedBatch> cloud, std::size_t stride,
              std::span<const BatchArray> factors, double seen, std::vector<BatchArray>& values) {
  for (std::size_t b = 0; b < values.size(); ++b) {
    const BatchArray& own = factors[b * stride];
    for (std::size_t i = 0; i < cloud[b * stride].size; ++i) {
      values[b][i] *= static_cast<float>(1 + seen * (double{own[i]} - 1));
    }
  }
}

}  // namespace

void FractalNoise::normalise(std::span<const WeightedBatch> cloud, const Factors* factors) {
  std::vector<BatchArray> values(cloud.size());
  for (std::size_t b = 0; b < cloud.size(); ++b) sum(cloud[b].points(), values[b].data());
  const CloudMean raw = mean_over(cloud, values);
  mu_ = raw.mean;
  sigma_ = std::sqrt(std::max(raw.square_mean - mu_ * mu_, 0.0));
  if (!std::isfinite(sigma_)) {
    throw InputError("the noise is infinite; change its spectral index or frequencies");
  }
  if (sigma_ < smallest_variation * independent_sigma_) {
    throw InputError("the noise hardly varies over the whole component; raise its frequencies");
  }
  for (std::size_t b = 0; b < cloud.size(); ++b) {
    shape_.apply(standard(), 1, cloud[b].size, values[b].data());
  }
  if (factors != nullptr) multiply(cloud, 1, factors->values, 1, values);
  const CloudMean light = mean_over(cloud, values);
  // A noise that is dark everywhere (a very negative offset) has no mean to divide by.
  if (!(light.mean > 0) || !std::isfinite(light.square_mean)) {
    throw InputError(
        "the noise is zero or infinite over the whole component; change its offset, "
        "contrast or exponent");
  }
  phi_mean_ = light.mean;
  phi_rms_ = std::sqrt(light.square_mean) / light.mean;
  mean_error_ = light.error / light.mean;
  take_corrections(cloud, factors);
}

void FractalNoise::take_corrections(std::span<const WeightedBatch> cloud, const Factors* factors) {
  std::size_t all = 0;
  for (const WeightedBatch& batch : cloud) all += batch.size;
  // Batches follow each other along the cloud's cells: every stride-th is a fair sample.
  const std::size_t stride = std::max<std::size_t>(all / octave_points, 1);
  std::vector<WeightedBatch> points;
  for (std::size_t b = 0; b < cloud.size(); b += stride) points.push_back(cloud[b]);
  std::vector<std::vector<BatchArray>> octave(octaves_.size());
  std::vector<BatchArray> values(points.size());
  double means = 0;
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    Octave own = octaves_[k];
    own.weight = 1;
    octave[k].resize(points.size());
    for (std::size_t b = 0; b < points.size(); ++b) {
      parameters_.kind->sum(points[b].points(), std::span(&own, 1), octave[k][b].data());
    }
    const CloudMean mean = mean_over(points, octave[k]);
    const double weight = double{octaves_[k].weight};
    octave_mean_[k] = weight * mean.mean;
    octave_variance_[k] = weight * weight * (mean.square_mean - mean.mean * mean.mean);
    means += octave_mean_[k];
  }
  // Together they are the mean of S over all points.
  octave_mean_.front() += mu_ - means;

  // Of each footprint, from where the finest octave begins to fade to where the coarsest is gone.
  std::vector<double> hidden, correction;
  const double finest = fade_begin / double{octaves_.back().frequency};
  const double coarsest = fade_end / double{octaves_.front().frequency};
  SeenNoise seen;
  BatchArray footprint;
  double sampled = 0;
  correction_.fill(1.0f);
  for (int n = 0; n <= correction_footprints; ++n) {
    const double width =
        finest * std::pow(coarsest / finest, static_cast<double>(n) / correction_footprints);
    std::fill_n(footprint.data(), batch_capacity, static_cast<float>(width));
    for (std::size_t b = 0; b < points.size(); ++b) {
      for (BatchArray* start : {&seen.sum, &seen.hidden, &seen.coherent}) {
        std::fill_n(start->data(), padded(points[b].size), 0.0f);
      }
      for (std::size_t k = 0; k < octaves_.size(); ++k) {
        HWY_DYNAMIC_DISPATCH(AddOctave)
        (points[b].size, octave[k][b].data(), footprint.data(), octave_input(k), seen);
      }
      expect(points[b].size, seen, values[b].data());
    }
    if (factors != nullptr) multiply(cloud, stride, factors->values, factors->seen(width), values);
    const double mean = mean_over(points, values).mean;
    const double h = seen.hidden[0];
    // The points' own error fades with what they see.
    if (n == 0) sampled = mean;
    hidden.push_back(h);
    correction.push_back(mean / std::pow(sampled, 1 - h));
  }
  for (int level = 1; level < NoiseShape::levels; ++level) {
    const double h = std::pow(static_cast<double>(level) / (NoiseShape::levels - 1), 2);
    const auto above = std::lower_bound(hidden.begin(), hidden.end(), h) - hidden.begin();
    const auto i = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(hidden.size()) - 1));
    const double width = hidden[i] - hidden[i - 1];
    const double share = width > 0 ? std::clamp((h - hidden[i - 1]) / width, 0.0, 1.0) : 1.0;
    correction_[static_cast<std::size_t>(level)] =
        static_cast<float>(correction[i - 1] + share * (correction[i] - correction[i - 1]));
  }
}

double FractalNoise::effective_frequency() const {
  double weights = 0, squares = 0;
  for (const Octave& octave : octaves_) {
    const double variance = double{octave.weight} * octave.weight;
    weights += variance;
    squares += variance * octave.frequency * octave.frequency;
  }
  return std::sqrt(squares / weights);
}

double FractalNoise::sharpness() const {
  // A power alpha narrows Gaussian peaks by sqrt(alpha); the inverse has ridges where |v| < floor.
  const double narrowing = std::sqrt(std::max(std::abs(parameters_.exponent), 1.0));
  return parameters_.inverse ? std::max(narrowing, 1 / std::sqrt(parameters_.floor)) : narrowing;
}

}  // namespace gamer
#endif
