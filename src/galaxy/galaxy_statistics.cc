#include "gamer/galaxy/galaxy_statistics.h"

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
#include "gamer/galaxy/dust_variants.h"
#include "gamer/galaxy/star_field.h"

namespace gamer {
namespace {

// Points over which the mean of a texture is taken at first, and then as many as independent points
// would need for this error, up to the settings' limit; the cloud's are up to four times better. A
// component with a share f of the light is allowed f^(-1/2) times as much: together the errors are
// this share of the galaxy's light.
constexpr std::size_t first_cloud = std::size_t{1} << 15;
constexpr double cloud_error = 0.004;
// Processes share large clouds in slices of so many batches.
constexpr std::size_t slice_batches = 128;
// The same for what wide rays see of it relative to the whole.
constexpr std::size_t first_seen_cloud = std::size_t{1} << 13;
constexpr std::size_t largest_seen_cloud = std::size_t{1} << 19;
constexpr double seen_error = 0.0025;
// Widths with a smaller share of it over the first cloud do not need the larger one.
constexpr double small_error = 0.3;
// They are of footprints up to the widest, each so many times the one before.
constexpr double largest_seen_footprint = 0.5;
constexpr double footprint_ratio = 2;
// What dust lets through is measured along so many rays, of so many points where they are face on,
// at footprints of that ratio up to the largest.
constexpr std::size_t coherence_rays = std::size_t{1} << 12;
constexpr double coherence_heights = 10;
constexpr double coherence_ratio = std::numbers::sqrt3;
constexpr double largest_coherence_footprint = 1.0 / 9;
constexpr double least_coherence = 0.05;
constexpr double largest_coherence = 4;
constexpr double first_factor = 1.3;
constexpr int secants = 4;
// Of what comes through: light that errs by less needs no further secant.
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

/// Sums over weighted points.
struct WholeMoments {
  double w = 0, ww = 0, x = 0, xx = 0;

  void add(double weight, double all) {
    w += weight;
    ww += weight * weight;
    x += weight * all;
    xx += weight * all * all;
  }
  WholeMoments& operator+=(const WholeMoments& more) {
    w += more.w;
    ww += more.ww;
    x += more.x;
    xx += more.xx;
    return *this;
  }
};

/// The same of what is seen (y) of all (x).
struct SeenMoments {
  double y = 0, xy = 0, yy = 0;

  void add(double weight, double all, double seen) {
    y += weight * seen;
    xy += weight * all * seen;
    yy += weight * seen * seen;
  }
  SeenMoments& operator+=(const SeenMoments& more) {
    y += more.y;
    xy += more.xy;
    yy += more.yy;
    return *this;
  }
};

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

GalaxyStatistics::GalaxyStatistics(Galaxy& galaxy)
    : galaxy_(galaxy),
      first_error_(galaxy.components_.size(), -1.0),
      larger_(galaxy.components_.size()) {
  std::vector<Part>& first = parts_[static_cast<std::size_t>(Round::first)];
  std::vector<Part>& seen = parts_[static_cast<std::size_t>(Round::seen)];
  for (std::size_t c = 0; c < galaxy_.components_.size(); ++c) {
    const Component& component = component_at(c);
    const Texture* texture = component.texture();
    if (!component.absorbs()) light_ += galaxy_.luminosity(c);
    if (texture == nullptr && galaxy_.followed_[c] < 0) continue;
    first.push_back({c, 0});
    for (std::size_t o = component.absorbs() ? Galaxy::obliquities.size() : 1; o-- > 0;) {
      seen.push_back({c, o});
    }
    const std::size_t mean = texture != nullptr ? texture->statistics().size() : 0;
    const std::size_t lists =
        component.absorbs() ? 2 * dust_widths(c).size() : seen_widths(c).size() + 1;
    // With the lists' counts, the mean of what is followed, a star field's Phi, and widths more:
    // how sharp a texture is may show only when it is measured.
    constexpr std::size_t others = 12;
    most_numbers_ = std::max({most_numbers_, mean + others, lists + others, CloudMoments::count});
  }
  // What may take long first, so that processes end together: light, then dust from long paths to
  // short ones.
  std::stable_partition(seen.begin(), seen.end(),
                        [&](const Part& part) { return !component_at(part.component).absorbs(); });
}

void GalaxyStatistics::measure(Round round, std::size_t part, std::span<double> numbers) {
  const auto [c, index] = of(round)[part];
  NumberWriter writer(numbers);
  switch (round) {
    case Round::first:
      normalise(c);
      if (const Texture* texture = component_at(c).texture()) writer.add(texture->statistics());
      writer.add(galaxy_.follow_scale_[c]);
      writer.add(first_error_[c]);
      return;
    case Round::larger: {
      const CloudMoments moments = measure_slice(c, index);
      for (const double sum : moments.sums()) writer.add(sum);
      return;
    }
    case Round::seen:
      galaxy_.check_density(c);
      if (component_at(c).absorbs()) {
        std::vector<double> coherences, amounts;
        measure_dust(c, index, std::min(coherence_rays, galaxy_.most_cloud_points_), coherences,
                     amounts);
        writer.add(coherences);
        writer.add(amounts);
        return;
      }
      writer.add(measure_seen(c));
      if (const auto* field = dynamic_cast<const StarField*>(&component_at(c))) {
        writer.add(largest_phi(c, *field));
      }
  }
}

void GalaxyStatistics::take(Round round, std::size_t part, std::span<const double> numbers) {
  const auto [c, index] = of(round)[part];
  Component& component = *galaxy_.components_[c];
  NumberReader reader(numbers);
  switch (round) {
    case Round::first:
      if (Texture* texture = component.texture()) texture->restore(reader.list());
      galaxy_.follow_scale_[c] = reader.number();
      first_error_[c] = reader.number();
      return;
    case Round::larger:
      larger_[c].moments.add(numbers.first(CloudMoments::count));
      return;
    case Round::seen:
      break;
  }
  if (component.absorbs()) {
    const std::vector<double> coherences = reader.list(), amounts = reader.list();
    if (coherences.empty()) return;
    const auto narrower = static_cast<double>(coherences.size()) - 1;
    const double narrowest = largest_coherence_footprint * std::pow(coherence_ratio, -narrower);
    Galaxy::Dust& dust = galaxy_.dust_[c];
    dust.log_narrow = static_cast<float>(log_narrowest(c));
    dust.coherence[index] = {narrowest, coherence_ratio, coherences};
    dust.amount[index] = {narrowest, coherence_ratio, amounts};
    return;
  }
  if (std::vector<double> means = reader.list(); !means.empty()) {
    const auto narrower = static_cast<double>(means.size());
    const double narrowest = largest_seen_footprint * std::pow(footprint_ratio, -narrower);
    // What all see is 1.
    means.insert(means.begin(), 1);
    galaxy_.seen_means_[c] = {narrowest, footprint_ratio, means};
  }
  if (auto* field = dynamic_cast<StarField*>(&component)) field->set_largest_phi(reader.number());
}

void GalaxyStatistics::finish(Round round) {
  if (round == Round::larger) correct_means();
  if (round != Round::first) return;
  std::vector<Part>& slices = parts_[static_cast<std::size_t>(Round::larger)];
  for (const Part& part : of(Round::first)) {
    const std::size_t c = part.component;
    const std::size_t first = std::min(first_cloud, galaxy_.most_cloud_points_);
    larger_[c].points = points_needed(c, first, first_error_[c], cloud_error);
    // A cloud has about as many points as it is asked for.
    const std::size_t batches = (larger_[c].points + batch_capacity - 1) / batch_capacity;
    const std::size_t count = (batches + slice_batches - 1) / slice_batches;
    for (std::size_t k = 0; k < count; ++k) slices.push_back({c, k});
    larger_[c].slices = count;
  }
}

CloudMoments GalaxyStatistics::measure_slice(std::size_t c, std::size_t slice) {
  Larger& own = larger_[c];
  if (own.cloud.batches == 0) own.cloud = component_at(c).cloud(own.points);
  const auto begin = [&](std::size_t k) { return own.cloud.batches * k / own.slices; };
  return moments_over(own.cloud, begin(slice), begin(slice + 1),
                      [&](const Points& points, float* out) { whole_phi(c, points, out); });
}

void GalaxyStatistics::measure_all() {
  std::vector<double> numbers(most_numbers_);
  for (const Round round : rounds) {
    for (std::size_t part = 0; part < parts(round); ++part) {
      measure(round, part, numbers);
      take(round, part, numbers);
    }
    finish(round);
  }
}

double GalaxyStatistics::share(std::size_t c) const {
  return component_at(c).absorbs() || light_ == 0 ? 1 : galaxy_.luminosity(c) / light_;
}

void GalaxyStatistics::normalise(std::size_t c) {
  if (first_error_[c] >= 0) return;
  // Together with what it follows.
  if (galaxy_.followed_[c] >= 0) normalise(static_cast<std::size_t>(galaxy_.followed_[c]));
  Component& component = *galaxy_.components_[c];
  const std::vector<WeightedBatch> cloud =
      component.cloud(std::min(first_cloud, galaxy_.most_cloud_points_)).all();
  try {
    if (Texture* texture = component.texture(); texture != nullptr) {
      FractalNoise::Factor factor;
      if (galaxy_.followed_[c] >= 0) {
        factor = [this, c](const Points& points, float* out) { followed_phi(c, points, out); };
      }
      texture->normalise(cloud, factor);
      first_error_[c] = texture->mean_error();
    } else {
      const CloudMean mean = mean_over(cloud, [&](std::size_t b, BatchArray& out) {
        followed_phi(c, cloud[b].points(), out.data());
      });
      galaxy_.follow_scale_[c] = 1 / mean.mean;
      first_error_[c] = mean.error / mean.mean;
    }
  } catch (const InputError& error) {
    throw InputError(component.where(), "component '" + component.name() + "': " + error.what());
  }
}

std::size_t GalaxyStatistics::points_needed(std::size_t c, std::size_t first, double error,
                                            double wanted) const {
  const double excess = error / wanted * std::sqrt(share(c));
  const double needed = static_cast<double>(first) * excess * excess;
  const auto most = static_cast<double>(galaxy_.most_cloud_points_);
  if (!(excess > 1) || most <= static_cast<double>(first)) return 0;
  return static_cast<std::size_t>(std::min(needed, most));
}

void GalaxyStatistics::whole_phi(std::size_t c, const Points& points, float* out) const {
  if (const Texture* texture = component_at(c).texture(); texture != nullptr) {
    evaluate_whole(*texture, points, out);
  } else {
    std::fill_n(out, padded(points.size), static_cast<float>(galaxy_.follow_scale_[c]));
  }
  if (galaxy_.followed_[c] < 0) return;
  // Bright clumps leave half of the layer empty, where what they follow does not matter.
  BatchArray x, y, z, factor;
  std::array<std::size_t, batch_capacity> place;
  std::size_t lit = 0;
  for (std::size_t i = 0; i < points.size; ++i) {
    place[lit] = i;
    x[lit] = points.x[i];
    y[lit] = points.y[i];
    z[lit] = points.z[i];
    if (out[i] > 0) ++lit;
  }
  if (lit == 0) return;
  for (std::size_t k = lit; k < padded(lit); ++k) x[k] = y[k] = z[k] = 0;
  followed_phi(c, {x.data(), y.data(), z.data(), lit}, factor.data());
  for (std::size_t k = 0; k < lit; ++k) out[place[k]] *= factor[k];
}

void GalaxyStatistics::correct_means() {
  const std::vector<Part>& measured = of(Round::first);
  // Of a component's Phi as it is, what it follows included; 1 where the first cloud sufficed.
  std::vector<CloudMean> means(larger_.size());
  for (const Part& part : measured) {
    const std::size_t c = part.component;
    const Texture* texture = component_at(c).texture();
    means[c] = {1, texture != nullptr ? std::pow(texture->rms(), 2) : 1.0, first_error_[c]};
    if (larger_[c].slices == 0) continue;
    means[c] = larger_[c].moments.mean();
    if (!(means[c].mean > 0) || !std::isfinite(means[c].square_mean)) {
      throw InputError(component_at(c).where(),
                       "component '" + component_at(c).name() +
                           "': its texture is zero or infinite; change the noise's offset, "
                           "contrast, exponent or floor");
    }
  }
  for (const Part& part : measured) {
    const std::size_t c = part.component;
    CloudMean mean = means[c];
    // What is followed follows nothing, and is corrected by its own mean.
    if (const int followed = galaxy_.followed_[c]; followed >= 0) {
      const double before = means[static_cast<std::size_t>(followed)].mean;
      mean = {mean.mean / before, mean.square_mean / (before * before), mean.error / before};
    }
    if (Texture* texture = galaxy_.components_[c]->texture(); texture != nullptr) {
      texture->correct_mean(mean);
    } else {
      galaxy_.follow_scale_[c] /= mean.mean;
    }
  }
}

bool GalaxyStatistics::hides(std::size_t c, double footprint) const {
  const int followed = galaxy_.followed_[c];
  return component_at(c).hides_texture(footprint) ||
         (followed >= 0 &&
          component_at(static_cast<std::size_t>(followed)).hides_texture(footprint));
}

double GalaxyStatistics::log_narrowest(std::size_t c) const {
  double narrow = std::log(double{smallest_footprint}), wide = std::log(largest_seen_footprint);
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

std::vector<double> GalaxyStatistics::seen_widths(std::size_t c) const {
  return widths(c, largest_seen_footprint, footprint_ratio);
}

std::vector<double> GalaxyStatistics::dust_widths(std::size_t c) const {
  return widths(c, largest_coherence_footprint, coherence_ratio);
}

void GalaxyStatistics::cloud_phi(std::size_t c, const Points& points,
                                 std::span<const double> widths, std::span<BatchArray> out) const {
  BatchArray shear;
  take_shear(points, shear);
  if (component_at(c).texture() != nullptr) {
    expect_texture(component_at(c), points, shear, widths, out);
  } else {
    const auto scale = static_cast<float>(galaxy_.follow_scale_[c]);
    for (BatchArray& phi : out) std::fill_n(phi.data(), batch_capacity, scale);
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

std::vector<double> GalaxyStatistics::measure_seen(std::size_t c) const {
  const std::vector<double> widths = seen_widths(c);
  if (widths.empty()) return {};
  const std::size_t first = std::min(first_seen_cloud, galaxy_.most_cloud_points_);
  std::vector<SeenMean> means = measure_seen(c, first, widths);
  // More points for those that need them.
  std::vector<std::size_t> rough;
  std::vector<double> rough_widths;
  std::size_t size = 0;
  for (std::size_t k = 0; k < widths.size(); ++k) {
    const double error = means[k].error / means[k].mean;
    if (points_needed(c, first, error, small_error * seen_error) == 0) continue;
    rough.push_back(k);
    rough_widths.push_back(widths[k]);
    size = std::max(size, std::min(points_needed(c, first, error, seen_error), largest_seen_cloud));
  }
  if (size > 0) {
    const std::vector<SeenMean> better = measure_seen(c, size, rough_widths);
    for (std::size_t k = 0; k < rough.size(); ++k) means[rough[k]] = better[k];
  }
  std::vector<double> result;
  for (const SeenMean& mean : means) result.push_back(mean.mean);
  return result;
}

std::vector<GalaxyStatistics::SeenMean> GalaxyStatistics::measure_seen(
    std::size_t c, std::size_t cloud_size, std::span<const double> widths) const {
  const Cloud cloud = component_at(c).cloud(cloud_size);
  std::vector<WholeMoments> whole_parts(cloud.batches);
  std::vector<SeenMoments> seen_parts(cloud.batches * widths.size());
  std::vector<double> with_all(widths.begin(), widths.end());
  with_all.push_back(0);
  parallel_for(cloud.batches, [&](std::size_t b) {
    WeightedBatch batch{};
    cloud.fill(b, batch);
    std::vector<BatchArray> phi(with_all.size());
    cloud_phi(c, batch.points(), with_all, phi);
    const BatchArray& all = phi.back();
    for (std::size_t i = 0; i < batch.size; ++i) {
      whole_parts[b].add(double{batch.weight[i]}, double{all[i]});
    }
    for (std::size_t k = 0; k < widths.size(); ++k) {
      SeenMoments& sums = seen_parts[b * widths.size() + k];
      for (std::size_t i = 0; i < batch.size; ++i) {
        sums.add(double{batch.weight[i]}, double{all[i]}, double{phi[k][i]});
      }
    }
  });
  // All of Phi, whose mean over the component is 1, is the control variate of what is seen of it.
  WholeMoments whole;
  for (const WholeMoments& part : whole_parts) whole += part;
  const double x = whole.x / whole.w;
  const double variance = whole.xx / whole.w - x * x;
  std::vector<SeenMean> means;
  for (std::size_t k = 0; k < widths.size(); ++k) {
    SeenMoments sums;
    for (std::size_t b = 0; b < cloud.batches; ++b) sums += seen_parts[b * widths.size() + k];
    const double y = sums.y / whole.w;
    const double covariance = sums.xy / whole.w - x * y;
    const double slope = variance > 0 ? covariance / variance : 0.0;
    const double rest = std::max(sums.yy / whole.w - y * y - slope * covariance, 0.0);
    means.push_back({proper_mean(y - slope * (x - 1)), std::sqrt(rest * whole.ww) / whole.w});
  }
  return means;
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
  const double scale = dust.amplitude() * galaxy_.axis_[2] * path * galaxy_.follow_scale_[c];
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
  const std::vector<double> widths = dust_widths(c);
  if (widths.empty()) return;
  std::vector<double> with_all = widths;
  with_all.push_back(0);
  const DustRays traced = trace_dust(c, Galaxy::obliquities[obliquity], rays, with_all);
  const std::vector<BatchArray> all = traced.depths(widths.size(), 1, {});
  const double whole = traced.amount(all), wanted = traced.light(all, 1);
  if (!(whole > 0) || !std::isfinite(whole) || !std::isfinite(wanted)) return;
  /// With a coherence: by how much too much light comes through, and how much dust there is.
  struct Passed {
    double coherence, excess, amount;
  };
  double guess = 1, slope = 0, wider = 0;
  for (std::size_t k = widths.size(); k-- > 0;) {
    const auto pass = [&](double coherence) {
      const std::vector<BatchArray> depths = traced.depths(k, coherence, dust_deviations);
      const double amount = traced.amount(depths);
      return Passed{coherence, traced.light(depths, whole / amount) - wanted,
                    proper_mean(amount / whole)};
    };
    // Secants, from what wider rays have, slope included; light grows with the variance.
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
    // It changes from width to width by about the same factor.
    const double change = wider > 0 ? last.coherence / wider : 1.0;
    wider = last.coherence;
    guess = std::clamp(wider * std::clamp(change, 1 / first_factor, first_factor), least_coherence,
                       largest_coherence);
    coherences.push_back(last.coherence);
    amounts.push_back(last.amount);
  }
  std::reverse(coherences.begin(), coherences.end());
  std::reverse(amounts.begin(), amounts.end());
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
