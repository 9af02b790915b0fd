#include "galaxy/associations/association_mean.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "galaxy/associations/association_clumps.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/noise/footprint.h"

namespace gamer {
namespace {

// Number of points of the first cloud for the mean of the octaves, and the margin on the number
// that the wanted error requires.
constexpr std::size_t first_points = std::size_t{1} << 13;
constexpr double points_margin = 1.5;
// Largest chance error of a tier that counts by its mean, relative to the wanted error. Clumps
// differ in their light and in M. Their chance error is therefore `clump_spread` times the chance
// error of equal clumps.
constexpr double tier_error = 0.3;
constexpr double clump_spread = 2;
// Largest number of cells of a tier whose clumps are looked for. Tiers of more cells, whose clumps
// are below 1/4096 of the galaxy's diameter, count by their mean.
constexpr double most_cells = 1 << 24;
// Number of pairs of points in a round: two pairs are in the halo and one is in each core.
constexpr std::size_t pairs_of_parts = 4;
// Fewest and most points of a clump.
constexpr std::size_t fewest_points = 16;
constexpr std::size_t most_clump_points = 256;
// A clump is kept if its random number is below this factor times the occupancy at its centre. The
// factor is a margin, since the octaves vary across a clump.
constexpr double occupancy_margin = 4;
// Number of clumps whose sums are held at one time.
constexpr std::size_t clumps_at_a_time = std::size_t{1} << 13;

/// A place in a clump of radius 1, with the light about it.
struct Offset : ClumpPlace {
  double light;
};

/// `count` places that follow q^3, in pairs on opposite sides. Each has an equal share of the
/// light.
std::vector<Offset> profile_points(std::size_t count) {
  std::vector<Offset> points;
  for (std::size_t k = 0; k < count / 2; ++k) {
    std::array<double, 3> u{};
    R3Sequence().point(k, u.data());
    const ClumpPlace point = place_in_ball(u);
    points.push_back({point, halo_volume});
    points.push_back({{-point.x, -point.y, -point.z}, halo_volume});
  }
  return points;
}

/// Point n of a clump, in radii of the clump along the lattice's axes. Two of four pairs of points
/// are in the halo and one is in each core. A point's light is therefore multiplied by 2 or 4.
Offset place_in_clump(const ClumpTier& tier, const AssociationClump& clump, std::size_t n,
                      Offset at) {
  const ClumpShape& shape = clump.shape;
  const std::size_t part = n / 2 % pairs_of_parts;
  if (part < 2) {
    at.light *= 2 * double{tier.halo[clump.model]} * halo_share(tier, clump, at);
  } else {
    constexpr double radius{core_radius};
    const double height = part == 2 ? 1 : double{second_core};
    at.light *= 4 * height * double{tier.cores[clump.model]} * radius * radius * radius;
    at.x = radius * at.x + double{part == 2 ? shape.core[0] : -shape.core[1]};
    at.y = radius * at.y + double{part == 2 ? shape.core[1] : shape.core[0]};
    at.z *= radius;
  }
  static_cast<ClumpPlace&>(at) = bent_place(tier, clump, at);
  return at;
}

using OctaveArrays = AssociationTexture::OctaveArrays;

/// The means for rays of several footprints. Clumps, noise and density do not depend on the
/// footprint, and are computed once. The mean for a footprint does not depend on the others.
class Means {
 public:
  Means(const AssociationTexture& texture, const Layer& layer, std::span<const double> widths,
        double error, std::size_t most_points)
      : texture_(texture),
        layer_(layer),
        widths_(widths.begin(), widths.end()),
        error_(error),
        most_points_(most_points),
        footprints_(widths.size()) {
    for (std::size_t w = 0; w < widths_.size(); ++w) {
      widths_[w] *= layer.footprint_scale();
      std::fill_n(footprints_[w].data(), batch_capacity, static_cast<float>(widths_[w]));
    }
  }

  std::vector<double> values() const {
    const std::vector<double> octaves = means_of_octaves();
    std::vector<double> result = octaves;
    for (std::size_t l = 0; l < texture_.tiers().size(); ++l) {
      std::vector<std::size_t> points(widths_.size());
      for (std::size_t w = 0; w < widths_.size(); ++w) points[w] = points_of_clump(l, w);
      if (std::ranges::all_of(points, [](std::size_t count) { return count == 0; })) continue;
      const std::vector<double> clumps = means_of_clumps(l, points);
      for (std::size_t w = 0; w < widths_.size(); ++w) {
        if (points[w] == 0) continue;
        result[w] += seen_of(texture_.tiers()[l], w) * (clumps[w] - octaves[w]);
      }
    }
    for (double& value : result) value *= texture_.scale();
    return result;
  }

 private:
  double seen_of(const ClumpTier& tier, std::size_t w) const {
    const double footprint{footprints_[w][0]};
    return double{tier.share} * seen_share(footprint * double{tier.frequency});
  }

  /// The number of points of each clump of tier l; 0 where the tier counts by its mean.
  std::size_t points_of_clump(std::size_t l, std::size_t w) const {
    const ClumpTier& tier = texture_.tiers()[l];
    const double clumps = double{tier.occupancy} / (tier.side * tier.side);
    const double chance = clump_spread * seen_of(tier, w) / std::sqrt(clumps);
    const double excess = chance / (tier_error * error_);
    if (excess < 1 || cells_of(tier) > most_cells) return 0;
    const auto parts = static_cast<std::size_t>(std::pow(excess, 1.5) / pairs_of_parts);
    return std::clamp(2 * pairs_of_parts * parts, fewest_points, most_clump_points);
  }

  /// <M>. It is multiplied by the share of the light outside visible clumps, and its error suits
  /// this share.
  std::vector<double> means_of_octaves() const {
    const std::size_t first = std::min(first_points, most_points_);
    std::vector<std::size_t> all(widths_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const std::vector<CloudMean> rough = measure_octaves(first, all);
    std::vector<double> result;
    std::map<std::size_t, std::vector<std::size_t>> larger;  // widths by the size of their cloud
    for (std::size_t w = 0; w < widths_.size(); ++w) {
      result.push_back(rough[w].mean);
      double share = 1;
      for (const ClumpTier& tier : texture_.tiers()) share -= seen_of(tier, w);
      const double excess = share * rough[w].error / rough[w].mean / error_;
      if (excess <= 1) continue;
      const double needed = points_margin * static_cast<double>(first) * excess * excess;
      larger[shared_cloud_size(needed, most_points_)].push_back(w);
    }
    for (const auto& [size, chosen] : larger) {
      const std::vector<CloudMean> means = measure_octaves(size, chosen);
      for (std::size_t k = 0; k < chosen.size(); ++k) result[chosen[k]] = means[k].mean;
    }
    return result;
  }

  /// <M> over about `size` points, for the footprints of these indices.
  std::vector<CloudMean> measure_octaves(std::size_t size,
                                         std::span<const std::size_t> chosen) const {
    const Cloud cloud = layer_.cloud(size);
    std::vector<CloudMoments> parts(cloud.batches * chosen.size());
    parallel_for(cloud.batches, [&](std::size_t b) {
      WeightedBatch batch{};
      cloud.fill(b, batch);
      OctaveArrays noise, products;
      texture_.fill_octaves(batch.points(), noise);
      for (std::size_t k = 0; k < chosen.size(); ++k) {
        multiply(batch.size, noise, chosen[k], products);
        parts[b * chosen.size() + k].add(batch, products[texture_.octaves()].data());
      }
    });
    std::vector<CloudMean> result;
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      CloudMoments moments;
      for (std::size_t b = 0; b < cloud.batches; ++b) {
        moments.add(parts[b * chosen.size() + k].sums());
      }
      result.push_back(moments.mean());
    }
    return result;
  }

  /// <M C_l>; `points` is the number of points of a clump for each footprint, 0 for none.
  std::vector<double> means_of_clumps(std::size_t l, std::span<const std::size_t> points) const {
    const std::vector<AssociationClump> clumps = find_clumps(texture_, l);
    const std::vector<bool> is_seen = clumps_there(l, clumps, points);
    std::vector<std::size_t> seen;
    for (std::size_t c = 0; c < clumps.size(); ++c) {
      const auto begin = is_seen.begin() + static_cast<std::ptrdiff_t>(c * widths_.size());
      if (std::find(begin, begin + std::ssize(widths_), true) != begin + std::ssize(widths_)) {
        seen.push_back(c);
      }
    }
    const std::vector<Offset> offsets = profile_points(std::ranges::max(points));
    // Whole clumps fit a batch. The sum for each clump is kept, so that the order of all sums does
    // not depend on the batches.
    const std::size_t in_batch = batch_capacity / offsets.size();
    std::vector<double> result(widths_.size(), 0.0);
    for (std::size_t first = 0; first < seen.size(); first += clumps_at_a_time) {
      const std::size_t count = std::min(clumps_at_a_time, seen.size() - first);
      std::vector<double> sums(count * widths_.size(), 0.0);
      parallel_for((count + in_batch - 1) / in_batch, [&](std::size_t b) {
        const std::size_t from = b * in_batch, size = std::min(in_batch, count - from);
        add_clumps_of(l, clumps, std::span(seen).subspan(first + from, size), offsets, points,
                      std::span(sums).subspan(from * widths_.size(), size * widths_.size()));
      });
      for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t w = 0; w < widths_.size(); ++w) {
          const std::size_t at = seen[first + k] * widths_.size() + w;
          if (is_seen[at]) result[w] += sums[k * widths_.size() + w];
        }
      }
    }
    for (std::size_t w = 0; w < widths_.size(); ++w) {
      if (points[w] > 0) result[w] /= static_cast<double>(points[w]);
    }
    return result;
  }

  /// Fills sums[k * footprints + w] with the sum over the first points[w] points of the k-th of
  /// these clumps, which fit a batch.
  void add_clumps_of(std::size_t l, const std::vector<AssociationClump>& clumps,
                     std::span<const std::size_t> chosen, const std::vector<Offset>& offsets,
                     std::span<const std::size_t> points, std::span<double> sums) const {
    const ClumpTier& tier = texture_.tiers()[l];
    const double c = double{tier.cosine} * tier.side, s = double{tier.sine} * tier.side;
    BatchArray x{}, y{}, z{}, density, light;
    std::size_t size = 0;
    for (const std::size_t n : chosen) {
      const AssociationClump& clump = clumps[n];
      for (std::size_t k = 0; k < offsets.size(); ++k) {
        const Offset at = place_in_clump(tier, clump, k, offsets[k]);
        x[size] = static_cast<float>(clump.x + clump.radius * (c * at.x - s * at.y));
        y[size] = static_cast<float>(clump.y + clump.radius * (s * at.x + c * at.y));
        z[size] = static_cast<float>(clump.z + clump.radius * at.z);
        light[size++] = static_cast<float>(at.light * clump.radius * clump.radius * clump.radius);
      }
    }
    const Points at{x.data(), y.data(), z.data(), size};
    layer_.envelope_above_plane(at, density.data());
    for (std::size_t i = 0; i < size; ++i) {
      density[i] = static_cast<float>(double{density[i]} / layer_.envelope_integral());
    }
    OctaveArrays noise, products;
    texture_.fill_octaves(at, noise);
    for (std::size_t w = 0; w < widths_.size(); ++w) {
      if (points[w] == 0) continue;
      multiply(size, noise, w, products);
      const BatchArray& whole = products[texture_.octaves()];
      const BatchArray& crowding = products[texture_.octaves_before(l)];
      for (std::size_t k = 0; k < chosen.size(); ++k) {
        const AssociationClump& clump = clumps[chosen[k]];
        double& sum = sums[k * widths_.size() + w];
        const std::size_t begin = k * offsets.size();
        for (std::size_t i = begin; i < begin + points[w]; ++i) {
          const double occupancy =
              std::min(clump.occupancy * double{std::max(crowding[i], least_complexes)},
                       double{most_occupancy});
          const double weight = weight_of(clump.number, occupancy);
          sum += weight / occupancy * double{light[i]} * double{density[i]} * double{whole[i]};
        }
      }
    }
  }

  /// Whether each clump exists for each footprint with points, [clump * footprints + w]. The
  /// octaves near its centre decide.
  std::vector<bool> clumps_there(std::size_t l, const std::vector<AssociationClump>& clumps,
                                 std::span<const std::size_t> points) const {
    std::vector<bool> result(clumps.size() * widths_.size(), false);
    for (std::size_t first = 0; first < clumps.size(); first += batch_capacity) {
      const std::size_t size = std::min(clumps.size() - first, batch_capacity);
      BatchArray x{}, y{}, z{};
      for (std::size_t i = 0; i < size; ++i) {
        x[i] = static_cast<float>(clumps[first + i].x);
        y[i] = static_cast<float>(clumps[first + i].y);
        z[i] = static_cast<float>(clumps[first + i].z);
      }
      OctaveArrays noise, products;
      texture_.fill_octaves({x.data(), y.data(), z.data(), size}, noise);
      for (std::size_t w = 0; w < widths_.size(); ++w) {
        if (points[w] == 0) continue;
        multiply(size, noise, w, products);
        const BatchArray& crowding = products[texture_.octaves_before(l)];
        for (std::size_t i = 0; i < size; ++i) {
          const AssociationClump& clump = clumps[first + i];
          const double most = clump.occupancy * double{std::max(crowding[i], least_complexes)};
          result[(first + i) * widths_.size() + w] = clump.number <= occupancy_margin * most;
        }
      }
    }
    return result;
  }

  void multiply(std::size_t size, const OctaveArrays& noise, std::size_t w,
                OctaveArrays& products) const {
    const float* const hidden = widths_[w] > 0 ? footprints_[w].data() : nullptr;
    texture_.multiply_octaves(size, noise, hidden, products);
  }

  const AssociationTexture& texture_;
  const Layer& layer_;
  std::vector<double> widths_;
  double error_;
  std::size_t most_points_;
  std::vector<BatchArray> footprints_;
};

}  // namespace

std::vector<double> association_means(const AssociationTexture& texture, const Layer& layer,
                                      std::span<const double> widths, double error,
                                      std::size_t most_points) {
  return Means(texture, layer, widths, error, most_points).values();
}

}  // namespace gamer
