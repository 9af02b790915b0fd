#include "galaxy/associations/association_texture.h"

#include <algorithm>
#include <bit>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <numeric>

#include "galaxy/running_sums.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/random.h"
#include "gamer/noise/footprint.h"

namespace gamer {
namespace {

using std::numbers::pi;

// Largest ratio of diameters within a tier.
constexpr double tier_ratio = 2;

// Two frequencies of a tier, times the largest radius of its clumps. The first one decides which
// share of the tier rays resolve. The second one is the frequency of the sharpest features.
constexpr double seen_frequency = 2.2;
constexpr double sharp_frequency = 1.0;

// Nodes are denser by up to this factor where clumps of the last tier have radii above
// refined_footprints footprints. Without denser nodes, images of a tier's small clumps, in which
// fewer nodes lie, would have gaps.
constexpr double most_refinement = 2.5;
constexpr double refined_footprints = 4;

// An oblique ray passes more clumps than a ray along the axis, and its nodes miss a clump more
// often. The nodes are therefore denser by at least 1 + oblique_growth (1 - cosine)^2, up to
// most_oblique.
constexpr double oblique_growth = 6;
constexpr double most_oblique = 2;

// Share of the ages over which clumps fade beyond the range of ages.
constexpr double age_fade = 0.2;
// Growth of a cavity's depth with the age, relative to its largest depth over the whole range.
constexpr double cavity_growth = 1.5;

// Wavelength of the first octave, in sizes of complexes. Wavelength of the last octave that decides
// which cells of a tier are occupied, in diameters of its largest clump.
constexpr double complex_wavelength = 2;
constexpr double shortest_wavelength = 4;
// Clumps lie at the heights next to the plane that hold this share of the layer's light. Clumps
// farther out would be few and, relative to the envelope, very bright.
constexpr double layer_share = 0.96;

// Offsets of lattices, cells.
constexpr double largest_shift = 16;

// A cloud whose few points all lie between clumps is no error, and needs no message.
// AssociationTexture's mean over all seeds, 1, then counts until association_means() gives the mean
// of the seed.
constexpr const char* no_message = nullptr;

/// The integral of x^power over [least, most].
double power_integral(double power, double least, double most) {
  if (std::abs(power + 1) < 1e-9) return std::log(most / least);
  return (std::pow(most, power + 1) - std::pow(least, power + 1)) / (power + 1);
}

/// The x below which the share u of the integral of x^power over [least, most] lies.
double power_quantile(double power, double least, double most, double u) {
  if (std::abs(power + 1) < 1e-9) return least * std::pow(most / least, u);
  const double low = std::pow(least, power + 1), high = std::pow(most, power + 1);
  return std::pow(low + u * (high - low), 1 / (power + 1));
}

/// The one copy of a density, which all textures with equal densities share.
std::shared_ptr<const SurfaceDensity> one_copy(SurfaceDensity density) {
  static std::mutex mutex;
  static std::map<std::uint64_t, std::weak_ptr<const SurfaceDensity>> copies;
  std::uint64_t hash = static_cast<std::uint64_t>(density.points);
  for (const float value : density.values) {
    hash = mix64(hash ^ std::bit_cast<std::uint32_t>(value)) + golden_gamma;
  }
  const std::lock_guard lock(mutex);
  std::erase_if(copies, [](const auto& copy) { return copy.second.expired(); });
  std::weak_ptr<const SurfaceDensity>& known = copies[hash];
  if (auto copy = known.lock(); copy != nullptr && copy->values == density.values) return copy;
  auto copy = std::make_shared<const SurfaceDensity>(std::move(density));
  known = copy;
  return copy;
}

/// The integral of the interpolated density.
double integral_of(const SurfaceDensity& density) {
  const auto points = static_cast<std::size_t>(density.points);
  const auto weight = [&](std::size_t k) { return k == 0 || k + 1 == points ? 0.5 : 1.0; };
  double sum = 0;
  for (std::size_t k = 0; k < density.values.size(); ++k) {
    sum += weight(k % points) * weight(k / points) * double{density.values[k]};
  }
  const double step = 2.0 / (density.points - 1);
  return sum * step * step;
}

/// The density of q^3 (1 - cavity Q^2) in t = z/R, normalised. With Q = s + t^2 slices of q^3 Q^2
/// are pi s^3 (s + t^2)^2 ds.
double light_at_height(double t, double cavity) {
  const double rest = std::max(1 - t * t, 0.0), t2 = t * t;
  const double fourth = rest * rest * rest * rest;
  const double hole = fourth * (rest * rest / 6 + 2 * t2 * rest / 5 + t2 * t2 / 4);
  return pi * (fourth / 4 - cavity * hole) / (halo_volume - cavity * cavity_volume);
}

/// sech^2(z/z0) convolved with the vertical profile of a halo of this radius and cavity, for |z|
/// below radius + 20 z0.
double seen_layer(double z, double radius, double cavity, double z0) {
  using Rule = boost::math::quadrature::gauss<double, 20>;
  constexpr double farthest = 20;  // in units of z0; sech^2 is below 2e-17 beyond
  const double begin = std::max(-1.0, (-farthest * z0 - z) / radius);
  const double end = std::min(1.0, (farthest * z0 - z) / radius);
  // Pieces of at most 2 z0, for which the rule is exact to rounding.
  const int pieces = static_cast<int>(std::ceil(0.5 * (end - begin) * radius / z0));
  const double length = (end - begin) / pieces;
  double sum = 0;
  for (int k = 0; k < pieces; ++k) {
    sum += Rule::integrate(
        [&](double t) {
          const double cosh = std::cosh((z + radius * t) / z0);
          return light_at_height(t, cavity) / (cosh * cosh);
        },
        begin + k * length, begin + (k + 1) * length);
  }
  return sum;
}

/// The heights of cores of radius 1 in an infinitely thin layer.
const std::vector<double>& unit_heights() {
  static const std::vector<double> heights = [] {
    constexpr int steps = 1 << 14;
    const std::vector<double> below =
        running_sums(steps, [](double x) { return light_at_height(2 * x - 1, 0); });
    std::vector<double> result;
    for (std::size_t k = 0; k < clump_count; ++k) {
      double u[3];
      R3Sequence().point(k, u);
      result.push_back(2 * place_of_sum(below, u[1] * below.back()) - 1);
    }
    return result;
  }();
  return heights;
}

BoundTable association_keys(AssociationParameters& p) {
  return {
      {p.number, "number", "", Interval::closed(1, 1e6).usual_logarithmic(10, 100000.0),
       "mean number of clumps; where their cells are full, clumps are brighter instead"},
      {p.luminosity_slope, "luminosity_slope", "", Interval::closed(1, 4),
       "a: luminosities L of clumps have dN/dL ~ L^-a"},
      {p.luminosity_range, "luminosity_range", "",
       Interval::closed(1, 1e5).usual_logarithmic(1, 100000.0),
       "ratio of the largest to the smallest L"},
      {p.size_exponent, "size_exponent", "", Interval::closed(2, 10),
       "b: diameters D of clumps have L ~ D^b"},
      {p.largest, "largest", "galaxy radii",
       Interval::closed(1e-4, 0.5).usual_logarithmic(0.002, 0.2),
       "largest extent D of the brightest clumps"},
      {p.complex_size, "complex_size", "galaxy radii",
       Interval::closed(1e-4, 1).usual_logarithmic(0.005, 0.5),
       "size of the largest complexes; smaller ones follow in steps of 2"},
      {p.clustering, "clustering", "", Interval::closed(0, 1.5),
       "contrast of each step of complexes; 0 spreads clumps at random"},
      {p.diffuse, "diffuse", "", Interval::closed(0, 0.95),
       "share of the light that is spread over the complexes, outside clumps"},
      {p.filling, "filling", "", Interval::closed(0.1, 1),
       "extent of clumps relative to D: less than 1 for stars within clouds of gas"},
      {p.size_scatter, "size_scatter", "", Interval::closed(0, 0.8),
       "clumps of one luminosity have extents from 1 - size_scatter to 1, relative to the largest"},
      {p.irregularity, "irregularity", "", Interval::closed(0, 1),
       "how far clumps are bent; 0 leaves round ones"},
      {p.cores, "cores", "", Interval::closed(0, 1),
       "share of the light in two cores of a clump, if it is young"},
      {p.cavity, "cavity", "", Interval::closed(0, 0.98),
       "depth of the cavity of large clumps, if they are old"},
      {p.age, "age", "", Interval::closed(0, 1),
       "share of the clumps younger than those shown; components of equal seed, number, largest, "
       "luminosities and complexes have clumps at the same places"},
      {p.age_range, "age_range", "", Interval::closed(0, 1),
       "share of the clumps of the ages shown; older and younger ones fade over 0.2 more"},
      without_default({p.seed, "seed", "", Interval::closed(0, largest_seed),
                       "seed of this component's clumps; default: from the galaxy's seed and "
                       "the component's name"})};
}

}  // namespace

ParameterTable AssociationParameters::table() const {
  return declarations(association_keys, *this);
}

void AssociationParameters::apply(const ParameterSet& values) {
  put_values(values, association_keys(*this));
}

AssociationTexture::AssociationTexture(const AssociationParameters& parameters,
                                       SurfaceDensity density, double z0)
    : ScaledTexture(no_message), parameters_(parameters), z0_(z0) {
  const double total = integral_of(density);
  for (float& value : density.values) value = static_cast<float>(double{value} / total);
  density_ = one_copy(std::move(density));
  const double sizes = std::pow(parameters.luminosity_range, 1 / parameters.size_exponent);
  const int count =
      std::max(static_cast<int>(std::ceil(std::log(sizes) / std::log(tier_ratio) - 1e-9)), 1);
  for (int tier = 0; tier < count; ++tier) {
    const double most = std::pow(parameters.luminosity_range, -static_cast<double>(tier) / count);
    const double least =
        std::pow(parameters.luminosity_range, -static_cast<double>(tier + 1) / count);
    add_tier(least, most);
  }
  place_lattices();
  add_octaves();
}

AssociationTexture::AssociationTexture(const AssociationTexture& twin, std::uint64_t seed)
    : ScaledTexture(no_message),
      parameters_(twin.parameters_),
      density_(twin.density_),
      z0_(twin.z0_),
      tiers_(twin.tiers_) {
  parameters_.seed = seed;
  place_lattices();
  add_octaves();
}

std::unique_ptr<AssociationTexture> AssociationTexture::of_clumps(const AssociationTexture& whole) {
  auto clumps = std::make_unique<AssociationTexture>(whole, whole.parameters_.seed);
  const auto share = static_cast<float>(1 - whole.parameters_.diffuse);
  clumps->parameters_.diffuse = 0;
  for (ClumpTier& tier : clumps->tiers_) tier.share /= share;
  return clumps;
}

void AssociationTexture::place_lattices() {
  for (std::size_t index = 0; index < tiers_.size(); ++index) {
    ClumpTier& tier = tiers_[index];
    const auto word = [&](std::uint64_t purpose) {
      return hash_words({parameters_.seed, static_cast<std::uint64_t>(index), purpose, 1});
    };
    const double angle = 2 * pi * to_unit(word(0));
    tier.cosine = static_cast<float>(std::cos(angle) / tier.side);
    tier.sine = static_cast<float>(std::sin(angle) / tier.side);
    tier.offset_x = static_cast<float>(largest_shift * to_unit(word(1)));
    tier.offset_y = static_cast<float>(largest_shift * to_unit(word(2)));
    tier.seed = static_cast<std::uint32_t>(word(3));
  }
}

void AssociationTexture::add_tier(double least, double most) {
  const AssociationParameters& p = parameters_;
  const double slope = p.luminosity_slope;
  const double faintest = 1 / p.luminosity_range;
  ClumpTier tier;
  const double cell = p.largest * std::pow(most, 1 / p.size_exponent);
  tier.side = cell;
  tier.cell = static_cast<float>(cell);
  const bool is_single = p.luminosity_range == 1;
  const double number_share =
      is_single ? 1 : power_integral(-slope, least, most) / power_integral(-slope, faintest, 1);
  const double light_share =
      is_single ? 1
                : power_integral(1 - slope, least, most) / power_integral(1 - slope, faintest, 1);
  tier.occupancy = static_cast<float>(p.number * number_share * cell * cell);
  tier.share = static_cast<float>((1 - p.diffuse) * light_share);
  const double extent = p.filling / clump_reach(p.irregularity);
  tier.frequency = static_cast<float>(2 * seen_frequency / (cell * extent));
  tier.bends = static_cast<float>(p.irregularity);
  const double end = p.age + p.age_range;
  const auto numbers = [](std::size_t k) {
    std::array<double, 3> u{};
    R3Sequence().point(k, u.data());
    return u;
  };
  const auto shown = [&](double age) {
    return std::clamp(1 + (age - p.age) / age_fade, 0.0, 1.0) *
           std::clamp(1 + (end - age) / age_fade, 0.0, 1.0);
  };
  std::vector<double> luminosity(clump_count), light(clump_count);
  for (std::size_t k = 0; k < clump_count; ++k) {
    const double u = (static_cast<double>(k) + 0.5) / clump_count;
    luminosity[k] = is_single ? 1 : power_quantile(-slope, least, most, u);
    light[k] = luminosity[k] * shown(numbers(k)[2]);
  }
  const double mean = std::accumulate(light.begin(), light.end(), 0.0) / clump_count;
  for (std::size_t k = 0; k < clump_count; ++k) {
    const std::array<double, 3> u = numbers(k);
    const double size = std::pow(luminosity[k], 1 / p.size_exponent);
    const double smaller = to_unit(k * golden_gamma);  // fills [0, 1[ evenly
    const double radius = 0.5 * p.largest * size * extent * (1 - p.size_scatter * smaller);
    const double age = p.age_range > 0 ? std::clamp((u[2] - p.age) / p.age_range, 0.0, 1.0) : 0;
    const double cavity = p.cavity * std::min(cavity_growth * age, 1.0) * std::sqrt(size);
    const double share = p.cores * (1 - age);
    const double z = z0_ * std::atanh(layer_share * (2 * u[0] - 1)) +
                     double{core_radius} * radius * unit_heights()[k];
    // The amplitude H or C with which this part of the clump emits its share of the light.
    const auto height = [&](double part, double volume, double size_of_part, double depth) {
      return static_cast<float>(
          part * light[k] / mean * cell * cell * 2 * z0_ /
          (volume * radius * radius * radius * seen_layer(z, size_of_part, depth, z0_)));
    };
    tier.height.push_back(static_cast<float>(z));
    tier.inverse_radius.push_back(static_cast<float>(1 / radius));
    tier.cavity.push_back(static_cast<float>(cavity));
    tier.halo.push_back(height(1 - share, halo_volume - cavity * cavity_volume, radius, cavity));
    tier.cores.push_back(height(share, cores_volume, double{core_radius} * radius, 0));
  }
  tiers_.push_back(std::move(tier));
}

void AssociationTexture::add_octaves() {
  const AssociationParameters& p = parameters_;
  before_.assign(tiers_.size(), 0);
  if (p.clustering == 0) return;
  contrast_ = static_cast<float>(p.clustering / std::sqrt(p.kind->variance()));
  const double smallest = p.largest * std::pow(p.luminosity_range, -1 / p.size_exponent);
  double wavelength = complex_wavelength * p.complex_size;
  do {
    const auto index = static_cast<std::uint64_t>(octaves_.size());
    Octave octave;
    octave.frequency = static_cast<float>(1 / wavelength);
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      octave.offset[axis] =
          static_cast<float>(largest_shift * to_unit(hash_words({p.seed, index, axis, 2})));
    }
    octave.seed = static_cast<std::uint32_t>(hash_words({p.seed, index, 3, 2}));
    octaves_.push_back(octave);
    for (std::size_t l = 0; l < tiers_.size(); ++l) {
      if (wavelength >= shortest_wavelength * double{tiers_[l].cell}) before_[l] = octaves_.size();
    }
    wavelength /= 2;
  } while (octaves_.size() < most_octaves && wavelength >= smallest);
}

bool AssociationTexture::hides(double footprint) const {
  double finest{tiers_.back().frequency};
  if (!octaves_.empty()) finest = std::max(finest, double{octaves_.back().frequency});
  return footprint * finest > fade_begin;
}

double AssociationTexture::frequency() const {
  double finest = sharp_frequency / seen_frequency * double{tiers_.back().frequency};
  if (!octaves_.empty()) finest = std::max(finest, double{octaves_.back().frequency});
  return finest;
}

double AssociationTexture::refinement(double footprint, double cosine) const {
  const double radius = seen_frequency / double{tiers_.back().frequency};
  if (!(footprint > 0)) return most_refinement;
  const double rest = 1 - cosine;
  const double oblique = std::min(1 + oblique_growth * rest * rest, most_oblique);
  return std::clamp(radius / (refined_footprints * footprint), oblique, most_refinement);
}

void AssociationTexture::look(const Points& points, std::span<const float* const> footprints,
                              std::span<float* const> out, std::span<float* const> of_clumps,
                              std::uint64_t& evaluations) const {
  OctaveArrays noise, products;
  fill_octaves(points, noise);
  BatchArray sum;
  evaluations += points.size * (octaves_.size() + tiers_.size() * footprints.size());
  for (std::size_t v = 0; v < footprints.size(); ++v) {
    multiply_octaves(points.size, noise, footprints[v], products);
    std::fill_n(sum.data(), padded(points.size), 0.0f);
    for (std::size_t l = 0; l < tiers_.size(); ++l) {
      add_clumps(points, tiers_[l], *density_, products[before_[l]].data(), footprints[v],
                 sum.data());
    }
    const float* const product = products[octaves_.size()].data();
    fill_light(points.size, sum.data(), product, out[v]);
    if (of_clumps.empty()) continue;
    const auto share = static_cast<float>(1 - parameters_.diffuse);
    for (std::size_t i = 0; i < padded(points.size); ++i) sum[i] /= share;
    fill_light(points.size, sum.data(), product, of_clumps[v]);
  }
}

void AssociationTexture::evaluate_with(const AssociationTexture& clumps, const Points& points,
                                       const float* footprints, BatchArray& whole,
                                       BatchArray& of_clumps, std::uint64_t& evaluations) const {
  const std::array<float, 2> scales = {static_cast<float>(scale()),
                                       static_cast<float>(clumps.scale())};
  const std::array<float*, 2> out = {whole.data(), of_clumps.data()};
  const auto look_with = [&](const float* widths, const std::array<float*, 2>& to) {
    look(points, std::span(&widths, 1), std::span(to.data(), 1), std::span(to.data() + 1, 1),
         evaluations);
    for (std::size_t k = 0; k < to.size(); ++k) {
      for (std::size_t i = 0; i < points.size; ++i) to[k][i] *= scales[k];
    }
  };
  const auto [least, most] =
      footprints != nullptr ? range_of(footprints, points.size) : Range{0, 0};
  if (!hides(double{most})) return look_with(nullptr, out);
  look_with(footprints, out);
  if (hides(double{least})) return;
  std::array<BatchArray, 2> resolved;
  look_with(nullptr, {resolved[0].data(), resolved[1].data()});
  for (std::size_t i = 0; i < points.size; ++i) {
    if (hides(double{footprints[i]})) continue;
    for (std::size_t k = 0; k < out.size(); ++k) out[k][i] = resolved[k][i];
  }
}

void AssociationTexture::fill_octaves(const Points& points, OctaveArrays& noise) const {
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    parameters_.kind->sum(points, std::span(&octaves_[k], 1), noise[k].data());
  }
}

void AssociationTexture::multiply_octaves(std::size_t size, const OctaveArrays& noise,
                                          const float* footprints, OctaveArrays& products) const {
  std::fill_n(products[0].data(), padded(size), 1.0f);
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    multiply_octave(size, noise[k].data(), contrast_, octaves_[k].frequency, footprints,
                    products[k].data(), products[k + 1].data());
  }
}

void AssociationTexture::evaluate_whole(const Points& points, BatchArray& out,
                                        std::uint64_t& evaluations) const {
  const float* const none = nullptr;
  BatchArray light;
  float* const to = light.data();
  look(points, std::span(&none, 1), std::span(&to, 1), {}, evaluations);
  for (std::size_t i = 0; i < points.size; ++i) out[i] = light[i] * static_cast<float>(scale());
}

void AssociationTexture::see(const Points& points, std::span<const float* const> footprints,
                             bool /*wants_coherent*/, std::span<SeenNoise> out,
                             std::uint64_t& evaluations) const {
  std::vector<float*> sums;
  for (SeenNoise& seen : out) sums.push_back(seen.sum.data());
  look(points, footprints, sums, {}, evaluations);
}

void AssociationTexture::expect(std::size_t size, const SeenNoise& seen, const float* /*coherence*/,
                                std::span<const double> /*deviations*/,
                                std::span<BatchArray> out) const {
  for (BatchArray& values : out) {
    for (std::size_t i = 0; i < size; ++i) values[i] = seen.sum[i] * static_cast<float>(scale());
  }
}

}  // namespace gamer
