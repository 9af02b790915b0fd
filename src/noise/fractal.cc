#include "gamer/noise/fractal.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/fractal.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "core/math-inl.h"
#include "gamer/core/error.h"
#include "gamer/core/random.h"

#ifndef GAMER_NOISE_FRACTAL_KERNEL
#define GAMER_NOISE_FRACTAL_KERNEL
namespace gamer {
namespace {

constexpr std::size_t moment_count = 8;  ///< of AddMoments()

}  // namespace
}  // namespace gamer
#endif

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

/// out = constant + sum of factor times value over so many arrays.
void Combine(std::size_t size, const float* const* values, const float* factors, std::size_t count,
             float constant, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto sum = hn::Set(d, constant);
    for (std::size_t k = 0; k < count; ++k) {
      sum = hn::MulAdd(hn::Load(d, values[k] + i), hn::Set(d, factors[k]), sum);
    }
    hn::Store(sum, d, out + i);
  }
}

/// Adds w, w x, w y, w x^2, w x y, w^2, w^2 x, w^2 x^2 to `sums`.
void AddMoments(std::size_t size, const float* HWY_RESTRICT weight, const float* x, const float* y,
                double* HWY_RESTRICT sums) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, decltype(d)> df;
  const auto load = [&](const float* from)
                        HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, from)); };
  auto w0 = hn::Zero(d), wx = w0, wy = w0, wxx = w0, wxy = w0, ww = w0, wwx = w0, wwxx = w0;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 0;
  for (; i + lanes <= size; i += lanes) {
    const auto w = load(weight + i);
    const auto own = load(x + i);
    const auto other = load(y + i);
    const auto light = hn::Mul(w, own);
    w0 = hn::Add(w0, w);
    wx = hn::Add(wx, light);
    wy = hn::MulAdd(w, other, wy);
    wxx = hn::MulAdd(light, own, wxx);
    wxy = hn::MulAdd(light, other, wxy);
    ww = hn::MulAdd(w, w, ww);
    wwx = hn::MulAdd(w, light, wwx);
    wwxx = hn::MulAdd(light, light, wwxx);
  }
  const decltype(w0) lanes_of[] = {w0, wx, wy, wxx, wxy, ww, wwx, wwxx};
  for (std::size_t k = 0; k < moment_count; ++k) {
    sums[k] += hn::GetLane(hn::SumOfLanes(d, lanes_of[k]));
  }
  for (; i < size; ++i) {
    const double w = weight[i], own = x[i], other = y[i];
    const double last[] = {w,     w * own,     w * other,        w * own * own, w * own * other,
                           w * w, w * w * own, w * own * w * own};
    for (std::size_t k = 0; k < moment_count; ++k) sums[k] += last[k];
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
HWY_EXPORT(Combine);
HWY_EXPORT(AddMoments);

namespace {

// Offsets stay within a few cells: they only keep lattice points of different octaves apart, and
// larger ones would cost precision.
constexpr double largest_offset = 16.0;

// An octave of frequency f has most of its power at 0.4 to 0.9 f. Over a square of side w that of
// wave number k keeps (sinc(pi k w))^2: half of its amplitude at k w = 0.6.
constexpr double fade_begin = 0.15;
constexpr double fade_end = 0.9;

// Corrections of hidden noise are taken at so many levels of h = sqrt(hidden variance).
constexpr int correction_levels = 8;

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

double FractalNoise::seen_octave(std::size_t k, double footprint) const {
  const double frequency = double{octaves_[k].frequency};
  const double u =
      std::clamp((fade_end - footprint * frequency) / (fade_end - fade_begin), 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

double FractalNoise::seen_share(double footprint) const {
  double total = 0, seen = 0;
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    const double share = seen_octave(k, footprint);
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

namespace {

/// Weighted means over points: of x, y, x^2, x y; and the standard error of the mean of x if the
/// points were independent.
struct Moments {
  double sums[moment_count] = {};

  void add(const WeightedBatch& batch, const float* x, const float* y) {
    HWY_DYNAMIC_DISPATCH(AddMoments)(batch.size, batch.weight.data(), x, y, sums);
  }
  double x() const { return sums[1] / sums[0]; }
  double y() const { return sums[2] / sums[0]; }
  double xx() const { return sums[3] / sums[0]; }
  double xy() const { return sums[4] / sums[0]; }
  double error() const {
    return std::sqrt(std::max(sums[7] - x() * (2 * sums[6] - x() * sums[5]), 0.0)) / sums[0];
  }
};

/// By the factor as rays of a footprint see it, where there is one.
void multiply(const WeightedBatch& batch, const FractalNoise::Factor& factor, double footprint,
              BatchArray& values) {
  if (!factor) return;
  BatchArray factors;
  factor(batch.points(), footprint, factors.data());
  for (std::size_t i = 0; i < batch.size; ++i) values[i] *= factors[i];
}

}  // namespace

CloudMean mean_over(std::span<const WeightedBatch> cloud, std::span<const BatchArray> values) {
  Moments moments;
  for (std::size_t b = 0; b < cloud.size(); ++b) {
    moments.add(cloud[b], values[b].data(), values[b].data());
  }
  return {moments.x(), moments.xx(), moments.error()};
}

void FractalNoise::take_mean(std::span<const WeightedBatch> cloud, const Factor& factor) {
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
    multiply(cloud[b], factor, 0, values[b]);
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

void FractalNoise::take_corrections(std::span<const WeightedBatch> cloud, const Factor& factor) {
  const std::size_t batches = cloud.size();
  const std::size_t octaves = octaves_.size();
  std::vector<BatchArray> values(batches * octaves), full(batches);
  double means = 0;
  for (std::size_t k = 0; k < octaves; ++k) {
    Octave own = octaves_[k];
    own.weight = 1;
    Moments moments;
    for (std::size_t b = 0; b < batches; ++b) {
      BatchArray& value = values[b * octaves + k];
      parameters_.kind->sum(cloud[b].points(), std::span(&own, 1), value.data());
      moments.add(cloud[b], value.data(), value.data());
    }
    const double weight = double{octaves_[k].weight};
    octave_mean_[k] = weight * moments.x();
    octave_variance_[k] = weight * weight * (moments.xx() - moments.x() * moments.x());
    means += octave_mean_[k];
  }
  // Together they are the mean of S over all points.
  octave_mean_.front() += mu_ - means;

  // Phi where rays of a footprint see it, times the factor.
  std::vector<const float*> octave(octaves);
  std::vector<float> seen(octaves);
  BatchArray hidden;
  const auto phi_at = [&](double width, std::size_t b, BatchArray& out) {
    double constant = 0;
    for (std::size_t k = 0; k < octaves; ++k) {
      const double share = seen_octave(k, width);
      octave[k] = values[b * octaves + k].data();
      seen[k] = static_cast<float>(share * double{octaves_[k].weight});
      constant += (1 - share) * octave_mean_[k];
    }
    const WeightedBatch& points = cloud[b];
    HWY_DYNAMIC_DISPATCH(Combine)
    (points.size, octave.data(), seen.data(), octaves, static_cast<float>(constant), out.data());
    shape_.apply_expected(standard(), 1 / phi_mean_, points.size, hidden.data(), correction_.data(),
                          out.data());
    multiply(points, factor, width, out);
  };
  correction_.fill(1.0f);
  std::fill_n(hidden.data(), batch_capacity, 0.0f);
  for (std::size_t b = 0; b < batches; ++b) phi_at(0, b, full[b]);
  // At equal steps of h. All of Phi, whose mean over the whole cloud is 1, is the control variate
  // of what is seen of it.
  std::array<double, correction_levels + 1> correction;
  correction[0] = 1;
  BatchArray part;
  for (int n = 1; n <= correction_levels; ++n) {
    const double h = static_cast<double>(n) / correction_levels;
    const double width = footprint_that_hides(h * h);
    std::fill_n(hidden.data(), batch_capacity, static_cast<float>(1 - seen_share(width)));
    Moments moments;
    for (std::size_t b = 0; b < batches; ++b) {
      phi_at(width, b, part);
      moments.add(cloud[b], full[b].data(), part.data());
    }
    const double variance = moments.xx() - moments.x() * moments.x();
    const double covariance = moments.xy() - moments.x() * moments.y();
    const double slope = variance > 0 ? covariance / variance : 0.0;
    correction[static_cast<std::size_t>(n)] = moments.y() - slope * (moments.x() - 1);
  }
  // Between them by cubics with the slopes of their neighbours (Catmull & Rom 1974).
  const auto at = [&](int n) {
    return correction[static_cast<std::size_t>(std::clamp(n, 0, correction_levels))];
  };
  for (int level = 1; level < NoiseShape::levels; ++level) {
    const double place = static_cast<double>(level) / (NoiseShape::levels - 1) * correction_levels;
    const int n = std::min(static_cast<int>(place), correction_levels - 1);
    const double u = place - n;
    const double left = 0.5 * (at(n + 1) - at(n - 1)), right = 0.5 * (at(n + 2) - at(n));
    const double rise = at(n + 1) - at(n);
    correction_[static_cast<std::size_t>(level)] = static_cast<float>(
        at(n) + u * (left + u * (3 * rise - 2 * left - right + u * (left + right - 2 * rise))));
  }
}

double FractalNoise::footprint_that_hides(double variance) const {
  double narrow = fade_begin / double{octaves_.back().frequency};
  double wide = fade_end / double{octaves_.front().frequency};
  if (!(1 - seen_share(wide) > variance)) return wide;
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = std::sqrt(narrow * wide);
    (1 - seen_share(middle) < variance ? narrow : wide) = middle;
  }
  return wide;
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
