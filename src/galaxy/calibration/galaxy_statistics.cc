#include "gamer/galaxy/calibration/galaxy_statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/galaxy/kinds/star_field.h"

namespace gamer {
namespace {

// Points over which a texture's statistics are taken at first. Where independent points would need
// more for a mean with Accuracy::mean_error, it is taken over a larger cloud, up to the settings'
// limit. Few points tell the need only roughly: the larger cloud has a least size and a margin. A
// component with a share f of the light is allowed f^(-1/2) times that error: together the errors
// are this share of the galaxy's light.
constexpr std::size_t first_cloud = std::size_t{1} << 13;
constexpr double least_larger_cloud = 1 << 15;
constexpr double cloud_margin = 1.5;
// The error at most where all of a texture is seen: the dust in front of a star has no neighbours
// that make up for its error.
constexpr double whole_error = 0.003;
// Processes share large clouds in slices of so many batches.
constexpr std::size_t slice_batches = 128;
// Means are tabulated for footprints up to the widest, each so many times the one before.
constexpr double widest_mean = 0.5;
constexpr double mean_ratio = std::numbers::sqrt2;
// What dust lets through is measured along so many rays, of so many points where they are face on,
// at footprints of that ratio up to the largest.
constexpr std::size_t coherence_rays = std::size_t{1} << 12;
constexpr double coherence_heights = 10;
constexpr double coherence_ratio = std::numbers::sqrt3;
constexpr double largest_coherence_footprint = 1.0 / 9;
constexpr double least_coherence = 0.05;
constexpr double largest_coherence = 4;
constexpr double first_factor = 1.3;
constexpr int secants = 5;
// Relative error of the light that comes through: below it no further secant is needed.
constexpr double light_error = 1e-3;

// Places at which the largest Phi of a star field is looked for, and by what it may exceed the
// largest found: the light of what is beyond is below 1e-4 of the field's (tests).
constexpr std::size_t peak_places = std::size_t{1} << 14;
constexpr double peak_margin = 1.25;
// Within so many scale lengths and heights.
constexpr double bright_lengths = 4;
constexpr double bright_heights = 2;

/// A mean of few points may be of none that count.
double proper_mean(double mean) { return mean > 0 && std::isfinite(mean) ? mean : 1; }

/// Phi of a texture at points that were turned back by its twirl, where all of it is seen.
void evaluate_whole(const Texture& texture, const Points& points, float* out) {
  BatchArray phi;
  std::uint64_t evaluations = 0;
  texture.evaluate(points, nullptr, nullptr, {}, std::span(&phi, 1), evaluations);
  std::copy_n(phi.data(), padded(points.size), out);
}

/// What rays of each width see of a component's texture at points that were turned back by its
/// twirl.
void see_texture(const Component& component, const Points& points, const BatchArray& shear,
                 std::span<const double> widths, bool wants_coherent, std::span<SeenNoise> out) {
  const Texture& texture = *component.texture();
  BatchArray stretched;
  for (std::size_t i = 0; i < points.size; ++i) {
    stretched[i] = static_cast<float>(component.footprint_scale() *
                                      stretch_of(texture.twirl() * double{shear[i]}));
  }
  std::vector<BatchArray> footprints(widths.size());
  std::vector<const float*> sets;
  for (std::size_t w = 0; w < widths.size(); ++w) {
    const auto width = static_cast<float>(widths[w]);
    for (std::size_t i = 0; i < points.size; ++i) footprints[w][i] = width * stretched[i];
    sets.push_back(footprints[w].data());
  }
  std::uint64_t evaluations = 0;
  texture.see(points, sets, wants_coherent, out, evaluations);
}

/// What is expected of it, by as many widths.
void expect_texture(const Component& component, const Points& points, const BatchArray& shear,
                    std::span<const double> widths, std::span<BatchArray> out) {
  const auto seen = std::make_unique_for_overwrite<SeenNoise[]>(widths.size());
  see_texture(component, points, shear, widths, false, {seen.get(), widths.size()});
  for (std::size_t w = 0; w < widths.size(); ++w) {
    component.texture()->expect(points.size, seen[w], nullptr, {}, out.subspan(w, 1));
  }
}

/// Numbers of a part, one after the other.
class NumberWriter {
 public:
  explicit NumberWriter(std::span<double> numbers) : numbers_(numbers) {}

  void add(double number) {
    if (numbers_.empty()) throw std::logic_error("a part of the statistics has too many numbers");
    numbers_[0] = number;
    numbers_ = numbers_.subspan(1);
  }
  /// With their count before them.
  void add(const std::vector<double>& list) {
    add(static_cast<double>(list.size()));
    for (const double number : list) add(number);
  }

 private:
  std::span<double> numbers_;
};

class NumberReader {
 public:
  explicit NumberReader(std::span<const double> numbers) : numbers_(numbers) {}

  double number() {
    const double result = numbers_[0];
    numbers_ = numbers_.subspan(1);
    return result;
  }
  std::vector<double> list() {
    const auto size = static_cast<std::size_t>(number());
    const auto own = numbers_.first(size);
    numbers_ = numbers_.subspan(size);
    return {own.begin(), own.end()};
  }

 private:
  std::span<const double> numbers_;
};

}  // namespace

GalaxyStatistics::GalaxyStatistics(Galaxy& galaxy, FootprintRange footprints)
    : galaxy_(galaxy),
      footprints_(footprints),
      is_normalised_(galaxy.components_.size(), false),
      dust_(galaxy.components_.size()) {
  for (std::size_t c = 0; c < galaxy_.components_.size(); ++c) {
    const Component& component = component_at(c);
    if (!component.absorbs()) light_ += galaxy_.luminosity(c);
    // All of them have a part in this round, since processes agree on it.
    const Texture* texture = component.texture();
    if (texture == nullptr) continue;
    of(Round::textures).push_back({c, 0, 0});
    most_numbers_ = std::max(most_numbers_, texture->statistics().size() + 1);
  }
  // Footprints are single precision: there are fewer of these widths.
  constexpr std::size_t most_widths = 200;
  constexpr std::size_t others = 2;
  most_numbers_ = std::max(most_numbers_, 2 * most_widths + others);
}

void GalaxyStatistics::measure(Round round, std::size_t part, std::span<double> numbers) {
  const auto [c, index, slice] = of(round)[part];
  NumberWriter writer(numbers);
  switch (round) {
    case Round::textures:
      normalise(c);
      writer.add(component_at(c).texture()->statistics());
      return;
    case Round::means:
      measure_means(c, numbers);
      return;
    case Round::larger: {
      const CloudMoments moments = measure_slice(means_[index], slice);
      for (const double sum : moments.sums()) writer.add(sum);
      return;
    }
    case Round::closure:
      if (component_at(c).absorbs()) {
        std::vector<double> coherences, amounts;
        measure_dust(c, index, std::min(coherence_rays, galaxy_.most_cloud_points_), coherences,
                     amounts);
        writer.add(coherences);
        writer.add(amounts);
        return;
      }
      writer.add(largest_phi(c, dynamic_cast<const StarField&>(component_at(c))));
  }
}

void GalaxyStatistics::take(Round round, std::size_t part, std::span<const double> numbers) {
  const auto [c, index, slice] = of(round)[part];
  Component& component = *galaxy_.components_[c];
  NumberReader reader(numbers);
  switch (round) {
    case Round::textures:
      component.texture()->restore(reader.list());
      is_normalised_[c] = true;
      return;
    case Round::means:
      for (Mean& mean : means_) {
        if (mean.component != c) continue;
        mean.value = reader.number();
        mean.error = reader.number();
      }
      return;
    case Round::larger:
      means_[index].moments.add(numbers.first(CloudMoments::count));
      return;
    case Round::closure:
      break;
  }
  if (!component.absorbs()) {
    dynamic_cast<StarField&>(component).set_largest_phi(reader.number());
    return;
  }
  std::vector<double> coherences = reader.list(), amounts = reader.list();
  if (coherences.empty()) return;
  const std::vector<double> widths = dust_widths(c);
  Galaxy::Dust& dust = dust_[c];
  dust.coherence[index] = {widths.front(), coherence_ratio, for_all(widths, coherences)};
  dust.amount[index] = {widths.front(), coherence_ratio, for_all(widths, amounts)};
}

void GalaxyStatistics::finish(Round round) {
  switch (round) {
    case Round::textures:
      return plan_means();
    case Round::means:
      return plan_slices();
    case Round::larger:
      return make_tables();
    case Round::closure:
      if (is_reference()) {
        galaxy_.dust_ = std::make_shared<const std::vector<Galaxy::Dust>>(dust_);
        galaxy_.closure_range_ = footprints_;
      }
  }
}

void GalaxyStatistics::plan_means() {
  for (std::size_t c = 0; c < galaxy_.components_.size(); ++c) {
    const Component& component = component_at(c);
    if (!is_textured(c) || (is_reference() && !component.absorbs())) continue;
    of(Round::means).push_back({c, 0, 0});
    if (is_reference()) {
      means_.emplace_back(c, 0.0);
      // Long paths take longest and come first, so that processes end together.
      for (std::size_t o = Galaxy::obliquities.size(); o-- > 0;) {
        of(Round::closure).push_back({c, o, 0});
      }
      continue;
    }
    const std::vector<double> widths = mean_widths(c);
    const bool is_field = dynamic_cast<const StarField*>(&component) != nullptr;
    const std::span<const double> wanted = measured(widths);
    // Stars that are drawn see the whole texture, and so does the dust in front of them.
    const bool sees_whole = is_field || footprints_.sees_whole;
    if (sees_whole && wanted.front() > 0) means_.emplace_back(c, 0.0);
    for (const double width : wanted) means_.emplace_back(c, width);
    if (is_field) of(Round::closure).push_back({c, 0, 0});
  }
}

void GalaxyStatistics::plan_slices() {
  for (std::size_t m = 0; m < means_.size(); ++m) {
    Mean& mean = means_[m];
    const bool is_some = mean.value > 0 && std::isfinite(mean.value);
    mean.points = points_needed(mean, is_some ? mean.error / mean.value : HUGE_VAL);
    // A cloud has about as many points as it is asked for.
    const std::size_t batches = (mean.points + batch_capacity - 1) / batch_capacity;
    mean.slices = (batches + slice_batches - 1) / slice_batches;
    for (std::size_t k = 0; k < mean.slices; ++k) {
      of(Round::larger).push_back({mean.component, m, k});
    }
  }
}

void GalaxyStatistics::make_tables() {
  for (Mean& mean : means_) {
    if (mean.slices > 0) mean.value = mean.moments.mean().mean;
    if (!(mean.value > 0) || !std::isfinite(mean.value)) {
      const Component& component = component_at(mean.component);
      throw InputError(component.where(),
                       "component '" + component.name() +
                           "': its texture is zero or infinite; change the noise's offset, "
                           "contrast, exponent or floor");
    }
  }
  for (std::size_t c = 0; c < galaxy_.components_.size(); ++c) {
    std::vector<double> values;
    for (const Mean& mean : means_) {
      if (mean.component == c) values.push_back(mean.value);
    }
    if (values.empty()) continue;
    if (is_reference()) {
      galaxy_.means_[c] = {widest_mean, mean_ratio, values};
      continue;
    }
    const std::vector<double> widths = mean_widths(c);
    galaxy_.log_narrow_[c] = static_cast<float>(log_narrowest(c));
    const bool has_more = values.size() > measured(widths).size();
    std::vector<double> table =
        for_all(widths, {values.begin() + (has_more ? 1 : 0), values.end()});
    if (has_more) table.front() = values.front();
    // The first of them, of which rays see all, stands one step below the narrowest that do not.
    const double steps = static_cast<double>(widths.size()) - 1;
    const double widest = steps > 0 ? widths.back() : widest_mean;
    galaxy_.means_[c] = {widest * std::pow(mean_ratio, -steps), mean_ratio, table};
  }
}

void GalaxyStatistics::adopt() {
  if (galaxy_.reference_ != nullptr) galaxy_.dust_ = galaxy_.reference_->dust_;
}

void GalaxyStatistics::measure_all() {
  if (Galaxy* reference = galaxy_.reference_.get();
      reference != nullptr && !reference->closure_range_.covers(footprints_)) {
    GalaxyStatistics(*reference, reference->closure_range_ | footprints_).measure_all();
  }
  std::vector<double> numbers(most_numbers_);
  for (const Round round : rounds) {
    for (std::size_t part = 0; part < parts(round); ++part) {
      measure(round, part, numbers);
      take(round, part, numbers);
    }
    finish(round);
  }
  adopt();
}

double GalaxyStatistics::share(std::size_t c) const {
  return component_at(c).absorbs() || light_ == 0 ? 1 : galaxy_.luminosity(c) / light_;
}

std::size_t GalaxyStatistics::first_points() const {
  return std::min(first_cloud, galaxy_.most_cloud_points_);
}

void GalaxyStatistics::normalise(std::size_t c) {
  if (is_normalised_[c] || component_at(c).texture() == nullptr) return;
  // Together with what it follows.
  if (galaxy_.followed_[c] >= 0) normalise(static_cast<std::size_t>(galaxy_.followed_[c]));
  Component& component = *galaxy_.components_[c];
  FractalNoise::Factor factor;
  if (galaxy_.followed_[c] >= 0) {
    factor = [this, c](const Points& points, float* out) { followed_phi(c, points, out); };
  }
  try {
    component.texture()->normalise(component.cloud(first_points()).all(), factor);
  } catch (const InputError& error) {
    throw InputError(component.where(), "component '" + component.name() + "': " + error.what());
  }
  is_normalised_[c] = true;
}

std::size_t GalaxyStatistics::points_needed(const Mean& mean, double error) const {
  const double wanted =
      mean.footprint > 0 ? galaxy_.mean_error_ : std::min(galaxy_.mean_error_, whole_error);
  const double excess = error / wanted * std::sqrt(share(mean.component));
  const auto first = static_cast<double>(first_points());
  const auto most = static_cast<double>(galaxy_.most_cloud_points_);
  if (!(excess > 1) || most <= first) return 0;
  const double needed = std::max(cloud_margin * first * excess * excess, least_larger_cloud);
  return static_cast<std::size_t>(std::min(needed, most));
}

void GalaxyStatistics::measure_means(std::size_t c, std::span<double> numbers) const {
  std::vector<double> widths;
  for (const Mean& mean : means_) {
    if (mean.component == c) widths.push_back(mean.footprint);
  }
  const Cloud cloud = component_at(c).cloud(first_points());
  std::vector<CloudMoments> parts(cloud.batches * widths.size());
  parallel_for(cloud.batches, [&](std::size_t b) {
    WeightedBatch batch{};
    cloud.fill(b, batch);
    std::vector<BatchArray> phi(widths.size());
    cloud_phi(c, batch.points(), widths, phi);
    for (std::size_t w = 0; w < widths.size(); ++w) {
      parts[b * widths.size() + w].add(batch, phi[w].data());
    }
  });
  NumberWriter writer(numbers);
  for (std::size_t w = 0; w < widths.size(); ++w) {
    CloudMoments moments;
    for (std::size_t b = 0; b < cloud.batches; ++b) {
      moments.add(parts[b * widths.size() + w].sums());
    }
    const CloudMean mean = moments.mean();
    writer.add(mean.mean);
    writer.add(mean.error);
  }
}

CloudMoments GalaxyStatistics::measure_slice(const Mean& mean, std::size_t slice) const {
  const std::size_t c = mean.component;
  const Cloud cloud = component_at(c).cloud(mean.points);
  const auto begin = [&](std::size_t k) { return cloud.batches * k / mean.slices; };
  const std::span<const double> width(&mean.footprint, 1);
  return moments_over(cloud, begin(slice), begin(slice + 1), [&](const Points& points, float* out) {
    BatchArray phi;
    cloud_phi(c, points, width, std::span(&phi, 1));
    std::copy_n(phi.data(), padded(points.size), out);
  });
}

bool GalaxyStatistics::hides(std::size_t c, double footprint) const {
  const int followed = galaxy_.followed_[c];
  return component_at(c).hides_texture(footprint) ||
         (followed >= 0 &&
          component_at(static_cast<std::size_t>(followed)).hides_texture(footprint));
}

double GalaxyStatistics::log_narrowest(std::size_t c) const {
  double narrow = std::log(double{smallest_footprint}), wide = std::log(widest_mean);
  // Single precision's rounding counts as narrow.
  constexpr double margin = 1e-5;
  while (wide - narrow > margin) {
    const double middle = 0.5 * (narrow + wide);
    (hides(c, std::exp(middle)) ? wide : narrow) = middle;
  }
  return wide + margin;
}

std::vector<double> GalaxyStatistics::widths(std::size_t c, double widest, double ratio) const {
  std::vector<double> widths;
  for (double width = widest; hides(c, width); width /= ratio) widths.push_back(width);
  std::reverse(widths.begin(), widths.end());
  return widths;
}

std::vector<double> GalaxyStatistics::mean_widths(std::size_t c) const {
  std::vector<double> result = widths(c, widest_mean, mean_ratio);
  result.insert(result.begin(), 0.0);
  return result;
}

std::vector<double> GalaxyStatistics::dust_widths(std::size_t c) const {
  return widths(c, largest_coherence_footprint, coherence_ratio);
}

std::span<const double> GalaxyStatistics::measured(const std::vector<double>& widths) const {
  if (widths.empty()) return {};
  // Room for single precision's rounding.
  constexpr double margin = 1e-5;
  const double narrowest = footprints_.narrowest * (1 - margin);
  const double widest = footprints_.widest * (1 + margin);
  const auto above = std::upper_bound(widths.begin(), widths.end(), narrowest);
  const auto first = std::min(above == widths.begin() ? above : above - 1, widths.end() - 1);
  auto last = std::lower_bound(first, widths.end(), widest);
  if (last == widths.end()) --last;
  return {first, last + 1};
}

std::vector<double> GalaxyStatistics::for_all(const std::vector<double>& widths,
                                              const std::vector<double>& values) const {
  const std::span<const double> own = measured(widths);
  std::vector<double> result(static_cast<std::size_t>(own.data() - widths.data()), values.front());
  result.insert(result.end(), values.begin(), values.end());
  result.resize(widths.size(), values.back());
  return result;
}

void GalaxyStatistics::cloud_phi(std::size_t c, const Points& points,
                                 std::span<const double> widths, std::span<BatchArray> out) const {
  BatchArray shear;
  take_shear(points, shear);
  if (component_at(c).texture() != nullptr) {
    expect_texture(component_at(c), points, shear, widths, out);
  } else {
    for (BatchArray& phi : out) std::fill_n(phi.data(), batch_capacity, 1.0f);
  }
  multiply_followed(c, points, shear, widths, out);
}

void GalaxyStatistics::multiply_followed(std::size_t c, const Points& points,
                                         const BatchArray& shear, std::span<const double> widths,
                                         std::span<BatchArray> out) const {
  if (galaxy_.followed_[c] < 0) return;
  BatchArray x, y, z;
  std::vector<BatchArray> phi(widths.size());
  expect_texture(followed_by(c), turn_to_followed(c, points, x, y, z), shear, widths, phi);
  for (std::size_t w = 0; w < widths.size(); ++w) {
    for (std::size_t i = 0; i < points.size; ++i) out[w][i] *= phi[w][i];
  }
}

void GalaxyStatistics::followed_phi(std::size_t c, const Points& points, float* out) const {
  BatchArray x, y, z;
  evaluate_whole(*followed_by(c).texture(), turn_to_followed(c, points, x, y, z), out);
}

Points GalaxyStatistics::turn_to_followed(std::size_t c, const Points& points, BatchArray& x,
                                          BatchArray& y, BatchArray& z) const {
  // The cloud is turned by this component's twirl; the followed noise has its own.
  const Texture* own = component_at(c).texture();
  const double twirl = own != nullptr ? own->twirl() : 0.0;
  return galaxy_.turn_back(points, followed_by(c).texture()->twirl() - twirl, x, y, z);
}

void GalaxyStatistics::take_shear(const Points& points, BatchArray& out) const {
  std::fill_n(out.data(), batch_capacity, 0.0f);
  if (!galaxy_.needs_winding_) return;
  BatchArray r;
  for (std::size_t i = 0; i < padded(points.size); ++i) {
    r[i] = std::sqrt(points.x[i] * points.x[i] + points.y[i] * points.y[i]);
  }
  galaxy_.arms_.shear(r.data(), points.size, out.data());
}

/// Rays through a layer of dust, and what those of each width see along them.
struct GalaxyStatistics::DustRays {
  const Texture* texture;  ///< may be null
  std::size_t width_count, heights;
  std::vector<WeightedBatch> columns;  ///< where they meet the plane, by the area they stand for
  std::vector<BatchArray> brightness;  ///< of light there
  /// At every point, [(batch * heights + height) * width_count + width], and by what Phi of it is
  /// multiplied to be a depth.
  std::unique_ptr<SeenNoise[]> seen;
  std::unique_ptr<BatchArray[]> weights;

  /// Depths along the rays, by variants: [variant * batches + b].
  std::vector<BatchArray> depths(std::size_t width, double coherence,
                                 std::span<const double> deviations) const;
  /// Mean of `term`(depth) over rays and variants, by area or also by the light.
  template <class Term>
  double mean(const std::vector<BatchArray>& values, bool by_light, Term&& term) const;
  double amount(const std::vector<BatchArray>& values) const {
    return mean(values, false, [](double depth) { return depth; });
  }
  /// What comes through dust `factor` times as dense.
  double light(const std::vector<BatchArray>& values, double factor) const {
    return mean(values, true, [&](double depth) { return std::exp(-factor * depth); });
  }
};

std::vector<BatchArray> GalaxyStatistics::DustRays::depths(
    std::size_t width, double coherence, std::span<const double> deviations) const {
  const std::size_t batches = columns.size();
  const std::size_t variants = std::max<std::size_t>(deviations.size(), 1);
  std::vector<BatchArray> result(batches * variants);
  BatchArray coherence_of;
  std::fill_n(coherence_of.data(), batch_capacity, static_cast<float>(coherence));
  parallel_for(batches, [&](std::size_t b) {
    const std::size_t size = columns[b].size;
    std::vector<BatchArray> phi(variants);
    for (BatchArray& values : phi) std::fill_n(values.data(), batch_capacity, 1.0f);
    for (std::size_t k = 0; k < heights; ++k) {
      const std::size_t at = (b * heights + k) * width_count + width;
      if (texture != nullptr) {
        texture->expect(size, seen[at], coherence_of.data(), deviations, phi);
      }
      for (std::size_t v = 0; v < variants; ++v) {
        BatchArray& own = result[v * batches + b];
        for (std::size_t i = 0; i < size; ++i) own[i] += weights[at][i] * phi[v][i];
      }
    }
  });
  return result;
}

template <class Term>
double GalaxyStatistics::DustRays::mean(const std::vector<BatchArray>& values, bool by_light,
                                        Term&& term) const {
  const std::size_t batches = columns.size(), variants = values.size() / batches;
  struct Sums {
    double weight = 0, term = 0;
  };
  std::vector<Sums> parts(batches);
  parallel_for(batches, [&](std::size_t b) {
    for (std::size_t v = 0; v < variants; ++v) {
      const double share = variants > 1 ? dust_variant_weights[v] : 1.0;
      const BatchArray& own = values[v * batches + b];
      for (std::size_t i = 0; i < columns[b].size; ++i) {
        const double weight =
            share * double{columns[b].weight[i]} * (by_light ? double{brightness[b][i]} : 1.0);
        parts[b].weight += weight;
        parts[b].term += weight * term(double{own[i]});
      }
    }
  });
  Sums all;
  for (const Sums& part : parts) {
    all.weight += part.weight;
    all.term += part.term;
  }
  return all.term / all.weight;
}

GalaxyStatistics::DustRays GalaxyStatistics::trace_dust(std::size_t c, double path,
                                                        std::size_t rays,
                                                        std::span<const double> widths) const {
  const Component& dust = component_at(c);
  const Texture* texture = dust.texture();
  const auto heights = static_cast<std::size_t>(std::round(coherence_heights * std::sqrt(path)));
  ColumnCloud cloud = dust.columns(rays, heights);
  const std::size_t batches = cloud.columns.size();
  const std::size_t places = batches * heights;
  DustRays result{
      texture,
      widths.size(),
      heights,
      {},
      std::vector<BatchArray>(batches),
      std::make_unique_for_overwrite<SeenNoise[]>(texture != nullptr ? places * widths.size() : 0),
      std::make_unique_for_overwrite<BatchArray[]>(places * widths.size())};
  // Light is weighted by the light where the ray meets the plane, the dust by area.
  parallel_for(batches, [&](std::size_t b) {
    WeightedBatch& at = cloud.columns[b];
    SampleBatch batch{};
    std::fill_n(at.z.data(), batch_capacity, 0.0f);
    galaxy_.place(at.points(), false, batch);
    BatchArray envelope;
    BatchArray& light = result.brightness[b];
    std::fill_n(light.data(), batch_capacity, 0.0f);
    for (const auto& component : galaxy_.components_) {
      if (component->absorbs()) continue;
      component->envelope(batch, envelope.data());
      const auto column = static_cast<float>(std::as_const(*component).amplitude() *
                                             component->face_on_column() / component->peak());
      for (std::size_t i = 0; i < at.size; ++i) light[i] += column * envelope[i];
    }
  });
  const auto slope = static_cast<float>(std::sqrt(path * path - 1));
  BatchArray to_x, to_y;  // Directions in the plane, every one.
  for (std::size_t i = 0; i < batch_capacity; ++i) {
    const double angle = 2 * std::numbers::pi * std::numbers::phi * static_cast<double>(i);
    to_x[i] = static_cast<float>(std::cos(angle));
    to_y[i] = static_cast<float>(std::sin(angle));
  }
  const double mean = galaxy_.means_[c].narrowest();
  const double scale = dust.amplitude() * galaxy_.axis_[2] * path / mean;
  parallel_for(places, [&](std::size_t place) {
    const WeightedBatch& at = cloud.columns[place / heights];
    const std::size_t k = place % heights;
    const float away = slope * cloud.heights[k];
    BatchArray x, y, z, shear;
    for (std::size_t i = 0; i < padded(at.size); ++i) {
      x[i] = at.x[i] + away * to_x[i];
      y[i] = at.y[i] + away * to_y[i];
    }
    std::fill_n(z.data(), batch_capacity, cloud.heights[k]);
    const Points points{x.data(), y.data(), z.data(), at.size};
    SampleBatch batch;
    galaxy_.place(points, false, batch);
    BatchArray envelope;
    dust.envelope(batch, envelope.data());
    const auto step = static_cast<float>(scale) * cloud.steps[k];
    for (std::size_t i = 0; i < at.size; ++i) {
      if (envelope[i] > 0) {
        envelope[i] *= step;
      } else {
        // Outside of the galaxy its arms need not have a winding.
        envelope[i] = x[i] = y[i] = z[i] = 0;
      }
    }
    const std::span own(result.weights.get() + place * widths.size(), widths.size());
    std::fill(own.begin(), own.end(), envelope);
    take_shear(points, shear);
    BatchArray turned_x, turned_y, turned_z;
    const Points turned = texture != nullptr ? galaxy_.turn_back(points, texture->twirl(), turned_x,
                                                                 turned_y, turned_z)
                                             : points;
    multiply_followed(c, turned, shear, widths, own);
    if (texture == nullptr) return;
    see_texture(dust, turned, shear, widths, true,
                {result.seen.get() + place * widths.size(), widths.size()});
  });
  result.columns = std::move(cloud.columns);
  return result;
}

void GalaxyStatistics::measure_dust(std::size_t c, std::size_t obliquity, std::size_t rays,
                                    std::vector<double>& coherences,
                                    std::vector<double>& amounts) const {
  coherences.clear();
  amounts.clear();
  const std::vector<double> all_widths = dust_widths(c);
  const std::span<const double> widths = measured(all_widths);
  if (widths.empty()) return;
  std::vector<double> with_all(widths.begin(), widths.end());
  with_all.push_back(0);
  const DustRays traced = trace_dust(c, Galaxy::obliquities[obliquity], rays, with_all);
  const std::vector<BatchArray> all = traced.depths(widths.size(), 1, {});
  const double whole = traced.amount(all), wanted = traced.light(all, 1);
  if (!(whole > 0) || !std::isfinite(whole) || !std::isfinite(wanted)) return;
  /// With a coherence: by how much too much light comes through, and how much dust there is.
  struct Passed {
    double coherence, excess, amount;
  };
  for (std::size_t k = 0; k < widths.size(); ++k) {
    const double expected = traced.amount(traced.depths(k, 1, {}));
    const auto pass = [&](double coherence) {
      const std::vector<BatchArray> depths = traced.depths(k, coherence, dust_deviations);
      const double amount = traced.amount(depths);
      return Passed{coherence, traced.light(depths, whole / amount) - wanted,
                    proper_mean(amount / expected)};
    };
    // Secants; light grows with the variance.
    double guess = 1, slope = 0;
    Passed last = pass(guess);
    for (int step = 0; step < secants && std::abs(last.excess) > light_error * wanted; ++step) {
      if (slope > 0) {
        guess = last.coherence - last.excess / slope;
      } else {
        guess = last.excess > 0 ? 0.0 : largest_coherence;
      }
      // The first is short, for a slope of its own.
      if (step == 0) {
        guess = std::clamp(guess, last.coherence / first_factor, last.coherence * first_factor);
      }
      const Passed own = pass(std::clamp(guess, least_coherence, largest_coherence));
      const double distance = own.coherence - last.coherence;
      if (!((own.excess - last.excess) * distance > 0)) break;
      slope = (own.excess - last.excess) / distance;
      last = own;
    }
    coherences.push_back(last.coherence);
    amounts.push_back(last.amount);
  }
}

double GalaxyStatistics::largest_phi(std::size_t c, const StarField& field) const {
  // Even in r and z beside a plain layer of the same shape, so that the edges are seen too.
  const LayerShape& shape = field.shape();
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
    galaxy_.evaluate_component(c, points, 0, density, counts);
    galaxy_.place(points, false, batch);
    field.envelope(batch, envelope.data());
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      if (envelope[i] > 0) largest = std::max(largest, density[i] / envelope[i]);
    }
  }
  return peak_margin * double{largest};
}

}  // namespace gamer
