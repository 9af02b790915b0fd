#include "gamer/galaxy/calibration/galaxy_statistics.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "core/shared_values.h"
#include "galaxy/calibration/dust_closure.h"
#include "galaxy/calibration/seen_textures.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/kinds/star_field.h"

namespace gamer {
namespace {

// Number of points of the first cloud, over which a texture's statistics are taken. It also shows
// how many independent points give a mean of the wanted error, Accuracy::mean_error. If the first
// cloud has fewer points, the mean is taken over a larger cloud. Few points show the wanted number
// only roughly, so that the larger cloud has a minimum size and a margin. A component with a share
// f of the light may have f^(-1/2) times the wanted error. The errors of all components together
// are then Accuracy::mean_error of the galaxy's light.
constexpr std::size_t first_cloud = std::size_t{1} << 13;
// Divisor of first_cloud where a rough mean suffices.
constexpr std::size_t rough = 8;
// Divisor of first_cloud for dust in galaxies of fixed flux, where dust changes colours alone. It
// holds if Accuracy::mean_error is above fine_mean_error.
constexpr std::size_t rough_dust = 4;
constexpr double fine_mean_error = 0.0045;
constexpr double least_larger_cloud = 1 << 15;
constexpr double cloud_margin = 1.5;
// Largest error of the mean of fully resolved dust. Errors of dust in front of stars do not average
// out.
constexpr double whole_dust_error = 0.003;
// Factor on the error of means of dust in galaxies of fixed flux, where dust changes colours alone.
// The factor holds for a closure's means, too, since its variance hardly depends on them.
constexpr double dust_mean_error = 4;
// Galaxies with stars are seen from within, where a camera may see little but one component. There
// a component counts as at least this share of the light.
constexpr double least_share_within = 0.25;
// Number of batches of a slice; processes share large clouds in slices.
constexpr std::size_t slice_batches = 128;
// Widest footprint at which means are tabulated, and the ratio of successive footprints.
constexpr double widest_mean = 0.5;
constexpr double mean_ratio = std::numbers::sqrt2;
// Number of places at which the largest Phi of a star field is searched, and the margin above the
// largest Phi found there. Tests find no light beyond the margin at 200000 places.
constexpr std::size_t peak_places = std::size_t{1} << 14;
constexpr double peak_margin = 1.35;
// The largest Phi is searched before Phi is divided by its mean. It counts as found if the mean is
// between peak_mean and twice peak_mean, and is else multiplied by a power of 2. The margin thus is
// at least 0.9 peak_margin. Drawn stars depend on the largest Phi. They hardly change with the
// error of the mean, which depends on the tolerance.
constexpr double peak_mean = 0.9;
// Range of these places in scale lengths and heights.
constexpr double bright_lengths = 4;
constexpr double bright_heights = 2;

/// A writer of the numbers of a part.
class NumberWriter {
 public:
  explicit NumberWriter(std::span<double> numbers) : numbers_(numbers) {}

  void add(double number) {
    if (numbers_.empty()) throw std::logic_error("a part of the statistics has too many numbers");
    numbers_[0] = number;
    numbers_ = numbers_.subspan(1);
  }
  /// Adds a list, preceded by its size.
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
    const auto list = numbers_.first(size);
    numbers_ = numbers_.subspan(size);
    return {list.begin(), list.end()};
  }

 private:
  std::span<const double> numbers_;
};

}  // namespace

GalaxyStatistics::GalaxyStatistics(Galaxy& galaxy, FootprintRange footprints)
    : galaxy_(galaxy),
      footprints_(footprints),
      is_normalised_(galaxy.components().size(), false),
      calibration_(galaxy.calibration()),
      dust_(galaxy.components().size()) {
  for (std::size_t c = 0; c < galaxy_.components().size(); ++c) {
    const Component& component = component_at(c);
    if (!component.absorbs()) light_ += galaxy_.luminosity(c);
    // A component that is already normalised has a part, too, so that all processes have equal
    // parts.
    const Texture* texture = component.texture();
    if (texture == nullptr) continue;
    if (!adopts_texture(c)) of(Round::textures).push_back({c, 0, 0});
    most_numbers_ = std::max(most_numbers_, texture->statistics().size() + 1);
  }
  // Upper bound of the number of widths in single precision.
  constexpr std::size_t most_widths = 200;
  constexpr std::size_t others = 2;
  most_numbers_ = std::max(most_numbers_, CloudMoments::count * most_widths + others);
}

void GalaxyStatistics::measure(Round round, std::size_t part, std::span<double> numbers) {
  const auto [c, index, slice] = of(round)[part];
  NumberWriter writer(numbers);
  switch (round) {
    case Round::textures:
      normalise(c);
      writer.add(component_at(c).texture()->statistics());
      return;
    case Round::means: measure_means(c, numbers); return;
    case Round::larger:
      for (const CloudMoments& moments : measure_slice(larger_[index], slice)) {
        for (const double sum : moments.sums()) writer.add(sum);
      }
      return;
    case Round::closure:
      if (component_at(c).absorbs()) {
        const std::vector<double> widths = dust_widths(c);
        const DustClosureValues closure =
            measure_dust_closure(galaxy_, c, index, measured(widths), light_behind(c));
        writer.add(closure.coherences);
        writer.add(closure.amounts);
        return;
      }
      writer.add(largest_phi(c, *component_at(c).star_field()));
  }
}

void GalaxyStatistics::take(Round round, std::size_t part, std::span<const double> numbers) {
  const auto [c, index, slice] = of(round)[part];
  Component& component = *galaxy_.components()[c];
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
      for (CloudMoments& moments : larger_[index].moments) {
        moments.add(numbers.first(CloudMoments::count));
        numbers = numbers.subspan(CloudMoments::count);
      }
      return;
    case Round::closure: break;
  }
  if (!component.absorbs()) {
    const double mean{calibration_.means[c].narrowest()};
    const double factor = std::exp2(std::ceil(std::log2(peak_mean / mean)));
    calibration_.largest_phi[c] = peak_margin * factor * reader.number();
    return;
  }
  std::vector<double> coherences = reader.list(), amounts = reader.list();
  if (coherences.empty()) return;
  const std::vector<double> widths = dust_widths(c);
  DustClosure& dust = dust_[c];
  dust.coherence[index] = {widths.front(), closure_footprint_ratio, for_all(widths, coherences)};
  dust.amount[index] = {widths.front(), closure_footprint_ratio, for_all(widths, amounts)};
}

void GalaxyStatistics::finish(Round round) {
  switch (round) {
    case Round::textures:
      for (std::size_t c = 0; c < galaxy_.components().size(); ++c) {
        if (adopts_texture(c)) adopt_texture(c);
      }
      return plan_means();
    case Round::means: return plan_slices();
    case Round::larger: return make_tables();
    case Round::closure:
      light_behind_ = {};
      if (is_reference()) {
        calibration_.dust = std::make_shared<const std::vector<DustClosure>>(dust_);
        calibration_.closure_range = footprints_;
      }
      return galaxy_.set_calibration(calibration_);
  }
}

void GalaxyStatistics::plan_means() {
  for (std::size_t c = 0; c < galaxy_.components().size(); ++c) {
    const Component& component = component_at(c);
    if (!is_textured(c)) continue;
    if (!component.absorbs() && (is_reference() || !footprints_.needs_light_means)) continue;
    of(Round::means).push_back({c, 0, 0});
    if (is_reference()) {
      means_.emplace_back(c, 0.0);
      // Long paths take most time and come first, so that processes end together.
      for (std::size_t o = DustClosure::obliquities.size(); o-- > 0;) {
        of(Round::closure).push_back({c, o, 0});
      }
      continue;
    }
    const std::vector<double> widths = mean_widths(c);
    const bool is_field = component.star_field() != nullptr;
    const std::span<const double> wanted = measured(widths);
    // Drawn stars and the dust in front of them need the whole texture.
    if (footprints_.sees_whole && wanted.front() > 0) means_.emplace_back(c, 0.0);
    for (const double width : wanted) means_.emplace_back(c, width);
    if (is_field) of(Round::closure).push_back({c, 0, 0});
  }
}

void GalaxyStatistics::plan_slices() {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> means_of;
  for (std::size_t m = 0; m < means_.size(); ++m) {
    const Mean& mean = means_[m];
    const bool is_some = mean.value > 0 && std::isfinite(mean.value);
    const std::size_t points = points_needed(mean, is_some ? mean.error / mean.value : HUGE_VAL);
    if (points > 0) means_of[{mean.component, points}].push_back(m);
  }
  for (const auto& [key, means] : means_of) {
    const auto [component, points] = key;
    // A cloud has about the requested number of points.
    const std::size_t batches = (points + batch_capacity - 1) / batch_capacity;
    const std::size_t slices = (batches + slice_batches - 1) / slice_batches;
    for (std::size_t k = 0; k < slices; ++k) {
      of(Round::larger).push_back({component, larger_.size(), k});
    }
    larger_.push_back({component, points, slices, means, std::vector<CloudMoments>(means.size())});
  }
}

void GalaxyStatistics::make_tables() {
  for (const LargerCloud& larger : larger_) {
    for (std::size_t k = 0; k < larger.means.size(); ++k) {
      means_[larger.means[k]].value = larger.moments[k].mean().mean;
    }
  }
  for (const Mean& mean : means_) {
    if (!(mean.value > 0) || !std::isfinite(mean.value)) {
      const Component& component = component_at(mean.component);
      throw InputError(component.where(),
                       "component '" + component.name() + "': " +
                           (component.has_texture_mean()
                                ? "this seed has no associations; their number is too small"
                                : "its texture is zero or infinite; change the noise's offset, "
                                  "contrast, exponent or floor"));
    }
  }
  for (std::size_t c = 0; c < galaxy_.components().size(); ++c) {
    std::vector<double> values;
    for (const Mean& mean : means_) {
      if (mean.component == c) values.push_back(mean.value);
    }
    if (values.empty()) continue;
    if (is_reference()) {
      calibration_.means[c] = {widest_mean, mean_ratio, values};
      continue;
    }
    const std::vector<double> widths = mean_widths(c);
    calibration_.log_narrowest[c] = static_cast<float>(log_narrowest(c));
    const bool has_more = values.size() > measured(widths).size();
    std::vector<double> table =
        for_all(widths, {values.begin() + (has_more ? 1 : 0), values.end()});
    if (has_more) table.front() = values.front();
    // The first width, which hides nothing, is one step below the narrowest width that hides
    // something.
    const double steps = static_cast<double>(widths.size()) - 1;
    const double widest = steps > 0 ? widths.back() : widest_mean;
    calibration_.means[c] = {widest * std::pow(mean_ratio, -steps), mean_ratio, table};
  }
  galaxy_.set_calibration(calibration_);
}

void GalaxyStatistics::adopt() {
  if (galaxy_.reference() == nullptr) return;
  calibration_.dust = galaxy_.reference()->calibration().dust;
  galaxy_.set_calibration(calibration_);
}

void GalaxyStatistics::measure_all() {
  if (Galaxy* reference = galaxy_.reference().get();
      reference != nullptr && !reference->calibration().closure_range.covers(footprints_)) {
    GalaxyStatistics(*reference, reference->calibration().closure_range | footprints_)
        .measure_all();
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
  if (component_at(c).absorbs() || light_ == 0) return 1;
  const double share = galaxy_.luminosity(c) / light_;
  return footprints_.sees_whole ? std::max(share, least_share_within) : share;
}

bool GalaxyStatistics::is_rough(std::size_t c) const {
  return component_at(c).absorbs() && !is_reference() && !footprints_.needs_light_means &&
         galaxy_.mean_error() > fine_mean_error;
}

std::size_t GalaxyStatistics::first_points(std::size_t c) const {
  return std::min(is_rough(c) ? first_cloud / rough_dust : first_cloud,
                  galaxy_.most_cloud_points());
}

const std::vector<BatchArray>& GalaxyStatistics::light_behind(std::size_t c) {
  static SharedValues<std::string, std::vector<BatchArray>> known;
  light_behind_.resize(galaxy_.components().size());
  if (light_behind_[c] == nullptr) {
    light_behind_[c] = known.find(light_behind_text(c), [&] {
      return std::make_shared<std::vector<BatchArray>>(light_behind_dust(galaxy_, c));
    });
  }
  return *light_behind_[c];
}

bool GalaxyStatistics::adopts_texture(std::size_t c) const {
  const Galaxy* const reference = galaxy_.reference().get();
  if (reference == nullptr || component_at(c).texture() == nullptr) return false;
  return (!footprints_.needs_light_means && component_at(c).texture()->statistics_only_scale()) ||
         reference->components()[c]->digests().texture == component_at(c).digests().texture;
}

void GalaxyStatistics::adopt_texture(std::size_t c) {
  const Galaxy& reference = *galaxy_.reference();
  const FootprintRange measured = reference.calibration().closure_range;
  if (measured.narrowest > measured.widest) {
    throw std::logic_error("a galaxy's reference must be measured first");
  }
  galaxy_.components()[c]->texture()->restore(reference.components()[c]->texture()->statistics());
  is_normalised_[c] = true;
}

void GalaxyStatistics::normalise(std::size_t c) {
  if (is_normalised_[c] || component_at(c).texture() == nullptr) return;
  if (adopts_texture(c)) return adopt_texture(c);
  // The statistics include Phi of the followed component, whose texture is normalised first.
  if (galaxy_.followed(c) >= 0) normalise(static_cast<std::size_t>(galaxy_.followed(c)));
  Component& component = *galaxy_.components()[c];
  FractalNoise::Factor factor;
  if (galaxy_.followed(c) >= 0) {
    factor = [this, c](const Points& points, float* out) {
      SeenTextures(galaxy_).phi_of_followed(c, points, out);
    };
  }
  try {
    // A texture whose mean is known from elsewhere is normalised only roughly.
    const std::size_t points = first_points(c) / (component.has_texture_mean() ? rough : 1);
    component.texture()->normalise(component.cloud(points).all(), factor);
  } catch (const InputError& error) {
    throw InputError(component.where(), "component '" + component.name() + "': " + error.what());
  }
  is_normalised_[c] = true;
}

double GalaxyStatistics::wanted_error(std::size_t c, double footprint) const {
  const bool is_whole_dust = footprint == 0 && component_at(c).absorbs();
  double error =
      is_whole_dust ? std::min(galaxy_.mean_error(), whole_dust_error) : galaxy_.mean_error();
  if (is_reference() || !footprints_.needs_light_means) error *= dust_mean_error;
  return error / std::sqrt(share(c));
}

double GalaxyStatistics::error_of_texture_mean(std::size_t c) const {
  return std::exp2(std::floor(std::log2(wanted_error(c, widest_mean))));
}

std::size_t GalaxyStatistics::points_needed(const Mean& mean, double error) const {
  const double excess = error / wanted_error(mean.component, mean.footprint);
  const auto first = static_cast<double>(first_points(mean.component));
  if (!(excess > 1) || galaxy_.most_cloud_points() <= first_points(mean.component)) return 0;
  const double needed = std::max(cloud_margin * first * excess * excess, least_larger_cloud);
  return shared_cloud_size(needed, galaxy_.most_cloud_points());
}

void GalaxyStatistics::measure_means(std::size_t c, std::span<double> numbers) const {
  std::vector<double> widths;
  for (const Mean& mean : means_) {
    if (mean.component == c) widths.push_back(mean.footprint);
  }
  NumberWriter writer(numbers);
  if (component_at(c).has_texture_mean()) {
    for (const double mean : component_at(c).texture_means(widths, error_of_texture_mean(c),
                                                           galaxy_.most_cloud_points())) {
      writer.add(mean);
      writer.add(0);
    }
    return;
  }
  const Cloud cloud = component_at(c).cloud(first_points(c));
  for (const CloudMoments& moments : moments_of(c, cloud, 0, cloud.batches, widths)) {
    const CloudMean mean = moments.mean();
    writer.add(mean.mean);
    writer.add(mean.error);
  }
}

std::vector<CloudMoments> GalaxyStatistics::moments_of(std::size_t c, const Cloud& cloud,
                                                       std::size_t first, std::size_t last,
                                                       std::span<const double> widths) const {
  std::vector<CloudMoments> parts((last - first) * widths.size());
  parallel_for(last - first, [&](std::size_t b) {
    WeightedBatch batch{};
    cloud.fill(first + b, batch);
    std::vector<BatchArray> phi(widths.size());
    SeenTextures(galaxy_).phi(c, batch.points(), widths, phi);
    for (std::size_t w = 0; w < widths.size(); ++w) {
      parts[b * widths.size() + w].add(batch, phi[w].data());
    }
  });
  std::vector<CloudMoments> result(widths.size());
  for (std::size_t k = 0; k < parts.size(); ++k) result[k % widths.size()].add(parts[k].sums());
  return result;
}

std::vector<CloudMoments> GalaxyStatistics::measure_slice(const LargerCloud& larger,
                                                          std::size_t slice) const {
  const Cloud cloud = component_at(larger.component).cloud(larger.points);
  const auto begin = [&](std::size_t k) { return cloud.batches * k / larger.slices; };
  return moments_of(larger.component, cloud, begin(slice), begin(slice + 1), footprints_of(larger));
}

std::vector<double> GalaxyStatistics::footprints_of(const LargerCloud& larger) const {
  std::vector<double> result;
  for (const std::size_t m : larger.means) result.push_back(means_[m].footprint);
  return result;
}

bool GalaxyStatistics::hides(std::size_t c, double footprint) const {
  const int followed = galaxy_.followed(c);
  return component_at(c).hides_texture(footprint) ||
         (followed >= 0 &&
          component_at(static_cast<std::size_t>(followed)).hides_texture(footprint));
}

double GalaxyStatistics::log_narrowest(std::size_t c) const {
  double narrow = std::log(double{smallest_footprint}), wide = std::log(widest_mean);
  // Margin for rounding to single precision.
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
  std::ranges::reverse(widths);
  return widths;
}

std::vector<double> GalaxyStatistics::mean_widths(std::size_t c) const {
  std::vector<double> result = widths(c, widest_mean, mean_ratio);
  result.insert(result.begin(), 0.0);
  return result;
}

std::vector<double> GalaxyStatistics::dust_widths(std::size_t c) const {
  return widths(c, largest_closure_footprint, closure_footprint_ratio);
}

std::span<const double> GalaxyStatistics::measured(const std::vector<double>& widths) const {
  if (widths.empty()) return {};
  // Margin for rounding to single precision.
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

double GalaxyStatistics::largest_phi(std::size_t c, const StarField& field) const {
  if (field.has_texture_mean()) return 1;  // Galaxy::largest_phi() needs no sample
  // The places are uniform in area and in height, so that the layer's faint edges are included.
  const LayerShape& shape = field.shape();
  float largest = 0;
  BatchArray x, y, z, density, envelope;
  EvaluationCounts counts;
  SampleBatch batch;
  for (std::size_t first = 0; first < peak_places; first += batch_capacity) {
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      double u[3];
      R3Sequence().point(first + i, u);
      const double r = std::min(1.0, field.law().limit(-bright_lengths)) * std::sqrt(u[0]);
      const double angle = 2 * std::numbers::pi * u[1];
      x[i] = static_cast<float>(r * std::cos(angle));
      y[i] = static_cast<float>(r * std::sin(angle));
      z[i] = static_cast<float>(bright_heights * shape.z0 * (2 * u[2] - 1) +
                                shape.warp.lift(double{x[i]}, double{y[i]}));
    }
    const Points points{x.data(), y.data(), z.data(), batch_capacity};
    galaxy_.evaluate_component(c, points, 0, density, counts, false);
    galaxy_.fill_batch(points, false, batch);
    field.envelope(batch, envelope.data());
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      if (envelope[i] > 0) largest = std::max(largest, density[i] / envelope[i]);
    }
  }
  return double{largest};
}

}  // namespace gamer
