#include "galaxy/calibration/dust_closure.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "galaxy/calibration/seen_textures.h"
#include "gamer/core/parallel_for.h"
#include "gamer/galaxy/calibration/dust_variants.h"

namespace gamer {
namespace {

// Number of rays on which the transmission of dust is measured.
constexpr std::size_t coherence_rays = std::size_t{1} << 12;
// Where clouds have at most coarse_points points, coarse_rays rays suffice.
constexpr std::size_t coarse_points = std::size_t{1} << 13;
constexpr std::size_t coarse_rays = std::size_t{1} << 11;
// Number of points on a face-on ray.
constexpr double coherence_heights = 10;
// Heights at which the light behind the dust is added up, and the ratio of successive heights.
constexpr double lowest_light = 2e-3;
constexpr double light_ratio = 1.5;
constexpr double least_coherence = 0.05;
constexpr double largest_coherence = 4;
constexpr double first_factor = 1.3;
constexpr int secants = 5;
// Relative error of the transmitted light below which no further secant step is needed.
constexpr double light_error = 1e-3;

/// The mean if it is positive and finite. Few points may miss the component.
double proper_mean(double mean) { return mean > 0 && std::isfinite(mean) ? mean : 1; }

/// Rays through a layer of dust, with the texture as seen by each width.
struct DustRays {
  const Texture* texture;  ///< may be null
  std::size_t width_count, heights;
  std::vector<WeightedBatch>
      columns;  ///< places where rays meet the plane, weighted with their area
  std::span<const BatchArray> brightness;  ///< brightness of light at these places
  /// Octaves at every point, [(batch * heights + height) * width_count + width], and the factor
  /// that turns Phi into a depth.
  std::unique_ptr<SeenNoise[]> seen;
  std::unique_ptr<BatchArray[]> weights;

  /// Depths along the rays, by variants: [variant * batches + b].
  std::vector<BatchArray> depths(std::size_t width, double coherence,
                                 std::span<const double> deviations) const;
  /// Mean of `term`(depth) over rays and variants. Rays are weighted with their area and, if
  /// `by_light`, also with the light where they meet the plane.
  template <class Term>
  double mean(const std::vector<BatchArray>& values, bool by_light, Term&& term) const;
  double amount(const std::vector<BatchArray>& values) const {
    return mean(values, false, [](double depth) { return depth; });
  }
  /// The light transmitted by dust of `factor` times the density.
  double light(const std::vector<BatchArray>& values, double factor) const {
    return mean(values, true, [&](double depth) { return std::exp(-factor * depth); });
  }
};

std::vector<BatchArray> DustRays::depths(std::size_t width, double coherence,
                                         std::span<const double> deviations) const {
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
      if (texture != nullptr) texture->expect(size, seen[at], coherence_of.data(), deviations, phi);
      for (std::size_t v = 0; v < variants; ++v) {
        BatchArray& column = result[v * batches + b];
        for (std::size_t i = 0; i < size; ++i) column[i] += weights[at][i] * phi[v][i];
      }
    }
  });
  return result;
}

template <class Term>
double DustRays::mean(const std::vector<BatchArray>& values, bool by_light, Term&& term) const {
  const std::size_t batches = columns.size(), variants = values.size() / batches;
  struct Sums {
    double weight = 0, term = 0;
  };
  std::vector<Sums> parts(batches);
  parallel_for(batches, [&](std::size_t b) {
    for (std::size_t v = 0; v < variants; ++v) {
      const double share = variants > 1 ? dust_variant_weights[v] : 1.0;
      const BatchArray& column = values[v * batches + b];
      for (std::size_t i = 0; i < columns[b].size; ++i) {
        const double weight =
            share * double{columns[b].weight[i]} * (by_light ? double{brightness[b][i]} : 1.0);
        parts[b].weight += weight;
        parts[b].term += weight * term(double{column[i]});
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

/// Adds up the light behind places in the plane of a galaxy seen face-on: half of each component's
/// column. A coarse measurement takes light that follows the dust of component c instead.
void add_light(const Galaxy& galaxy, std::size_t c, WeightedBatch& at, BatchArray& light) {
  const Component* const dust = galaxy.components()[c].get();
  const bool is_coarse = is_coarse_closure(galaxy);
  SampleBatch batch{};
  BatchArray envelope;
  std::fill_n(light.data(), batch_capacity, 0.0f);
  // The trapezoidal rule in ln z; the first interval begins in the plane.
  for (double z = lowest_light; z < 1; z *= light_ratio) {
    std::fill_n(at.z.data(), batch_capacity, static_cast<float>(z));
    galaxy.add_lift(c, at.points(), 1, at.z.data());
    galaxy.fill_batch(at.points(), false, batch);
    const bool is_first = z == lowest_light;
    const double step = z * std::log(light_ratio) * (is_first ? 0.5 : 1) + (is_first ? z : 0);
    for (const auto& component : galaxy.components()) {
      if (is_coarse ? component.get() != dust : component->absorbs()) continue;
      component->envelope(batch, envelope.data());
      const auto weight = static_cast<float>(step * std::as_const(*component).amplitude());
      for (std::size_t i = 0; i < at.size; ++i) light[i] += weight * envelope[i];
    }
  }
  std::fill_n(at.z.data(), batch_capacity, 0.0f);
}

/// Directions in the plane that are spread evenly over all azimuths.
struct Directions {
  BatchArray x, y;
  Directions() {
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double angle = 2 * std::numbers::pi * std::numbers::phi * static_cast<double>(i);
      x[i] = static_cast<float>(std::cos(angle));
      y[i] = static_cast<float>(std::sin(angle));
    }
  }
};

/// Multiplies an envelope at places with the step of a ray there. Places without dust move to the
/// centre, since arms may have no winding outside the galaxy.
void to_steps(float step, const Points& points, BatchArray& envelope, BatchArray& x, BatchArray& y,
              BatchArray& z) {
  for (std::size_t i = 0; i < points.size; ++i) {
    if (envelope[i] > 0) {
      envelope[i] *= step;
    } else {
      envelope[i] = x[i] = y[i] = z[i] = 0;
    }
  }
}

std::size_t number_of_rays(const Galaxy& galaxy) {
  return is_coarse_closure(galaxy) ? coarse_rays : coherence_rays;
}

DustRays trace_dust(const Galaxy& galaxy, std::size_t c, double path,
                    std::span<const double> widths, std::span<const BatchArray> light) {
  const Component& dust = *galaxy.components()[c];
  const SeenTextures textures(galaxy);
  const Texture* texture = dust.texture();
  const auto heights = static_cast<std::size_t>(std::round(coherence_heights * std::sqrt(path)));
  ColumnCloud cloud = dust.columns(number_of_rays(galaxy), heights);
  const std::size_t batches = cloud.columns.size();
  const std::size_t places = batches * heights;
  DustRays result{
      texture,
      widths.size(),
      heights,
      {},
      light,
      std::make_unique_for_overwrite<SeenNoise[]>(texture != nullptr ? places * widths.size() : 0),
      std::make_unique_for_overwrite<BatchArray[]>(places * widths.size())};
  const auto slope = static_cast<float>(std::sqrt(path * path - 1));
  const Directions to;
  const double mean = galaxy.calibration().means[c].narrowest();
  const double scale = dust.amplitude() * galaxy.axis()[2] * path / mean;
  parallel_for(places, [&](std::size_t place) {
    const WeightedBatch& at = cloud.columns[place / heights];
    const std::size_t k = place % heights;
    const float away = slope * cloud.heights[k];
    BatchArray x, y, z, shear;
    for (std::size_t i = 0; i < padded(at.size); ++i) {
      x[i] = at.x[i] + away * to.x[i];
      y[i] = at.y[i] + away * to.y[i];
    }
    std::fill_n(z.data(), batch_capacity, cloud.heights[k]);
    const Points points{x.data(), y.data(), z.data(), at.size};
    BatchArray lifted = z;
    galaxy.add_lift(c, points, 1, lifted.data());
    SampleBatch batch;
    galaxy.fill_batch({x.data(), y.data(), lifted.data(), at.size}, false, batch);
    BatchArray envelope;
    dust.envelope(batch, envelope.data());
    to_steps(static_cast<float>(scale) * cloud.steps[k], points, envelope, x, y, z);
    const std::span own(result.weights.get() + place * widths.size(), widths.size());
    std::ranges::fill(own, envelope);
    textures.fill_shear(points, shear);
    BatchArray turned_x, turned_y, turned_z;
    const Points turned = texture != nullptr ? galaxy.turn_back(points, texture->twirl(), turned_x,
                                                                turned_y, turned_z)
                                             : points;
    textures.multiply_followed(c, turned, shear, widths, own);
    if (texture == nullptr) return;
    SeenTextures::see(dust, turned, shear, widths, true,
                      {result.seen.get() + place * widths.size(), widths.size()});
  });
  result.columns = std::move(cloud.columns);
  return result;
}

}  // namespace

bool is_coarse_closure(const Galaxy& galaxy) { return galaxy.most_cloud_points() <= coarse_points; }

std::vector<BatchArray> light_behind_dust(const Galaxy& galaxy, std::size_t c) {
  constexpr std::size_t heights = 1;
  ColumnCloud cloud = galaxy.components()[c]->columns(number_of_rays(galaxy), heights);
  std::vector<BatchArray> light(cloud.columns.size());
  parallel_for(light.size(),
               [&](std::size_t b) { add_light(galaxy, c, cloud.columns[b], light[b]); });
  return light;
}

DustClosureValues measure_dust_closure(const Galaxy& galaxy, std::size_t c, std::size_t obliquity,
                                       std::span<const double> widths,
                                       std::span<const BatchArray> light) {
  DustClosureValues result;
  if (widths.empty()) return result;
  std::vector<double> with_all(widths.begin(), widths.end());
  with_all.push_back(0);
  const DustRays traced =
      trace_dust(galaxy, c, DustClosure::obliquities[obliquity], with_all, light);
  const std::vector<BatchArray> all = traced.depths(widths.size(), 1, {});
  const double whole = traced.amount(all), wanted = traced.light(all, 1);
  if (!(whole > 0) || !std::isfinite(whole) || !std::isfinite(wanted)) return result;
  /// The excess of transmitted light for a coherence, and the amount of dust.
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
    // Secant steps. The transmitted light grows with the variance.
    double guess = 1, slope = 0;
    Passed last = pass(guess);
    for (int step = 0; step < secants && std::abs(last.excess) > light_error * wanted; ++step) {
      if (slope > 0) {
        guess = last.coherence - last.excess / slope;
      } else {
        guess = last.excess > 0 ? 0.0 : largest_coherence;
      }
      // The first step is short, to find a slope.
      if (step == 0) {
        guess = std::clamp(guess, last.coherence / first_factor, last.coherence * first_factor);
      }
      const Passed next = pass(std::clamp(guess, least_coherence, largest_coherence));
      const double distance = next.coherence - last.coherence;
      if (!((next.excess - last.excess) * distance > 0)) break;
      slope = (next.excess - last.excess) / distance;
      last = next;
    }
    result.coherences.push_back(last.coherence);
    result.amounts.push_back(last.amount);
  }
  return result;
}

}  // namespace gamer
