#include "gamer/noise/fractal.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/fractal.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "core/math-inl.h"
#include "gamer/core/error.h"
#include "gamer/core/random.h"

#ifndef GAMER_NOISE_FRACTAL_SHAPE
#define GAMER_NOISE_FRACTAL_SHAPE
namespace gamer {
namespace {

/// v = shift + slope S, then the power; see FractalNoise.
struct Shape {
  float slope;
  float shift;
  float floor;
  float exponent;
  float scale;
  int whole_exponent;  ///< |exponent| where it is a small whole number, else -1
  bool inverse;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Relative error below max(1, |alpha|) (2e-7 + 2e-8/|v|), the second term from the rounding of v.
void ApplyShape(const Shape& shape, std::size_t size, float* HWY_RESTRICT values) {
  const hn::ScalableTag<float> d;
  const auto slope = hn::Set(d, shape.slope);
  const auto shift = hn::Set(d, shape.shift);
  const auto scale = hn::Set(d, shape.scale);
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto v = hn::MulAdd(hn::Load(d, values + i), slope, shift);
    auto base =
        shape.inverse ? hn::Max(hn::Abs(v), hn::Set(d, shape.floor)) : hn::Max(v, hn::Zero(d));
    auto phi = one;
    if (shape.whole_exponent >= 0) {
      for (int n = shape.whole_exponent; n > 0; n >>= 1) {
        if (n & 1) phi = hn::Mul(phi, base);
        base = hn::Mul(base, base);
      }
      if (shape.exponent < 0) phi = hn::Div(one, phi);
    } else {
      phi = Pow(d, base, hn::Set(d, shape.exponent));
    }
    hn::Store(hn::Mul(phi, scale), d, values + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(ApplyShape);

namespace {

// Offsets stay within a few cells: they only keep lattice points of different octaves apart, and
// larger ones would cost precision.
constexpr double largest_offset = 16.0;

// Whole powers up to here are multiplied out; beyond, e^(alpha ln v) is as fast.
constexpr double largest_whole_exponent = 20.0;

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

FractalNoise::FractalNoise(const FractalParameters& parameters) : parameters_(parameters) {
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
    variance += weight * weight;
  }
  independent_sigma_ = std::sqrt(variance * parameters.kind->variance());
  sigma_ = independent_sigma_;
}

void FractalNoise::sum(const Points& points, float* out) const {
  parameters_.kind->sum(points, octaves_, out);
}

void FractalNoise::shape(std::size_t size, float* values) const {
  const double exponent = parameters_.inverse ? -parameters_.exponent : parameters_.exponent;
  const bool whole =
      std::abs(exponent) <= largest_whole_exponent && exponent == std::trunc(exponent);
  Shape shape{};
  shape.slope = static_cast<float>(parameters_.contrast / sigma_);
  shape.shift = static_cast<float>(parameters_.offset - parameters_.contrast * mu_ / sigma_);
  shape.floor = static_cast<float>(parameters_.floor);
  shape.exponent = static_cast<float>(exponent);
  shape.scale = static_cast<float>(1 / phi_mean_);
  shape.whole_exponent = whole ? static_cast<int>(std::abs(exponent)) : -1;
  shape.inverse = parameters_.inverse;
  HWY_DYNAMIC_DISPATCH(ApplyShape)(shape, size, values);
}

void FractalNoise::evaluate(const Points& points, float* out) const {
  sum(points, out);
  shape(points.size, out);
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

void FractalNoise::normalise(std::span<const WeightedBatch> cloud,
                             std::span<const BatchArray> factors) {
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
  phi_mean_ = 1;
  for (std::size_t b = 0; b < cloud.size(); ++b) {
    shape(cloud[b].size, values[b].data());
    if (factors.empty()) continue;
    for (std::size_t i = 0; i < cloud[b].size; ++i) values[b][i] *= factors[b][i];
  }
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
