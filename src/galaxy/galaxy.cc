#include "gamer/galaxy/galaxy.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/galaxy.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/taper-inl.h"
#include "gamer/core/clock.h"
#include "gamer/core/near.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/accuracy.h"
#include "gamer/galaxy/dust_variants.h"
#include "gamer/galaxy/star_field.h"

#ifndef GAMER_GALAXY_GALAXY_KERNEL
#define GAMER_GALAXY_GALAXY_KERNEL
namespace gamer {
namespace {

/// Room for what a vector store writes beyond the last point.
constexpr std::size_t compacted_capacity = batch_capacity + batch_padding;

/// The points of a batch that need a texture's noise, turned back by its twirl.
struct alignas(batch_alignment) CompactedPoints {
  float x[compacted_capacity];
  float y[compacted_capacity];
  float z[compacted_capacity];
  float winding[compacted_capacity];
  float fade[compacted_capacity];
  float footprint[compacted_capacity];  ///< in the texture's coordinates; only where wanted
  float coherence[compacted_capacity];  ///< only where wanted
  std::int32_t index[compacted_capacity];
  std::size_t size = 0;
};

// Phi fades in between the threshold and this many times it.
constexpr float fade_factor = 4;

// Narrower rays see all of every texture.
constexpr float smallest_footprint = 1e-10f;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

void Share(const Points& points, bool needs_phi, SampleBatch& batch) {
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
    if (needs_phi) hn::Store(Atan2(d, y, x), d, batch.phi.data() + i);
    hn::Store(Taper(d, radius), d, batch.taper.data() + i);
  }
}

/// `footprints` and `coherence` may be null.
void Compact(const SampleBatch& batch, const float* HWY_RESTRICT need, float threshold, float twirl,
             bool has_winding, const float* footprints, float footprint_scale,
             const float* coherence, CompactedPoints& out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto limit = hn::Set(d, threshold);
  const auto fade_scale = hn::Set(d, 1 / (threshold * (fade_factor - 1)));
  std::size_t size = 0;
  // Through a register: to compress into memory is slow. What is stored beyond is overwritten.
  const auto keep = [&](auto values, auto mask, float* to)
                        HWY_ATTR { hn::StoreU(hn::Compress(values, mask), d, to + size); };
  for (std::size_t i = 0; i < batch.size; i += lanes) {
    const auto value = hn::Load(d, need + i);
    const auto index = hn::Iota(di, static_cast<std::int32_t>(i));
    const auto inside = hn::Lt(index, hn::Set(di, static_cast<std::int32_t>(batch.size)));
    const auto mask = hn::And(hn::Gt(value, limit), hn::RebindMask(d, inside));
    if (hn::AllFalse(d, mask)) continue;
    const auto fade = hn::Min(hn::Mul(hn::Sub(value, limit), fade_scale), hn::Set(d, 1.0f));
    keep(hn::Load(d, batch.x.data() + i), mask, out.x);
    keep(hn::Load(d, batch.y.data() + i), mask, out.y);
    keep(hn::Load(d, batch.z.data() + i), mask, out.z);
    if (has_winding) keep(hn::Load(d, batch.winding.data() + i), mask, out.winding);
    keep(fade, mask, out.fade);
    if (footprints != nullptr) {
      auto footprint = hn::Mul(hn::Load(d, footprints + i), hn::Set(d, footprint_scale));
      if (has_winding && twirl != 0) {
        const auto half = hn::Mul(hn::Abs(hn::Load(d, batch.shear.data() + i)),
                                  hn::Set(d, 0.5f * (twirl < 0 ? -twirl : twirl)));
        const auto root = hn::Sqrt(hn::MulAdd(half, half, hn::Set(d, 1.0f)));
        footprint = hn::Mul(footprint, hn::Add(half, root));
      }
      keep(footprint, mask, out.footprint);
    }
    if (coherence != nullptr) keep(hn::Load(d, coherence + i), mask, out.coherence);
    hn::StoreU(hn::Compress(index, hn::RebindMask(di, mask)), di, out.index + size);
    size += hn::CountTrue(d, mask);
  }
  out.size = size;
  // Whole vectors are worked on: the padding must hold harmless numbers.
  for (std::size_t i = size; i < padded(size); ++i) {
    out.x[i] = out.y[i] = out.z[i] = out.winding[i] = out.footprint[i] = 0;
  }
  if (!has_winding || twirl == 0) return;
  for (std::size_t i = 0; i < size; i += lanes) {
    auto sine = hn::Zero(d);
    auto cosine = hn::Zero(d);
    SinCos(d, hn::Mul(hn::Load(d, out.winding + i), hn::Set(d, -twirl)), sine, cosine);
    const auto x = hn::Load(d, out.x + i);
    const auto y = hn::Load(d, out.y + i);
    hn::Store(hn::NegMulAdd(sine, y, hn::Mul(cosine, x)), d, out.x + i);
    hn::Store(hn::MulAdd(sine, x, hn::Mul(cosine, y)), d, out.y + i);
  }
}

// `out` may be one of the others.
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

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(Share);
HWY_EXPORT(Compact);
HWY_EXPORT(Scale);
HWY_EXPORT(Logarithm);
HWY_EXPORT(Divide);
HWY_EXPORT(Largest);

namespace {

constexpr std::size_t most_components = 64;

// The ball is not flattened further: single precision would not resolve it.
constexpr double smallest_stretch = 1e-9;

// Points over which the mean of a texture is taken at first, and then as many as independent points
// would need for this error, up to the settings' limit; the cloud's are up to four times better. A
// component with a share f of the light is allowed f^(-1/2) times as much: together the errors are
// this share of the galaxy's light.
constexpr std::size_t first_cloud = std::size_t{1} << 15;
constexpr double cloud_error = 0.004;
// The same for what wide rays see of it relative to the whole.
constexpr std::size_t first_seen_cloud = std::size_t{1} << 13;
constexpr std::size_t largest_seen_cloud = std::size_t{1} << 19;
constexpr double seen_error = 0.0025;
// They are of footprints up to the widest, each so many times the one before.
constexpr double widest_footprint = 0.5;
constexpr double footprint_ratio = 2;
// What dust lets through is measured along so many rays, of so many points where they are face on,
// at footprints of that ratio up to the largest.
constexpr std::size_t coherence_rays = std::size_t{1} << 10;
constexpr double coherence_heights = 10;
constexpr double coherence_ratio = std::numbers::sqrt3;
constexpr double largest_coherence_footprint = 1.0 / 9;
constexpr double least_coherence = 0.05;
constexpr double largest_coherence = 4;
constexpr double first_factor = 1.3;
constexpr int secants = 2;

// Places at which the largest Phi of a star field is looked for, and by what it may exceed the
// largest found: the light of what is beyond is below 1e-4 of the field's (tests).
constexpr std::size_t peak_places = std::size_t{1} << 14;
constexpr double peak_margin = 1.25;
// Within so many scale lengths and heights.
constexpr double bright_lengths = 4;
constexpr double bright_heights = 2;

}  // namespace

ParameterTable Galaxy::table() {
  return {
      {"name", ParameterType::text, "", Interval::any(), std::string(), "for people"},
      {"description", ParameterType::text, "", Interval::any(), std::string(), "for people"},
      {"axis", ParameterType::vector3, "", Interval::left_open(0, 10), std::vector<double>{1, 1, 1},
       "stretch of the whole galaxy along x, y, z"},
  };
}

std::shared_ptr<const Galaxy> Galaxy::parse(std::string_view text, const std::string& label,
                                            const GalaxySettings& settings, Resources& resources) {
  const ConfigNode root = parse_toml(text, label);
  static const std::vector<std::string> sections = {"galaxy", "arms", "component"};
  for (const auto& [key, node] : root.table()) {
    if (std::find(sections.begin(), sections.end(), key) == sections.end()) {
      throw InputError(node.key_where,
                       "unknown section '" + key + "' in a galaxy" + did_you_mean(key, sections));
    }
  }
  const auto section = [&](const char* key) -> const ConfigNode* {
    const ConfigNode* node = root.find(key);
    if (node != nullptr && !node->is_table()) {
      throw InputError(node->where,
                       std::string("[") + key + "] must be a table, not " + node->type_name());
    }
    return node;
  };
  auto galaxy = std::make_shared<Galaxy>();
  if (const ConfigNode* node = section("galaxy")) {
    const ParameterSet values = ParameterSet::read(table(), *node, "", "in [galaxy]");
    galaxy->name_ = values.text("name");
    galaxy->description_ = values.text("description");
    galaxy->axis_ = values.numbers("axis");
    for (const double stretch : galaxy->axis_) {
      if (stretch < smallest_stretch) {
        throw InputError(values.where("axis"), "axis is too small; at least 1e-9 is resolved");
      }
    }
  }
  if (const ConfigNode* node = section("arms")) galaxy->arms_ = ArmPattern::read(*node);
  const ConfigNode* list = root.find("component");
  if (list == nullptr) {
    throw InputError({label, 0, 0}, "a galaxy needs at least one [[component]]");
  }
  if (!list->is_array()) {
    throw InputError(list->key_where, "write [[component]], with double brackets");
  }
  if (list->array().size() > most_components) {
    throw InputError(list->key_where,
                     "at most " + std::to_string(most_components) + " components fit a galaxy");
  }
  int index = 0;
  for (const ConfigNode& node : list->array()) {
    auto component =
        read_component(node, ++index, galaxy->arms_, galaxy->axis_[2], settings, resources);
    for (const auto& other : galaxy->components_) {
      if (other->name() == component->name()) {
        throw InputError(component->where(),
                         "two components are called '" + other->name() + "'; names must be unique");
      }
    }
    galaxy->components_.push_back(std::move(component));
  }
  galaxy->resolve(label, settings.most_cloud_points);
  return galaxy;
}

void Galaxy::resolve(const std::string& label, std::size_t most_cloud_points) {
  std::vector<std::string> names;
  for (const auto& c : components_) {
    if (c->texture() != nullptr) names.push_back(c->name());
  }
  const auto position = [&](const std::string& name) {
    for (std::size_t c = 0; c < components_.size(); ++c) {
      if (components_[c]->name() == name) return static_cast<int>(c);
    }
    return -1;
  };
  for (const auto& c : components_) {
    if (c->follows().empty()) continue;
    const int followed = position(c->follows());
    const std::string context = "component '" + c->name() + "': follows '" + c->follows() + "', ";
    if (followed < 0) {
      throw InputError(c->follows_where(),
                       context + "which is no component" + did_you_mean(c->follows(), names));
    }
    if (components_[followed].get() == c.get() || components_[followed]->kind() != "disk" ||
        components_[followed]->texture() == nullptr) {
      throw InputError(c->follows_where(), context + "which is no disk with noise");
    }
    if (!components_[followed]->active()) {
      throw InputError(c->follows_where(), context + "which is not active");
    }
  }
  std::erase_if(components_, [](const auto& c) { return !c->active(); });
  if (components_.empty()) {
    throw InputError({label, 0, 0}, "no component of the galaxy is active");
  }
  followed_.assign(components_.size(), -1);
  follow_scale_.assign(components_.size(), 1.0);
  seen_means_.assign(components_.size(), {});
  dust_.assign(components_.size(), {});
  for (const auto& component : components_) {
    integrals_.push_back(component->envelope_integral() * axis_[0] * axis_[1] * axis_[2]);
  }
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (!components_[c]->follows().empty()) {
      followed_[c] = position(components_[c]->follows());
      const auto followed = static_cast<std::size_t>(followed_[c]);
      if (std::find(followed_components_.begin(), followed_components_.end(), followed) ==
          followed_components_.end()) {
        followed_components_.push_back(followed);
      }
    }
    needs_phi_ = needs_phi_ || components_[c]->needs_phi();
    needs_winding_ = needs_winding_ || components_[c]->needs_winding();
  }
  resolve_fractions();
  normalise_textures(most_cloud_points);
  measure_star_fields();
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const Component& component = *components_[c];
    if (!std::isfinite(static_cast<float>(component.amplitude() * follow_scale_[c]))) {
      throw InputError(component.where(), "component '" + component.name() +
                                              "': its density exceeds single precision");
    }
  }
}

namespace {

/// Measures over a cloud of `first` points, then of as many as a standard error needs.
void refine(std::size_t first, std::size_t most, double error,
            const std::function<double(std::size_t size)>& measure) {
  const double excess = measure(first) / error;
  if (!(excess > 1)) return;
  const double needed = static_cast<double>(first) * excess * excess;
  measure(static_cast<std::size_t>(std::min(needed, static_cast<double>(most))));
}

/// A mean of few points may be of none that count.
double proper_mean(double mean) { return mean > 0 && std::isfinite(mean) ? mean : 1; }

/// The footprints of rays of a width in the coordinates of a component's texture.
void stretch(std::size_t size, const BatchArray& shear, const Component& component, double width,
             BatchArray& out) {
  const double own = width * component.footprint_scale(), twirl = component.texture()->twirl();
  for (std::size_t i = 0; i < size; ++i) {
    out[i] = static_cast<float>(own * stretch_of(twirl * double{shear[i]}));
  }
}

/// Sums over weighted points of what is seen (y) and of all (x).
struct SeenMoments {
  double w = 0, ww = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void add(double weight, double all, double seen) {
    w += weight;
    ww += weight * weight;
    x += weight * all;
    y += weight * seen;
    xx += weight * all * all;
    xy += weight * all * seen;
    yy += weight * seen * seen;
  }
  SeenMoments& operator+=(const SeenMoments& more) {
    w += more.w;
    ww += more.ww;
    x += more.x;
    y += more.y;
    xx += more.xx;
    xy += more.xy;
    yy += more.yy;
    return *this;
  }
};

}  // namespace

void Galaxy::normalise_textures(std::size_t most_cloud_points) {
  double light = 0;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (!components_[c]->absorbs()) light += luminosity(c);
  }
  // Followed ones first: the others are normalised together with what they follow.
  for (const bool follows : {false, true}) {
    for (std::size_t c = 0; c < components_.size(); ++c) {
      const Component& component = *components_[c];
      if ((followed_[c] >= 0) != follows) continue;
      if (component.texture() == nullptr && !follows) continue;
      try {
        const std::size_t first = std::min(first_cloud, most_cloud_points);
        const double share = component.absorbs() || light == 0 ? 1 : luminosity(c) / light;
        refine(first, most_cloud_points, cloud_error / std::sqrt(share),
               [&](std::size_t size) { return normalise(c, size); });
        if (component.absorbs()) {
          for (std::size_t o = 0; o < obliquities.size(); ++o) {
            measure_dust(c, o, std::min(coherence_rays, most_cloud_points));
          }
          continue;
        }
        refine(std::min(first_seen_cloud, most_cloud_points),
               std::min(largest_seen_cloud, most_cloud_points), seen_error / std::sqrt(share),
               [&](std::size_t size) { return measure_seen(c, size); });
      } catch (const InputError& error) {
        throw InputError(component.where(),
                         "component '" + component.name() + "': " + error.what());
      }
    }
  }
}

double Galaxy::normalise(std::size_t c, std::size_t cloud_size) {
  Component& component = *components_[c];
  const std::vector<WeightedBatch> cloud = component.cloud(cloud_size);
  FractalNoise::Factor factor;
  if (followed_[c] >= 0) {
    factor = [this, c](const Points& points, float* out) { followed_phi(c, points, 0, {}, out); };
  }
  if (component.texture() != nullptr) {
    component.texture()->normalise(cloud, factor);
    return component.texture()->mean_error();
  }
  std::vector<BatchArray> factors(cloud.size());
  parallel_for(cloud.size(), [&](std::size_t b) { factor(cloud[b].points(), factors[b].data()); });
  const CloudMean mean = mean_over(cloud, factors);
  follow_scale_[c] = 1 / mean.mean;
  return mean.error / mean.mean;
}

bool Galaxy::hides(std::size_t c, double footprint) const {
  return components_[c]->hides_texture(footprint) ||
         (followed_[c] >= 0 &&
          components_[static_cast<std::size_t>(followed_[c])]->hides_texture(footprint));
}

double Galaxy::log_narrowest(std::size_t c) const {
  double narrow = std::log(double{smallest_footprint}), wide = std::log(widest_footprint);
  // Single precision's rounding counts as narrow.
  constexpr double margin = 1e-5;
  while (wide - narrow > margin) {
    const double middle = 0.5 * (narrow + wide);
    (hides(c, std::exp(middle)) ? wide : narrow) = middle;
  }
  return wide + margin;
}

std::vector<double> Galaxy::seen_widths(std::size_t c, double widest, double ratio) const {
  std::vector<double> widths;
  for (double width = widest; hides(c, width); width /= ratio) widths.push_back(width);
  std::reverse(widths.begin(), widths.end());
  return widths;
}

void Galaxy::cloud_phi(std::size_t c, const Points& points, double width, const BatchArray& shear,
                       BatchArray& out) const {
  BatchArray other;
  if (const Texture* texture = components_[c]->texture(); texture != nullptr) {
    std::uint64_t evaluations = 0;
    if (width > 0) stretch(points.size, shear, *components_[c], width, other);
    texture->evaluate(points, width > 0 ? other.data() : nullptr, nullptr, {}, std::span(&out, 1),
                      evaluations);
  } else {
    std::fill_n(out.data(), batch_capacity, static_cast<float>(follow_scale_[c]));
  }
  if (followed_[c] < 0) return;
  followed_phi(c, points, width, shear, other.data());
  for (std::size_t i = 0; i < points.size; ++i) out[i] *= other[i];
}

double Galaxy::measure_seen(std::size_t c, std::size_t cloud_size) {
  const std::vector<double> widths = seen_widths(c, widest_footprint, footprint_ratio);
  if (widths.empty()) return 0;
  const std::vector<WeightedBatch> cloud = components_[c]->cloud(cloud_size);
  std::vector<SeenMoments> parts(cloud.size() * widths.size());
  parallel_for(cloud.size(), [&](std::size_t b) {
    const WeightedBatch& batch = cloud[b];
    BatchArray all, seen, shear;
    take_shear(batch.points(), shear);
    cloud_phi(c, batch.points(), 0, shear, all);
    for (std::size_t k = 0; k < widths.size(); ++k) {
      cloud_phi(c, batch.points(), widths[k], shear, seen);
      SeenMoments& sums = parts[b * widths.size() + k];
      for (std::size_t i = 0; i < batch.size; ++i) {
        sums.add(double{batch.weight[i]}, double{all[i]}, double{seen[i]});
      }
    }
  });
  // All of Phi, whose mean over the component is 1, is the control variate of what is seen of it.
  std::vector<double> means = {1};
  double largest_error = 0;
  for (std::size_t k = 0; k < widths.size(); ++k) {
    SeenMoments sums;
    for (std::size_t b = 0; b < cloud.size(); ++b) sums += parts[b * widths.size() + k];
    const double x = sums.x / sums.w, y = sums.y / sums.w;
    const double variance = sums.xx / sums.w - x * x;
    const double covariance = sums.xy / sums.w - x * y;
    const double slope = variance > 0 ? covariance / variance : 0.0;
    means.push_back(proper_mean(y - slope * (x - 1)));
    const double rest = std::max(sums.yy / sums.w - y * y - slope * covariance, 0.0);
    largest_error = std::max(largest_error, std::sqrt(rest * sums.ww) / sums.w / means.back());
  }
  seen_means_[c] = {widths.front() / footprint_ratio, footprint_ratio, means};
  return largest_error;
}

void Galaxy::measure_dust(std::size_t c, std::size_t o, std::size_t rays) {
  const std::vector<double> widths = seen_widths(c, largest_coherence_footprint, coherence_ratio);
  if (widths.empty()) return;
  const Component& dust = *components_[c];
  const double path = obliquities[o];
  const auto heights = static_cast<std::size_t>(std::round(coherence_heights * std::sqrt(path)));
  ColumnCloud cloud = dust.columns(rays, heights);
  const std::size_t batches = cloud.columns.size();
  // Light is weighted by the light where the ray meets the plane, the dust by area.
  std::vector<BatchArray> brightness(batches);
  parallel_for(batches, [&](std::size_t b) {
    WeightedBatch& at = cloud.columns[b];
    SampleBatch batch{};
    batch.size = at.size;
    std::fill_n(at.z.data(), batch_capacity, 0.0f);
    HWY_DYNAMIC_DISPATCH(Share)(at.points(), needs_phi_, batch);
    if (needs_winding_) arms_.winding(batch.r.data(), batch.size, batch.winding.data());
    BatchArray envelope;
    BatchArray& light = brightness[b];
    std::fill_n(light.data(), batch_capacity, 0.0f);
    for (const auto& component : components_) {
      if (component->absorbs()) continue;
      component->envelope(batch, envelope.data());
      const auto column = static_cast<float>(std::as_const(*component).amplitude() *
                                             component->face_on_column() / component->peak());
      for (std::size_t i = 0; i < at.size; ++i) light[i] += column * envelope[i];
    }
  });
  // Depths along the rays, by variants.
  const auto slope = static_cast<float>(std::sqrt(path * path - 1));
  BatchArray to_x, to_y;  // Directions in the plane, every one.
  for (std::size_t i = 0; i < batch_capacity; ++i) {
    const double angle = 2 * std::numbers::pi * std::numbers::phi * static_cast<double>(i);
    to_x[i] = static_cast<float>(std::cos(angle));
    to_y[i] = static_cast<float>(std::sin(angle));
  }
  const double scale = dust.amplitude() * axis_[2] * path;
  const auto depths = [&](double width, double coherence, std::span<const double> deviations) {
    const std::size_t variants = std::max<std::size_t>(deviations.size(), 1);
    std::vector<BatchArray> result(batches * variants);
    parallel_for(batches, [&](std::size_t b) {
      const WeightedBatch& at = cloud.columns[b];
      const std::span<BatchArray> own = std::span(result).subspan(b * variants, variants);
      for (BatchArray& depth : own) std::fill_n(depth.data(), batch_capacity, 0.0f);
      std::vector<BatchArray> densities(variants);
      BatchArray x, y, z, footprints, coherences;
      std::fill_n(footprints.data(), batch_capacity, static_cast<float>(width));
      std::fill_n(coherences.data(), batch_capacity, static_cast<float>(coherence));
      EvaluationCounts counts;
      for (std::size_t k = 0; k < heights; ++k) {
        const float away = slope * cloud.heights[k];
        for (std::size_t i = 0; i < padded(at.size); ++i) {
          x[i] = at.x[i] + away * to_x[i];
          y[i] = at.y[i] + away * to_y[i];
        }
        std::fill_n(z.data(), batch_capacity, cloud.heights[k]);
        component_densities(c, {x.data(), y.data(), z.data(), at.size}, 0,
                            width > 0 ? &footprints : nullptr, &coherences, deviations, densities,
                            counts);
        const auto step = static_cast<float>(scale) * cloud.steps[k];
        for (std::size_t v = 0; v < variants; ++v) {
          for (std::size_t i = 0; i < at.size; ++i) own[v][i] += step * densities[v][i];
        }
      }
    });
    return result;
  };
  const auto mean = [&](const std::vector<BatchArray>& values, bool by_light, auto&& term) {
    const std::size_t variants = values.size() / batches;
    double sum = 0, weights = 0;
    for (std::size_t b = 0; b < batches; ++b) {
      const WeightedBatch& at = cloud.columns[b];
      for (std::size_t v = 0; v < variants; ++v) {
        const double share = variants > 1 ? dust_variant_weights[v] : 1.0;
        for (std::size_t i = 0; i < at.size; ++i) {
          const double weight =
              share * double{at.weight[i]} * (by_light ? double{brightness[b][i]} : 1.0);
          weights += weight;
          sum += weight * term(double{values[b * variants + v][i]});
        }
      }
    }
    return sum / weights;
  };
  const auto amount = [&](const std::vector<BatchArray>& values) {
    return mean(values, false, [](double depth) { return depth; });
  };
  // What comes through dust `factor` times as dense.
  const auto light = [&](const std::vector<BatchArray>& values, double factor) {
    return mean(values, true, [&](double depth) { return std::exp(-factor * depth); });
  };
  const std::vector<BatchArray> all = depths(0, 1, {});
  const double whole = amount(all), wanted = light(all, 1);
  if (!(whole > 0) || !std::isfinite(whole) || !std::isfinite(wanted)) return;
  std::vector<double> coherences, amounts;
  double guess = 1;
  for (std::size_t k = widths.size(); k-- > 0;) {
    const auto excess = [&](double coherence) {
      const std::vector<BatchArray> seen = depths(widths[k], coherence, dust_deviations);
      return light(seen, whole / amount(seen)) - wanted;
    };
    // Secants, from what the wider rays have; light grows with the variance.
    double last = guess, last_excess = excess(last);
    guess = last_excess > 0 ? last / first_factor : last * first_factor;
    for (int step = 0; step < secants; ++step) {
      guess = std::clamp(guess, least_coherence, largest_coherence);
      const double own = excess(guess);
      if (!((own - last_excess) * (guess - last) > 0)) {
        guess = last;
        break;
      }
      const double next = guess - own * (guess - last) / (own - last_excess);
      last = guess;
      last_excess = own;
      guess = next;
    }
    guess = std::clamp(guess, least_coherence, largest_coherence);
    coherences.push_back(guess);
    amounts.push_back(proper_mean(amount(depths(widths[k], guess, dust_deviations)) / whole));
  }
  std::reverse(coherences.begin(), coherences.end());
  std::reverse(amounts.begin(), amounts.end());
  dust_[c].log_narrow = static_cast<float>(log_narrowest(c));
  dust_[c].coherence[o] = {widths.front(), coherence_ratio, coherences};
  dust_[c].amount[o] = {widths.front(), coherence_ratio, amounts};
}

void Galaxy::look_up(const ByObliquity& tables, std::size_t size, const BatchArray& log_footprints,
                     const BatchArray& obliquity, BatchArray& out) {
  std::array<BatchArray, obliquities.size()> nodes;
  for (std::size_t o = 0; o < nodes.size(); ++o) {
    tables[o].at(size, log_footprints.data(), nodes[o].data());
  }
  out = nodes[0];
  for (std::size_t o = 1; o < nodes.size(); ++o) {
    const auto low = static_cast<float>(std::log(obliquities[o - 1]));
    const auto width = static_cast<float>(std::log(obliquities[o] / obliquities[o - 1]));
    for (std::size_t i = 0; i < padded(size); ++i) {
      const float share = std::clamp((obliquity[i] - low) / width, 0.0f, 1.0f);
      out[i] += share * (nodes[o][i] - nodes[o - 1][i]);
    }
  }
}

void Galaxy::take_shear(const Points& points, BatchArray& out) const {
  std::fill_n(out.data(), batch_capacity, 0.0f);
  if (!needs_winding_) return;
  BatchArray r;
  for (std::size_t i = 0; i < padded(points.size); ++i) {
    r[i] = std::sqrt(points.x[i] * points.x[i] + points.y[i] * points.y[i]);
  }
  arms_.shear(r.data(), points.size, out.data());
}

void Galaxy::followed_phi(std::size_t c, const Points& points, double width,
                          const BatchArray& shear, float* out) const {
  const Component& source = *components_[static_cast<std::size_t>(followed_[c])];
  const Texture& followed = *source.texture();
  // The cloud is turned by this component's twirl; the followed noise has its own.
  const Texture* own = components_[c]->texture();
  const double twirl = followed.twirl() - (own != nullptr ? own->twirl() : 0.0);
  BatchArray all, footprints;
  std::fill_n(all.data(), batch_capacity, 1.0f);
  SampleBatch batch{};
  batch.size = points.size;
  HWY_DYNAMIC_DISPATCH(Share)(points, false, batch);
  arms_.winding(batch.r.data(), batch.size, batch.winding.data());
  CompactedPoints turned;
  HWY_DYNAMIC_DISPATCH(Compact)
  (batch, all.data(), 0.5f, static_cast<float>(twirl), true, nullptr, 1, nullptr, turned);
  if (width > 0) stretch(points.size, shear, source, width, footprints);
  BatchArray phi;
  std::uint64_t evaluations = 0;
  followed.evaluate({turned.x, turned.y, turned.z, turned.size},
                    width > 0 ? footprints.data() : nullptr, nullptr, {}, std::span(&phi, 1),
                    evaluations);
  std::copy_n(phi.data(), padded(points.size), out);
}

double Galaxy::luminosity(std::size_t c) const {
  return std::as_const(*components_[c]).amplitude() * integrals_[c];
}

void Galaxy::resolve_fractions() {
  double by_intensity = 0, fractions = 0;
  const Component* first = nullptr;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const Component& component = *components_[c];
    if (component.absorbs()) continue;
    if (component.fraction()) {
      fractions += *component.fraction();
      if (first == nullptr) first = &component;
    } else {
      by_intensity += luminosity(c);
    }
  }
  if (first == nullptr) return;
  constexpr double rounding = 1e-9;
  if (by_intensity == 0 && std::abs(fractions - 1) > rounding) {
    throw InputError(first->where(), "the fractions of the galaxy's light add up to " +
                                         std::to_string(fractions) + ", not to 1");
  }
  if (by_intensity > 0 && fractions >= 1 - rounding) {
    throw InputError(first->where(),
                     "the fractions of the galaxy's light leave nothing for the components "
                     "that give an intensity");
  }
  const double total = by_intensity > 0 ? by_intensity / (1 - fractions) : 1.0;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    Component& component = *components_[c];
    if (component.absorbs() || !component.fraction()) continue;
    component.set_amplitude(1);
    component.set_amplitude(*component.fraction() * total / luminosity(c));
  }
}

void Galaxy::phi(std::size_t c, const SampleBatch& batch, const BatchArray& need, float threshold,
                 const BatchArray* footprints, const BatchArray* coherence,
                 std::span<const double> deviations, std::span<BatchArray> out,
                 EvaluationCounts& counts) const {
  const Component& component = *components_[c];
  const Texture& texture = *component.texture();
  CompactedPoints points;
  HWY_DYNAMIC_DISPATCH(Compact)
  (batch, need.data(), threshold, static_cast<float>(texture.twirl()), needs_winding_,
   footprints != nullptr ? footprints->data() : nullptr,
   static_cast<float>(component.footprint_scale()),
   coherence != nullptr ? coherence->data() : nullptr, points);
  const Clock clock;
  if (points.size > 0) {
    texture.evaluate({points.x, points.y, points.z, points.size},
                     footprints != nullptr ? points.footprint : nullptr,
                     coherence != nullptr ? points.coherence : nullptr, deviations, out,
                     counts.noise_evaluations);
  }
  for (BatchArray& values : out) {
    BatchArray compacted;
    std::copy_n(values.data(), points.size, compacted.data());
    std::fill_n(values.data(), padded(batch.size), 1.0f);
    for (std::size_t i = 0; i < points.size; ++i) {
      values[static_cast<std::size_t>(points.index[i])] = 1 + points.fade[i] * (compacted[i] - 1);
    }
  }
  counts.noise_seconds += clock.seconds();
}

void Galaxy::evaluate(const Points& points, float threshold, const RayBatch* rays,
                      std::span<const double> deviations, std::span<BatchArray> densities,
                      EvaluationCounts& counts) const {
  const Clock clock;
  const double earlier_noise = counts.noise_seconds;
  const BatchArray* footprints = rays != nullptr ? &rays->footprint : nullptr;
  const std::size_t count = components_.size();
  SampleBatch batch;
  batch.size = points.size;
  HWY_DYNAMIC_DISPATCH(Share)(points, needs_phi_, batch);
  if (needs_winding_) {
    arms_.winding(batch.r.data(), batch.size, batch.winding.data());
    if (footprints != nullptr) arms_.shear(batch.r.data(), batch.size, batch.shear.data());
  }
  for (std::size_t c = 0; c < count; ++c) components_[c]->envelope(batch, densities[c].data());
  // The noise of followed components is wanted wherever they or a follower matter.
  std::vector<BatchArray> followed_phi(followed_components_.size());
  const auto phi_of_followed = [&](std::size_t c) -> const BatchArray* {
    for (std::size_t k = 0; k < followed_components_.size(); ++k) {
      if (followed_components_[k] == c) return &followed_phi[k];
    }
    return nullptr;
  };
  BatchArray need;
  for (std::size_t k = 0; k < followed_components_.size(); ++k) {
    const std::size_t c = followed_components_[k];
    std::memcpy(need.data(), densities[c].data(), padded(batch.size) * sizeof(float));
    for (std::size_t f = 0; f < count; ++f) {
      if (followed_[f] == static_cast<int>(c)) {
        HWY_DYNAMIC_DISPATCH(Largest)(batch.size, densities[f].data(), need.data());
      }
    }
    // Whichever of them needs the noise most decides.
    double scale = components_[c]->threshold_scale();
    for (std::size_t f = 0; f < count; ++f) {
      if (followed_[f] == static_cast<int>(c)) {
        scale = std::min(scale, components_[f]->threshold_scale());
      }
    }
    phi(c, batch, need, threshold * static_cast<float>(scale), footprints, nullptr, {},
        std::span(&followed_phi[k], 1), counts);
  }
  BatchArray log_footprints, coherence, amount;
  if (footprints != nullptr) {
    HWY_DYNAMIC_DISPATCH(Logarithm)(batch.size, footprints->data(), log_footprints.data());
  }
  std::vector<BatchArray> own(std::max<std::size_t>(deviations.size(), 1));
  for (std::size_t c = 0; c < count; ++c) {
    const Component& component = *components_[c];
    const std::size_t variants = component.absorbs() ? own.size() : 1;
    const BatchArray* known = phi_of_followed(c);
    if (component.texture() != nullptr && known == nullptr) {
      const bool varies = variants > 1 && footprints != nullptr;
      if (varies) {
        look_up(dust_[c].coherence, batch.size, log_footprints, rays->obliquity, coherence);
      }
      phi(c, batch, densities[c], threshold * static_cast<float>(component.threshold_scale()),
          footprints, varies ? &coherence : nullptr, deviations, std::span(own).first(variants),
          counts);
    }
    const BatchArray* followed =
        followed_[c] >= 0 ? phi_of_followed(static_cast<std::size_t>(followed_[c])) : nullptr;
    // The first last: it takes the envelope's place.
    for (std::size_t k = variants; k-- > 0;) {
      const BatchArray* phi = component.texture() == nullptr ? nullptr
                              : known != nullptr             ? known
                                                             : &own[k];
      HWY_DYNAMIC_DISPATCH(Scale)
      (batch.size, static_cast<float>(component.amplitude() * follow_scale_[c]),
       densities[c].data(), phi != nullptr ? phi->data() : nullptr,
       followed != nullptr ? followed->data() : nullptr, densities[k * count + c].data());
    }
    if (footprints == nullptr || (component.absorbs() && variants == 1)) continue;
    if (component.absorbs()) {
      look_up(dust_[c].amount, batch.size, log_footprints, rays->obliquity, amount);
      // There the result must not depend on whether other rays have variants.
      for (std::size_t i = 0; i < padded(batch.size); ++i) {
        if (log_footprints[i] <= dust_[c].log_narrow) amount[i] = 1;
      }
    } else {
      seen_means_[c].at(batch.size, log_footprints.data(), amount.data());
    }
    for (std::size_t k = 0; k < variants; ++k) {
      HWY_DYNAMIC_DISPATCH(Divide)
      (batch.size, amount.data(), densities[k * count + c].data());
    }
  }
  counts.envelope_seconds += clock.seconds() - (counts.noise_seconds - earlier_noise);
}

void Galaxy::evaluate_component(std::size_t c, const Points& points, float threshold,
                                BatchArray& density, EvaluationCounts& counts) const {
  component_densities(c, points, threshold, nullptr, nullptr, {}, std::span(&density, 1), counts);
}

void Galaxy::component_densities(std::size_t c, const Points& points, float threshold,
                                 const BatchArray* footprints, const BatchArray* coherence,
                                 std::span<const double> deviations,
                                 std::span<BatchArray> densities, EvaluationCounts& counts) const {
  const Component& component = *components_[c];
  SampleBatch batch;
  batch.size = points.size;
  HWY_DYNAMIC_DISPATCH(Share)(points, needs_phi_, batch);
  if (needs_winding_) {
    arms_.winding(batch.r.data(), batch.size, batch.winding.data());
    if (footprints != nullptr) arms_.shear(batch.r.data(), batch.size, batch.shear.data());
  }
  BatchArray envelope, followed;
  component.envelope(batch, envelope.data());
  const auto limit = threshold * static_cast<float>(component.threshold_scale());
  const bool follows = followed_[c] >= 0, is_textured = component.texture() != nullptr;
  if (is_textured) {
    phi(c, batch, envelope, limit, footprints, coherence, deviations, densities, counts);
  }
  if (follows) {
    phi(static_cast<std::size_t>(followed_[c]), batch, envelope, limit, footprints, nullptr, {},
        std::span(&followed, 1), counts);
  }
  for (BatchArray& density : densities) {
    HWY_DYNAMIC_DISPATCH(Scale)
    (batch.size, static_cast<float>(follow_scale_[c]), envelope.data(),
     is_textured ? density.data() : nullptr, follows ? followed.data() : nullptr, density.data());
  }
}

void Galaxy::measure_star_fields() {
  for (std::size_t c = 0; c < components_.size(); ++c) {
    auto* field = dynamic_cast<StarField*>(components_[c].get());
    if (field == nullptr) continue;
    if (std::as_const(*field).texture() == nullptr && followed_[c] < 0) {
      field->set_largest_phi(1);
      continue;
    }
    // Even in r and z beside a plain layer of the same shape, so that the edges are seen too.
    const LayerShape& shape = field->shape();
    float largest = 0;
    BatchArray x, y, z, density, envelope;
    EvaluationCounts counts;
    SampleBatch batch;
    for (std::size_t first = 0; first < peak_places; first += batch_capacity) {
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        double u[3];
        R3Sequence().point(first + i, u);
        const double r = std::min(1.0, bright_lengths * shape.rh) * std::sqrt(u[0]);
        const double angle = 2 * std::numbers::pi * u[1];
        x[i] = static_cast<float>(r * std::cos(angle));
        y[i] = static_cast<float>(r * std::sin(angle));
        z[i] = static_cast<float>(bright_heights * shape.z0 * (2 * u[2] - 1));
      }
      const Points points{x.data(), y.data(), z.data(), batch_capacity};
      evaluate_component(c, points, 0, density, counts);
      batch.size = points.size;
      HWY_DYNAMIC_DISPATCH(Share)(points, needs_phi_, batch);
      if (needs_winding_) arms_.winding(batch.r.data(), batch.size, batch.winding.data());
      field->envelope(batch, envelope.data());
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        if (envelope[i] > 0) largest = std::max(largest, density[i] / envelope[i]);
      }
    }
    field->set_largest_phi(peak_margin * double{largest});
  }
}

}  // namespace gamer
#endif
