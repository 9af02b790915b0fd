#include "gamer/galaxy/galaxy.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/galaxy_evaluation.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/math-inl.h"
#include "galaxy/associations/association_texture.h"
#include "galaxy/kinds/taper-inl.h"
#include "gamer/core/clock.h"

#ifndef GAMER_GALAXY_GALAXY_EVALUATION_KERNEL
#define GAMER_GALAXY_GALAXY_EVALUATION_KERNEL
namespace gamer {
namespace {

/// The capacity has room for numbers that a vector store writes beyond the last point.
constexpr std::size_t compacted_capacity = batch_capacity + batch_padding;

/// The points of a batch that need a texture's noise, turned back by its twirl.
struct alignas(batch_alignment) CompactedPoints {
  float x[compacted_capacity];
  float y[compacted_capacity];
  float z[compacted_capacity];
  float winding[compacted_capacity];
  float fade[compacted_capacity];
  float footprint[compacted_capacity];  ///< in the texture's coordinates; only if needed
  float coherence[compacted_capacity];  ///< only if needed
  std::int32_t index[compacted_capacity];
  std::size_t size = 0;
};

// Phi fades in between the threshold and this factor times the threshold.
constexpr float fade_factor = 4;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

void FillBatch(const Points& points, bool needs_azimuth, SampleBatch& batch) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, points.x + i);
    const auto y = hn::Load(d, points.y + i);
    const auto z = hn::Load(d, points.z + i);
    const auto r2 = hn::MulAdd(x, x, hn::Mul(y, y));
    const auto radius = hn::Sqrt(hn::MulAdd(z, z, r2));
    hn::Store(x, d, batch.x.data() + i);
    hn::Store(y, d, batch.y.data() + i);
    hn::Store(z, d, batch.z.data() + i);
    hn::Store(hn::Sqrt(r2), d, batch.r.data() + i);
    if (needs_azimuth) hn::Store(Atan2(d, y, x), d, batch.azimuth.data() + i);
    hn::Store(Taper(d, radius), d, batch.taper.data() + i);
  }
}

void Radius(const Points& points, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, points.x + i);
    const auto y = hn::Load(d, points.y + i);
    hn::Store(hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y))), d, out + i);
  }
}

/// Turns (x, y) about the axis by -twirl theta; `to_x` and `to_y` may be x and y.
void TurnBack(std::size_t size, const float* x, const float* y, const float* winding, float twirl,
              float* to_x, float* to_y) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto sine = hn::Zero(d);
    auto cosine = hn::Zero(d);
    SinCos(d, hn::Mul(hn::Load(d, winding + i), hn::Set(d, -twirl)), sine, cosine);
    const auto from_x = hn::Load(d, x + i);
    const auto from_y = hn::Load(d, y + i);
    hn::Store(hn::NegMulAdd(sine, from_y, hn::Mul(cosine, from_x)), d, to_x + i);
    hn::Store(hn::MulAdd(sine, from_x, hn::Mul(cosine, from_y)), d, to_y + i);
  }
}

/// Keeps the points where `need` exceeds the threshold, turned back by the twirl. `heights` replace
/// z. `footprints` and `coherence` may be null.
void Compact(const SampleBatch& batch, const float* heights, const float* HWY_RESTRICT need,
             float threshold, float twirl, bool has_winding, const float* footprints,
             float footprint_scale, const float* coherence, CompactedPoints& out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto limit = hn::Set(d, threshold);
  const auto fade_scale = hn::Set(d, 1 / (threshold * (fade_factor - 1)));
  std::size_t size = 0;
  // Compress() uses a table without AVX-512, which GCC copies to the stack in each call. It is
  // called once a vector, therefore, and its order serves all arrays. A store also writes numbers
  // beyond the kept ones; later stores overwrite them.
  const auto keep = [&](auto values, auto order, float* to)
                        HWY_ATTR { hn::StoreU(hn::TableLookupLanes(values, order), d, to + size); };
  for (std::size_t i = 0; i < batch.size; i += lanes) {
    const auto value = hn::Load(d, need + i);
    const auto index = hn::Iota(di, static_cast<std::int32_t>(i));
    const auto inside = hn::Lt(index, hn::Set(di, static_cast<std::int32_t>(batch.size)));
    const auto mask = hn::And(hn::Gt(value, limit), hn::RebindMask(d, inside));
    if (hn::AllFalse(d, mask)) continue;
    const auto lanes_kept = hn::Compress(hn::Iota(di, 0), hn::RebindMask(di, mask));
    const auto order = hn::IndicesFromVec(d, lanes_kept);
    const auto fade = hn::Min(hn::Mul(hn::Sub(value, limit), fade_scale), hn::Set(d, 1.0f));
    keep(hn::Load(d, batch.x.data() + i), order, out.x);
    keep(hn::Load(d, batch.y.data() + i), order, out.y);
    keep(hn::Load(d, heights + i), order, out.z);
    if (has_winding) keep(hn::Load(d, batch.winding.data() + i), order, out.winding);
    keep(fade, order, out.fade);
    if (footprints != nullptr) {
      auto footprint = hn::Mul(hn::Load(d, footprints + i), hn::Set(d, footprint_scale));
      if (has_winding && twirl != 0) {
        const auto half = hn::Mul(hn::Abs(hn::Load(d, batch.shear.data() + i)),
                                  hn::Set(d, 0.5f * (twirl < 0 ? -twirl : twirl)));
        const auto root = hn::Sqrt(hn::MulAdd(half, half, hn::Set(d, 1.0f)));
        footprint = hn::Mul(footprint, hn::Add(half, root));
      }
      keep(footprint, order, out.footprint);
    }
    if (coherence != nullptr) keep(hn::Load(d, coherence + i), order, out.coherence);
    const auto first = hn::Set(di, static_cast<std::int32_t>(i));
    hn::StoreU(hn::Add(lanes_kept, first), di, out.index + size);
    size += hn::CountTrue(d, mask);
  }
  out.size = size;
  // The padding must hold harmless numbers, since kernels process whole vectors.
  for (std::size_t i = size; i < padded(size); ++i) {
    out.x[i] = out.y[i] = out.z[i] = out.winding[i] = out.footprint[i] = 0;
  }
  if (has_winding && twirl != 0) TurnBack(size, out.x, out.y, out.winding, twirl, out.x, out.y);
}

// out = amplitude envelope Phi; `out` may be one of the other arrays.
void Scale(std::size_t size, float amplitude, const float* envelope, const float* phi,
           const float* followed_phi, float* out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto value = hn::Mul(hn::Load(d, envelope + i), hn::Set(d, amplitude));
    if (phi != nullptr) value = hn::Mul(value, hn::Load(d, phi + i));
    if (followed_phi != nullptr) value = hn::Mul(value, hn::Load(d, followed_phi + i));
    hn::Store(value, d, out + i);
  }
}

void Logarithm(std::size_t size, const float* HWY_RESTRICT values, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const auto least = hn::Set(d, smallest_footprint);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::Store(Log(d, hn::Max(hn::Load(d, values + i), least)), d, out + i);
  }
}

void Divide(std::size_t size, const float* HWY_RESTRICT divisor, float* HWY_RESTRICT values) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::Store(hn::Div(hn::Load(d, values + i), hn::Load(d, divisor + i)), d, values + i);
  }
}

void Largest(std::size_t size, const float* HWY_RESTRICT a, float* HWY_RESTRICT b) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::Store(hn::Max(hn::Load(d, a + i), hn::Load(d, b + i)), d, b + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(FillBatch);
HWY_EXPORT(Radius);
HWY_EXPORT(TurnBack);
HWY_EXPORT(Compact);
HWY_EXPORT(Scale);
HWY_EXPORT(Logarithm);
HWY_EXPORT(Divide);
HWY_EXPORT(Largest);

namespace {

/// Arrays that a thread keeps from call to call, since allocating aligned memory takes a lock.
class KeptArrays {
 public:
  /// The first `count` arrays, with unspecified values. The arrays of an earlier call are invalid.
  std::span<BatchArray> take(std::size_t count) {
    if (count > size_) {
      arrays_ = std::make_unique_for_overwrite<BatchArray[]>(count);
      size_ = count;
    }
    return {arrays_.get(), count};
  }

 private:
  std::unique_ptr<BatchArray[]> arrays_;
  std::size_t size_ = 0;
};

struct EvaluationArrays {
  KeptArrays means, early, variants;
};
thread_local EvaluationArrays kept;

bool is_constant(const float* values, std::size_t size) {
  if (size == 0) return true;
  const Range range = range_of(values, size);
  return range.least == range.most;
}

/// Finds the points at which a component's texture is needed.
void compact(const Component& component, const SampleBatch& batch, const BatchArray& need,
             float threshold, bool needs_winding, const BatchArray* footprints,
             const BatchArray* coherence, CompactedPoints& points) {
  const float* heights = batch.z.data();
  BatchArray above;
  if (component.is_warped()) {
    component.lift(batch, above.data());
    for (std::size_t i = 0; i < padded(batch.size); ++i) above[i] = batch.z[i] - above[i];
    heights = above.data();
  }
  HWY_DYNAMIC_DISPATCH(Compact)
  (batch, heights, need.data(), threshold, static_cast<float>(component.texture()->twirl()),
   needs_winding, footprints != nullptr ? footprints->data() : nullptr,
   static_cast<float>(component.footprint_scale()),
   coherence != nullptr ? coherence->data() : nullptr, points);
}

/// Turns the values at compacted points into Phi divided by its mean, for all points of a batch.
/// Points that were left out get 1.
void scatter(const CompactedPoints& points, std::size_t size, const BatchArray& mean,
             BatchArray& values) {
  BatchArray compacted;
  std::copy_n(values.data(), points.size, compacted.data());
  if (points.size < size) std::fill_n(values.data(), padded(size), 1.0f);
  for (std::size_t i = 0; i < points.size; ++i) {
    const auto at = static_cast<std::size_t>(points.index[i]);
    values[at] = 1 + points.fade[i] * (compacted[i] / mean[at] - 1);
  }
}

}  // namespace

void Galaxy::fill_batch(const Points& points, bool wants_shear, SampleBatch& batch) const {
  batch.size = points.size;
  HWY_DYNAMIC_DISPATCH(FillBatch)(points, needs_azimuth_, batch);
  if (!needs_winding_) return;
  arms_.winding(batch.r.data(), batch.size, batch.winding.data());
  if (wants_shear) arms_.shear(batch.r.data(), batch.size, batch.shear.data());
}

Points Galaxy::turn_back(const Points& points, double twirl, BatchArray& x, BatchArray& y,
                         BatchArray& z) const {
  BatchArray r, winding;
  HWY_DYNAMIC_DISPATCH(Radius)(points, r.data());
  arms_.winding(r.data(), points.size, winding.data());
  HWY_DYNAMIC_DISPATCH(TurnBack)
  (points.size, points.x, points.y, winding.data(), static_cast<float>(twirl), x.data(), y.data());
  std::copy_n(points.z, padded(points.size), z.data());
  return {x.data(), y.data(), z.data(), points.size};
}

void Galaxy::add_lift(std::size_t c, const Points& points, float sign, float* z) const {
  if (!components_[c]->is_warped()) return;
  SampleBatch batch;
  BatchArray lift;
  batch.size = points.size;
  HWY_DYNAMIC_DISPATCH(FillBatch)(points, true, batch);
  components_[c]->lift(batch, lift.data());
  for (std::size_t i = 0; i < padded(points.size); ++i) z[i] += sign * lift[i];
}

void Galaxy::look_up(const DustClosure::ByObliquity& tables, std::size_t size,
                     const BatchArray& log_footprints, const BatchArray& obliquity,
                     BatchArray& out) {
  std::array<float, DustClosure::obliquities.size()> logs;
  for (std::size_t o = 0; o < logs.size(); ++o) {
    logs[o] = static_cast<float>(std::log(DustClosure::obliquities[o]));
  }
  // Rays of a batch mostly lie between the same two DustClosure::obliquities.
  const auto [least, most] = range_of(obliquity.data(), size);
  std::size_t o = 0;
  while (o + 2 < logs.size() && logs[o + 1] <= least) ++o;
  std::array<BatchArray, 2> nodes;
  float *low = nodes[0].data(), *high = nodes[1].data();
  tables[o].at(size, log_footprints.data(), low);
  std::copy_n(low, padded(size), out.data());
  for (; o + 1 < logs.size() && logs[o] <= most; ++o) {
    tables[o + 1].at(size, log_footprints.data(), high);
    const float per_width = 1 / (logs[o + 1] - logs[o]);
    for (std::size_t i = 0; i < padded(size); ++i) {
      const float share = std::clamp((obliquity[i] - logs[o]) * per_width, 0.0f, 1.0f);
      if (obliquity[i] >= logs[o]) out[i] = low[i] + share * (high[i] - low[i]);
    }
    std::swap(low, high);
  }
}

void Galaxy::phi(std::size_t c, const SampleBatch& batch, const BatchArray& need, float threshold,
                 const BatchArray& mean, const BatchArray* footprints, const BatchArray* coherence,
                 std::span<const double> deviations, std::span<BatchArray> out,
                 EvaluationCounts& counts) const {
  CompactedPoints points;
  compact(*components_[c], batch, need, threshold, needs_winding_, footprints, coherence, points);
  const Clock clock;
  if (points.size > 0) {
    components_[c]->texture()->evaluate({points.x, points.y, points.z, points.size},
                                        footprints != nullptr ? points.footprint : nullptr,
                                        coherence != nullptr ? points.coherence : nullptr,
                                        deviations, out, counts.noise_evaluations);
  }
  for (BatchArray& values : out) scatter(points, batch.size, mean, values);
  counts.noise_seconds += clock.seconds();
}

void Galaxy::look_up_means(std::size_t size, const BatchArray* log_footprints, bool divides_light,
                           std::span<BatchArray> out) const {
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (!divides_light && !components_[c]->absorbs()) {
      std::fill_n(out[c].data(), padded(size), 1.0f);
    } else if (log_footprints != nullptr) {
      calibration_.means[c].at(size, log_footprints->data(), out[c].data());
    } else {
      std::fill_n(out[c].data(), padded(size), calibration_.means[c].narrowest());
    }
  }
  // The table of a follower holds the mean of its own Phi times the followed Phi.
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (followed_[c] < 0) continue;
    const BatchArray& followed = out[static_cast<std::size_t>(followed_[c])];
    HWY_DYNAMIC_DISPATCH(Divide)(size, followed.data(), out[c].data());
  }
}

/// One call of evaluate(): a batch with its envelopes, and the values of tables and followed
/// components at its points.
class Galaxy::Evaluation {
 public:
  Evaluation(const Galaxy& galaxy, const Points& points, float threshold, const RayBatch* rays,
             std::span<BatchArray> densities, EvaluationCounts& counts);
  /// Evaluates the noise of followed components wherever they or a follower matter. Also evaluates
  /// the noise of associations together with the noise of stars in their clumps.
  void begin();
  /// Turns the envelopes into densities.
  void finish(std::span<const double> deviations);

 private:
  /// Copies the first value to all points if all rays have one footprint and obliquity, as most
  /// rays of one galaxy do. Tables are then looked up once.
  void spread(BatchArray& values) const {
    if (is_even_) std::fill_n(values.data(), padded(batch_.size), values[0]);
  }
  /// Evaluates the noise of associations together with that of stars in their clumps.
  void evaluate_clumps(std::size_t c, std::size_t stars);
  /// The noise that begin() has evaluated; null for other components.
  BatchArray* early_phi(std::size_t c) const {
    const int place = galaxy_.early_[c];
    return place >= 0 ? &early_phi_[static_cast<std::size_t>(place)] : nullptr;
  }
  /// Evaluates the noise of a component that begin() leaves out, for each of its variants.
  void evaluate_noise(std::size_t c, std::span<const double> deviations,
                      std::span<BatchArray> variants);

  const Galaxy& galaxy_;
  const std::size_t count_;  ///< number of components
  const float threshold_;
  const RayBatch* const rays_;
  const BatchArray* const footprints_;
  const std::span<BatchArray> densities_;
  EvaluationCounts& counts_;
  SampleBatch batch_;
  bool is_even_;
  std::size_t places_;  ///< number of places at which tables are looked up
  BatchArray log_footprints_;
  std::span<BatchArray> means_, early_phi_;
};

Galaxy::Evaluation::Evaluation(const Galaxy& galaxy, const Points& points, float threshold,
                               const RayBatch* rays, std::span<BatchArray> densities,
                               EvaluationCounts& counts)
    : galaxy_(galaxy),
      count_(galaxy.components_.size()),
      threshold_(threshold * galaxy.skin_scale_),
      rays_(rays),
      footprints_(rays != nullptr ? &rays->footprint : nullptr),
      densities_(densities),
      counts_(counts) {
  galaxy.fill_batch(points, footprints_ != nullptr, batch_);
  for (std::size_t c = 0; c < count_; ++c) {
    if (galaxy.clump_leader_[c] >= 0) continue;
    galaxy.components_[c]->envelope(batch_, densities[c].data());
  }
  for (std::size_t c = 0; c < count_; ++c) {
    if (galaxy.clump_leader_[c] < 0) continue;
    const auto leader = static_cast<std::size_t>(galaxy.clump_leader_[c]);
    std::copy_n(densities[leader].data(), padded(batch_.size), densities[c].data());
  }
  is_even_ = rays == nullptr || (is_constant(rays->footprint.data(), batch_.size) &&
                                 is_constant(rays->obliquity.data(), batch_.size));
  places_ = is_even_ ? 1 : batch_.size;
  if (footprints_ != nullptr) {
    HWY_DYNAMIC_DISPATCH(Logarithm)(places_, footprints_->data(), log_footprints_.data());
    spread(log_footprints_);
  }
  means_ = kept.means.take(count_);
  galaxy.look_up_means(places_, footprints_ != nullptr ? &log_footprints_ : nullptr,
                       rays == nullptr || rays->divides_light, means_);
  for (std::size_t c = 0; c < count_; ++c) spread(means_[c]);
}

void Galaxy::Evaluation::begin() {
  early_phi_ = kept.early.take(galaxy_.early_count_);
  BatchArray need;
  for (std::size_t c = 0; c < count_; ++c) {
    if (galaxy_.early_[c] < 0 || galaxy_.clump_leader_[c] >= 0) continue;
    if (galaxy_.clump_stars_[c] >= 0) {
      evaluate_clumps(c, static_cast<std::size_t>(galaxy_.clump_stars_[c]));
      continue;
    }
    std::memcpy(need.data(), densities_[c].data(), padded(batch_.size) * sizeof(float));
    // The smallest limit of all components that need the noise counts.
    double scale = galaxy_.components_[c]->threshold_scale();
    for (std::size_t f = 0; f < count_; ++f) {
      if (galaxy_.followed_[f] != static_cast<int>(c)) continue;
      HWY_DYNAMIC_DISPATCH(Largest)(batch_.size, densities_[f].data(), need.data());
      scale = std::min(scale, galaxy_.components_[f]->threshold_scale());
    }
    galaxy_.phi(c, batch_, need, threshold_ * static_cast<float>(scale), means_[c], footprints_,
                nullptr, {}, std::span(early_phi(c), 1), counts_);
  }
}

void Galaxy::Evaluation::evaluate_clumps(std::size_t c, std::size_t stars) {
  const Component &leader = *galaxy_.components_[c], &follower = *galaxy_.components_[stars];
  const double scale = std::min(leader.threshold_scale(), follower.threshold_scale());
  CompactedPoints points;
  compact(leader, batch_, densities_[c], threshold_ * static_cast<float>(scale),
          galaxy_.needs_winding_, footprints_, nullptr, points);
  const Clock clock;
  BatchArray &whole = *early_phi(c), &of_stars = *early_phi(stars);
  if (points.size > 0) {
    const auto& clumps = static_cast<const AssociationTexture&>(*follower.texture());
    static_cast<const AssociationTexture&>(*leader.texture())
        .evaluate_with(clumps, {points.x, points.y, points.z, points.size},
                       footprints_ != nullptr ? points.footprint : nullptr, whole, of_stars,
                       counts_.noise_evaluations);
  }
  scatter(points, batch_.size, means_[c], whole);
  scatter(points, batch_.size, means_[stars], of_stars);
  counts_.noise_seconds += clock.seconds();
}

void Galaxy::Evaluation::evaluate_noise(std::size_t c, std::span<const double> deviations,
                                        std::span<BatchArray> variants) {
  const bool varies = variants.size() > 1 && footprints_ != nullptr;
  BatchArray coherence, amount;
  if (varies) {
    const auto& dust = (*galaxy_.calibration_.dust)[c];
    look_up(dust.coherence, places_, log_footprints_, rays_->obliquity, coherence);
    look_up(dust.amount, places_, log_footprints_, rays_->obliquity, amount);
    spread(coherence);
    spread(amount);
    // The result of rays without variants must not depend on other rays.
    const float narrowest = galaxy_.calibration_.log_narrowest[c];
    for (std::size_t i = 0; i < padded(batch_.size); ++i) {
      if (log_footprints_[i] > narrowest) means_[c][i] *= amount[i];
    }
  }
  const double scale = galaxy_.components_[c]->threshold_scale();
  galaxy_.phi(c, batch_, densities_[c], threshold_ * static_cast<float>(scale), means_[c],
              footprints_, varies ? &coherence : nullptr, deviations, variants, counts_);
}

void Galaxy::Evaluation::finish(std::span<const double> deviations) {
  const std::size_t most_variants = std::max<std::size_t>(deviations.size(), 1);
  const std::span<BatchArray> own = kept.variants.take(most_variants);
  for (std::size_t c = 0; c < count_; ++c) {
    const Component& component = *galaxy_.components_[c];
    const std::size_t variants = component.absorbs() ? most_variants : 1;
    const BatchArray* known = early_phi(c);
    const bool is_textured = component.texture() != nullptr;
    if (is_textured && known == nullptr) {
      evaluate_noise(c, deviations, own.first(variants));
    }
    const int leader = galaxy_.followed_[c];
    const BatchArray* followed =
        leader >= 0 ? early_phi(static_cast<std::size_t>(leader)) : nullptr;
    // The first variant comes last, since it takes the envelope's place.
    for (std::size_t k = variants; k-- > 0;) {
      const BatchArray* phi = !is_textured ? nullptr : known != nullptr ? known : &own[k];
      HWY_DYNAMIC_DISPATCH(Scale)
      (batch_.size, static_cast<float>(component.amplitude()), densities_[c].data(),
       phi != nullptr ? phi->data() : nullptr, followed != nullptr ? followed->data() : nullptr,
       densities_[k * count_ + c].data());
      // A follower without a texture still has a mean.
      if (is_textured || followed == nullptr) continue;
      HWY_DYNAMIC_DISPATCH(Divide)
      (batch_.size, means_[c].data(), densities_[k * count_ + c].data());
    }
  }
}

void Galaxy::evaluate(const Points& points, float threshold, const RayBatch* rays,
                      std::span<const double> deviations, std::span<BatchArray> densities,
                      EvaluationCounts& counts) const {
  const Clock clock;
  const double earlier_noise = counts.noise_seconds;
  Evaluation evaluation(*this, points, threshold, rays, densities, counts);
  evaluation.begin();
  evaluation.finish(deviations);
  counts.envelope_seconds += clock.seconds() - (counts.noise_seconds - earlier_noise);
}

void Galaxy::evaluate_component(std::size_t c, const Points& points, float threshold,
                                BatchArray& density, EvaluationCounts& counts,
                                bool divides_light) const {
  const Component& component = *components_[c];
  SampleBatch batch;
  fill_batch(points, false, batch);
  BatchArray envelope, followed;
  component.envelope(batch, envelope.data());
  const std::span<BatchArray> means = kept.means.take(components_.size());
  look_up_means(batch.size, nullptr, divides_light, means);
  const auto limit = threshold * static_cast<float>(component.threshold_scale());
  const bool follows = followed_[c] >= 0, is_textured = component.texture() != nullptr;
  const auto take_phi = [&](std::size_t of, BatchArray& out) {
    phi(of, batch, envelope, limit, means[of], nullptr, nullptr, {}, std::span(&out, 1), counts);
  };
  if (is_textured) take_phi(c, density);
  if (follows) take_phi(static_cast<std::size_t>(followed_[c]), followed);
  const float scale = follows && !is_textured ? 1 / means[c][0] : 1.0f;
  HWY_DYNAMIC_DISPATCH(Scale)
  (batch.size, scale, envelope.data(), is_textured ? density.data() : nullptr,
   follows ? followed.data() : nullptr, density.data());
}

}  // namespace gamer
#endif
