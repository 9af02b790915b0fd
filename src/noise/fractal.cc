#include "gamer/noise/fractal.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/fractal.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/math-inl.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/noise/footprint.h"
#include "noise/lattice.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Combines octaves by the shares that footprints resolve. No footprint resolves octaves from
/// `in_sight` on; these count by their means.
template <Combination::Kind kind>
HWY_INLINE void SeeOctavesOf(std::size_t size, const float* HWY_RESTRICT footprint,
                             std::span<const SeenOctave> octaves, std::size_t in_sight,
                             const Combination& combination, SeenNoise& out) {
  using Kind = Combination::Kind;
  const hn::ScalableTag<float> d;
  const auto zero = hn::Zero(d);
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto width = hn::Load(d, footprint + i);
    auto sum = kind == Kind::multiplicative ? one : zero;
    auto ridge = one;  // Factor of the next ridge.
    auto hidden = zero;
    auto coherent = zero;
    const auto add_ridge = [&](const SeenOctave& in, auto height) HWY_ATTR {
      const auto signal = hn::Mul(height, ridge);
      sum = hn::MulAdd(signal, hn::Set(d, in.weight), sum);
      const auto next = hn::Mul(signal, hn::Set(d, combination.ridge_gain));
      ridge = Clamp01(d, next);
    };
    for (const SeenOctave& in : octaves.first(in_sight)) {
      const auto seen =
          Smoothstep(d, hn::NegMulAdd(width, hn::Set(d, in.fade_slope), hn::Set(d, in.fade_shift)));
      const auto value = hn::Load(d, in.values + i);
      const auto weight = hn::Set(d, in.weight);
      if constexpr (kind == Kind::multiplicative) {
        const auto bounded = hn::Min(hn::Max(hn::Mul(value, weight), hn::Neg(one)), one);
        sum = hn::Mul(sum, hn::MulAdd(seen, bounded, one));
      } else if constexpr (kind == Kind::ridged) {
        const auto crest = hn::Sub(hn::Set(d, combination.ridge_offset), hn::Abs(value));
        const auto mean = hn::Set(d, in.mean);
        add_ridge(in, hn::MulAdd(seen, hn::MulSub(crest, crest, mean), mean));
      } else {
        sum = hn::MulAdd(kind == Kind::billow ? hn::Abs(value) : value, hn::Mul(seen, weight), sum);
        sum = hn::MulAdd(hn::Sub(one, seen), hn::Set(d, in.weighted_mean), sum);
      }
      const auto rest = hn::NegMulAdd(seen, seen, one);
      hidden = hn::MulAdd(rest, hn::Set(d, in.share), hidden);
      coherent = hn::MulAdd(rest, hn::Set(d, in.coherent_share), coherent);
    }
    for (const SeenOctave& in : octaves.subspan(in_sight)) {
      if constexpr (kind == Kind::ridged) {
        add_ridge(in, hn::Set(d, in.mean));
      } else if constexpr (kind != Kind::multiplicative) {
        sum = hn::Add(sum, hn::Set(d, in.weighted_mean));
      }
      hidden = hn::Add(hidden, hn::Set(d, in.share));
      coherent = hn::Add(coherent, hn::Set(d, in.coherent_share));
    }
    hn::Store(sum, d, out.sum.data() + i);
    hn::Store(hidden, d, out.hidden.data() + i);
    hn::Store(coherent, d, out.coherent.data() + i);
  }
}

void SeeOctaves(std::size_t size, const float* footprint, std::span<const SeenOctave> octaves,
                std::size_t in_sight, const Combination& combination, SeenNoise& out) {
  using Kind = Combination::Kind;
  switch (combination.kind) {
    case Kind::additive:
      return SeeOctavesOf<Kind::additive>(size, footprint, octaves, in_sight, combination, out);
    case Kind::multiplicative:
      return SeeOctavesOf<Kind::multiplicative>(size, footprint, octaves, in_sight, combination,
                                                out);
    case Kind::billow:
      return SeeOctavesOf<Kind::billow>(size, footprint, octaves, in_sight, combination, out);
    case Kind::ridged:
      return SeeOctavesOf<Kind::ridged>(size, footprint, octaves, in_sight, combination, out);
  }
}

/// Variance of the hidden coherent part; `coherence` may be null.
template <class D>
HWY_INLINE hn::Vec<D> Coherent(D d, const SeenNoise& seen, const float* coherence, std::size_t i) {
  const auto coherent = hn::Load(d, seen.coherent.data() + i);
  return coherence != nullptr ? hn::Mul(coherent, hn::Load(d, coherence + i)) : coherent;
}

/// The sum with `step` deviations of the coherent part, and the variance that stays hidden.
void Deviate(std::size_t size, const SeenNoise& seen, const float* coherence, float step,
             float* HWY_RESTRICT sum, float* HWY_RESTRICT hidden) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto coherent = Coherent(d, seen, coherence, i);
    const auto root = hn::Sqrt(coherent);
    hn::Store(hn::MulAdd(root, hn::Set(d, step), hn::Load(d, seen.sum.data() + i)), d, sum + i);
    const auto rest = hn::Sub(hn::Load(d, seen.hidden.data() + i), coherent);
    hn::Store(hn::Max(rest, hn::Zero(d)), d, hidden + i);
  }
}

/// Sets `sum` to S exp(deviation r - r^2/2) for a product S, r^2 the coherent variance of ln S.
void DeviateFactor(std::size_t size, const SeenNoise& seen, const float* coherence, float deviation,
                   float log_variance, float* HWY_RESTRICT sum) {
  const hn::ScalableTag<float> d;
  const auto half = hn::Set(d, -0.5f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto variance = hn::Mul(Coherent(d, seen, coherence, i), hn::Set(d, log_variance));
    const auto power =
        hn::MulAdd(hn::Sqrt(variance), hn::Set(d, deviation), hn::Mul(variance, half));
    hn::Store(hn::Mul(hn::Load(d, seen.sum.data() + i), Exp(d, power)), d, sum + i);
  }
}

/// Adds the points to their displacements.
void Displace(const Points& points, BatchArray* displacement) {
  const hn::ScalableTag<float> d;
  const float* coordinates[3] = {points.x, points.y, points.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float* HWY_RESTRICT moved = displacement[axis].data();
    for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
      hn::Store(hn::Add(hn::Load(d, coordinates[axis] + i), hn::Load(d, moved + i)), d, moved + i);
    }
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SeeOctaves);
HWY_EXPORT(Deviate);
HWY_EXPORT(DeviateFactor);
HWY_EXPORT(Displace);

namespace {

// The least deviation of S over the points, relative to independent octaves. A smaller one would
// be rounding errors.
constexpr double smallest_variation = 1e-4;

// Lacunarity and gain of the warp's octaves.
constexpr double warp_lacunarity = 2.0;
constexpr double warp_gain = 0.5;

// |P| has creases, across which it changes about twice as fast as P.
constexpr double crease_sharpness = 2.0;

NoiseShape::Parameters shape_of(const FractalParameters& p) {
  if (p.is_density()) return {1, false, 0, 1, p.floor, true};
  return {p.exponent, p.inverse, p.offset, p.contrast, p.floor, false};
}

}  // namespace

FractalNoise::FractalNoise(const FractalParameters& parameters, double thickness)
    : parameters_(parameters), shape_(shape_of(parameters)) {
  make_warp();
  const std::vector<Octave> octaves = parameters.make_octaves();
  for (int k = 1; k <= parameters.octaves; ++k) {
    add_octave(octaves[static_cast<std::size_t>(k - 1)], parameters.frequency(k),
               parameters.weight(k), thickness);
  }
  assume_independence();
}

FractalNoise::FractalNoise(const FractalParameters& parameters, std::span<const Octave> octaves,
                           double thickness)
    : parameters_(parameters), shape_(shape_of(parameters)) {
  parameters_.octaves = static_cast<int>(octaves.size());
  make_warp();
  for (const Octave& octave : octaves) {
    add_octave(octave, double{octave.frequency}, double{octave.weight}, thickness);
  }
  assume_independence();
}

void FractalNoise::make_warp() {
  if (parameters_.warp == 0) return;
  double squares = 0, steepness = 0;
  for (int j = 0; j < parameters_.warp_octaves; ++j) {
    Octave octave;
    const double frequency = parameters_.warp_frequency * std::pow(warp_lacunarity, j);
    const double weight = std::pow(warp_gain, j);
    octave.frequency = static_cast<float>(frequency);
    octave.weight = static_cast<float>(weight);
    scatter(octave, [&](std::uint64_t part) {
      // Octaves of the noise itself count from 1.
      return hash_words({parameters_.seed, 0, static_cast<std::uint64_t>(j), part});
    });
    warp_octaves_.push_back(octave);
    squares += weight * weight;
    steepness += std::pow(weight * frequency * simplex_steepness, 2);
  }
  const double scale = parameters_.warp / std::sqrt(squares * simplex_variance);
  for (Octave& octave : warp_octaves_) octave.weight *= static_cast<float>(scale);
  // The gradient of the noise is multiplied by that of x + w v(x): the unit matrix and nine
  // independent elements.
  stretch_ = std::sqrt(1 + 3 * parameters_.warp * parameters_.warp * steepness / squares);
}

void FractalNoise::add_octave(const Octave& octave, double frequency, double weight,
                              double thickness) {
  if (octaves_.size() == FractalParameters::most_octaves) {
    throw std::invalid_argument("a noise has too many octaves");
  }
  octaves_.push_back(octave);
  octave_mean_.push_back(0.0);
  octave_variance_.push_back(weight * weight * parameters_.kind->variance());
  // The mean of a noise of correlation length 1/(2 f) through the layer.
  coherence_.push_back(1 / (1 + 2 * stretch_ * frequency * thickness));
  const double seen = stretch_ * double{octave.frequency};
  finest_ = std::max(finest_, seen);
  independent_variance_ += weight * weight;
}

void FractalNoise::assume_independence() {
  independent_sigma_ = std::sqrt(independent_variance_ * parameters_.kind->variance());
  sigma_ = independent_sigma_;
  if (parameters_.combination.kind == Combination::Kind::multiplicative) {
    mu_ = 1;
    for (std::size_t k = 0; k < octaves_.size(); ++k) {
      octave_mean_[k] = 1;
      octave_variance_[k] = std::log1p(octave_variance_[k]);
      log_variance_ += octave_variance_[k];
    }
    sigma_ = std::sqrt(std::expm1(log_variance_));
  }
  double weights = 0, squares = 0;
  for (const Octave& octave : octaves_) {
    const double variance = double{octave.weight} * octave.weight;
    weights += variance;
    squares += variance * octave.frequency * octave.frequency;
  }
  effective_frequency_ = stretch_ * std::sqrt(squares / weights);
  sharpness_ = measured_sharpness();
}

bool FractalNoise::is_density() const { return parameters_.is_density(); }

NoiseShape::Standard FractalNoise::standard() const {
  if (is_density()) return {1, 0};
  return {1 / sigma_, -mu_ / sigma_};
}

Points FractalNoise::displace(const Points& points, std::array<BatchArray, 3>& storage) const {
  if (warp_octaves_.empty()) return points;
  float* const arrays[] = {storage[0].data(), storage[1].data(), storage[2].data()};
  simplex_noise().sum_vector(points, warp_octaves_, arrays);
  HWY_DYNAMIC_DISPATCH(Displace)(points, storage.data());
  return {storage[0].data(), storage[1].data(), storage[2].data(), points.size};
}

void FractalNoise::combine(const Points& points, float* out) const {
  if (parameters_.combination.kind == Combination::Kind::additive) {
    parameters_.kind->sum(points, octaves_, out);
  } else {
    parameters_.kind->combine(parameters_.combination, points, octaves_, out);
  }
}

void FractalNoise::sum(const Points& points, float* out) const {
  std::array<BatchArray, 3> displaced;
  combine(displace(points, displaced), out);
}

void FractalNoise::evaluate(const Points& points, float* out) const {
  sum(points, out);
  shape_.apply(standard(), 1 / phi_mean_, points.size, out);
}

std::size_t FractalNoise::octaves_in_sight(float footprint) const {
  // The margin covers rounding of the shares in single precision.
  constexpr double end = fade_end * (1 + 1e-5);
  std::size_t count = octaves_.size();
  while (count > 0 && double{footprint} * stretch_ * double{octaves_[count - 1].frequency} >= end) {
    --count;
  }
  return count;
}

bool FractalNoise::hides(double footprint) const { return footprint * finest_ > fade_begin; }

SeenOctave FractalNoise::seen_octave(std::size_t k, const float* values) const {
  double total = 0;
  for (const double variance : octave_variance_) total += variance;
  const double share = octave_variance_[k] / total;
  SeenOctave in{};
  in.values = values;
  in.weight = octaves_[k].weight;
  in.weighted_mean = in.mean = static_cast<float>(octave_mean_[k]);
  in.share = static_cast<float>(share);
  in.coherent_share = static_cast<float>(share * coherence_[k]);
  const double frequency = stretch_ * double{octaves_[k].frequency};
  in.fade_slope = static_cast<float>(frequency / (fade_end - fade_begin));
  in.fade_shift = static_cast<float>(fade_end / (fade_end - fade_begin));
  return in;
}

void FractalNoise::see(const Points& points, std::span<const float* const> footprints,
                       std::span<SeenNoise> out, std::uint64_t& evaluations) const {
  auto [least, most] = range_of(footprints[0], points.size);
  for (const float* footprint : footprints.subspan(1)) {
    const Range range = range_of(footprint, points.size);
    least = std::min(least, range.least);
    most = std::max(most, range.most);
  }
  std::array<BatchArray, 3> storage;
  const Points displaced = displace(points, storage);
  evaluations += points.size * warp_octaves_.size();
  if (!hides(double{most})) {
    combine(displaced, out[0].sum.data());
    for (SeenNoise& other : out.subspan(1)) other.sum = out[0].sum;
    for (SeenNoise& seen : out) {
      std::fill_n(seen.hidden.data(), padded(points.size), 0.0f);
      std::fill_n(seen.coherent.data(), padded(points.size), 0.0f);
    }
    evaluations += points.size * octaves_.size();
    return;
  }
  std::array<BatchArray, FractalParameters::most_octaves> values;
  std::array<SeenOctave, FractalParameters::most_octaves> octaves;
  const std::size_t in_sight = octaves_in_sight(least);
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    octaves[k] = seen_octave(k, values[k].data());
    if (k >= in_sight) continue;
    Octave octave = octaves_[k];
    octave.weight = 1;
    parameters_.kind->sum(displaced, std::span(&octave, 1), values[k].data());
    evaluations += points.size;
  }
  for (std::size_t v = 0; v < out.size(); ++v) {
    HWY_DYNAMIC_DISPATCH(SeeOctaves)
    (points.size, footprints[v], std::span(octaves).first(octaves_.size()),
     octaves_in_sight(range_of(footprints[v], points.size).least), parameters_.combination, out[v]);
  }
}

void FractalNoise::expect(std::size_t size, const SeenNoise& seen, float* out) const {
  std::copy_n(seen.sum.data(), padded(size), out);
  shape_.apply_expected(standard(), 1 / phi_mean_, size, seen.hidden.data(), out);
}

void FractalNoise::expect(std::size_t size, const SeenNoise& seen, const float* coherence,
                          double deviation, float* out) const {
  BatchArray hidden;
  HWY_DYNAMIC_DISPATCH(Deviate)
  (size, seen, coherence, static_cast<float>(deviation * sigma_), out, hidden.data());
  if (is_density()) {
    HWY_DYNAMIC_DISPATCH(DeviateFactor)
    (size, seen, coherence, static_cast<float>(deviation), static_cast<float>(log_variance_), out);
  }
  shape_.apply_expected(standard(), 1 / phi_mean_, size, hidden.data(), out);
}

void FractalNoise::normalise(std::span<const WeightedBatch> cloud, const Factor& factor) {
  const auto sums = std::make_unique_for_overwrite<BatchArray[]>(cloud.size());
  const CloudMean raw = mean_over(cloud, [&](std::size_t b, BatchArray& out) {
    sum(cloud[b].points(), out.data());
    sums[b] = out;
  });
  mu_ = raw.mean;
  sigma_ = std::sqrt(std::max(raw.square_mean - mu_ * mu_, 0.0));
  log_variance_ = std::log1p(std::pow(sigma_ / mu_, 2));
  if (!std::isfinite(sigma_)) {
    throw InputError("the noise is infinite; change its spectral index or frequencies");
  }
  if (sigma_ < smallest_variation * independent_sigma_) {
    throw InputError("the noise hardly varies over the whole component; raise its frequencies");
  }
  const CloudMean light = mean_over(cloud, [&](std::size_t b, BatchArray& out) {
    out = sums[b];
    shape_.apply(standard(), 1, cloud[b].size, out.data());
    if (!factor) return;
    BatchArray factors;
    factor(cloud[b].points(), factors.data());
    for (std::size_t i = 0; i < cloud[b].size; ++i) out[i] *= factors[i];
  });
  // A noise that is dark everywhere (a very negative offset) has no mean to divide by.
  if (!(light.mean > 0) || !std::isfinite(light.square_mean)) {
    throw InputError(
        std::string("the noise is zero or infinite over the whole component; change its ") +
        (is_density() ? "amplitude or ridges" : "offset, contrast or exponent"));
  }
  phi_mean_ = 1;
  correct_mean(light);
  take_octaves(cloud);
  sharpness_ = measured_sharpness();
}

void FractalNoise::correct_mean(const CloudMean& mean) {
  phi_mean_ *= mean.mean;
  phi_rms_ = std::sqrt(mean.square_mean) / mean.mean;
  mean_error_ = mean.error / mean.mean;
}

void FractalNoise::take_octave(std::size_t k, std::span<const WeightedBatch> cloud,
                               std::span<const BatchArray> values) {
  using Kind = Combination::Kind;
  const Kind kind = parameters_.combination.kind;
  const double weight = double{octaves_[k].weight};
  const float height = parameters_.combination.ridge_offset;
  CloudMoments moments;
  BatchArray term;
  for (std::size_t b = 0; b < cloud.size(); ++b) {
    const BatchArray& value = values[b * octaves_.size() + k];
    if (kind == Kind::additive || kind == Kind::billow) {
      moments.add(cloud[b], value.data());
      continue;
    }
    // The factor or term of the octave.
    for (std::size_t i = 0; i < cloud[b].size; ++i) {
      const float crest = height - std::abs(value[i]);
      term[i] = kind == Kind::ridged ? crest * crest
                                     : std::clamp(1 + octaves_[k].weight * value[i], 0.0f, 2.0f);
    }
    moments.add(cloud[b], term.data());
  }
  const double variance = moments.xx() - moments.x() * moments.x();
  if (kind == Kind::multiplicative) {
    octave_variance_[k] = std::log1p(variance);
    return;
  }
  octave_mean_[k] = kind == Kind::ridged ? moments.x() : weight * moments.x();
  octave_variance_[k] = weight * weight * variance;
}

void FractalNoise::take_octaves(std::span<const WeightedBatch> cloud) {
  const std::size_t octaves = octaves_.size();
  const bool billow = parameters_.combination.kind == Combination::Kind::billow;
  std::vector<BatchArray> values(cloud.size() * octaves);
  parallel_for(cloud.size(), [&](std::size_t b) {
    std::array<BatchArray, 3> storage;
    const Points displaced = displace(cloud[b].points(), storage);
    for (std::size_t k = 0; k < octaves; ++k) {
      Octave octave = octaves_[k];
      octave.weight = 1;
      BatchArray& value = values[b * octaves + k];
      parameters_.kind->sum(displaced, std::span(&octave, 1), value.data());
      if (billow) {
        for (float& term : value.values) term = std::abs(term);
      }
    }
  });
  double means = 0;
  for (std::size_t k = 0; k < octaves; ++k) {
    take_octave(k, cloud, values);
    means += octave_mean_[k];
  }
  // The means of the octaves add up to the mean of S over all points.
  if (!is_density()) octave_mean_.front() += mu_ - means;
}

double FractalNoise::measured_sharpness() const {
  using Kind = Combination::Kind;
  // A power alpha narrows Gaussian peaks by sqrt(alpha); the inverse has ridges where |v| < floor.
  // A product is about exp(r s), r^2 the variance of its logarithm. At s = 2 it is as narrow as
  // s^(2 r).
  if (parameters_.combination.kind == Kind::ridged) return crease_sharpness;
  if (is_density()) return std::sqrt(std::max(2 * std::sqrt(log_variance_), 1.0));
  double narrowing = std::sqrt(std::max(std::abs(parameters_.exponent), 1.0));
  if (parameters_.inverse) narrowing = std::max(narrowing, 1 / std::sqrt(parameters_.floor));
  return parameters_.combination.kind == Kind::billow ? crease_sharpness * narrowing : narrowing;
}

}  // namespace gamer
#endif
