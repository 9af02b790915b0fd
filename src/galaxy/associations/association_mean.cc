#include "galaxy/associations/association_mean.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/noise/footprint.h"
#include "noise/lattice.h"

namespace gamer {
namespace {

// Number of points of the cloud for the mean of the octaves, and the margin on the number that its
// error asks for.
constexpr std::size_t first_points = std::size_t{1} << 13;
constexpr double points_margin = 1.5;
// The chance error of a level that counts by its mean, relative to the whole error. It is that of
// equal clumps times the factor `clump_spread`, since they differ in their light and in M.
constexpr double level_error = 0.3;
constexpr double clump_spread = 1.5;
// Largest number of cells of a level whose clumps are looked for. Levels of more cells, with clumps
// below a thousandth of the galaxy, count by their mean.
constexpr double most_cells = 1 << 24;
// Numbers of points of a clump.
constexpr std::size_t fewest_points = 16;
constexpr std::size_t most_clump_points = 256;
// A clump is kept if its random number is below so many times the occupancy at its centre. The
// octaves vary across a clump, hence the margin.
constexpr double occupancy_margin = 4;

/// A clump that may be there.
struct Clump {
  double x, y, z, radius;
  double number;     ///< the random number that decides whether the clump is there
  double occupancy;  ///< without the octaves
  double light;      ///< the integral of its profile
};

/// A place in a clump of radius 1.
struct Offset {
  double x, y, z;
};

/// The surface density at (x, y), interpolated.
double density_at(const SurfaceDensity& density, double x, double y) {
  const double last = density.points - 1;
  const auto place = [&](double coordinate) {
    return std::clamp(0.5 * last * (coordinate + 1), 0.0, last);
  };
  const double u = place(x), v = place(y);
  const double column = std::min(std::floor(u), last - 1);
  const double row = std::min(std::floor(v), last - 1);
  const auto points = static_cast<std::size_t>(density.points);
  const float* const corner = density.values.data() + static_cast<std::size_t>(row) * points +
                              static_cast<std::size_t>(column);
  const double low = std::lerp(double{corner[0]}, double{corner[1]}, u - column);
  const double high = std::lerp(double{corner[points]}, double{corner[points + 1]}, u - column);
  return std::lerp(low, high, v - row);
}

/// `count` places that follow a clump's profile, in pairs on opposite sides.
std::vector<Offset> profile_points(std::size_t count) {
  constexpr int steps = 1 << 12;
  static const std::vector<double> below = [] {
    std::vector<double> sums(steps + 1, 0.0);
    for (std::size_t i = 0; i < steps; ++i) {
      const double r = (static_cast<double>(i) + 0.5) / steps;
      sums[i + 1] = sums[i] + r * r * clump_profile(r);
    }
    return sums;
  }();
  std::vector<Offset> points;
  for (std::size_t k = 0; k < count / 2; ++k) {
    double u[3];
    R3Sequence().point(k, u);
    const double wanted = u[0] * below.back();
    const auto next = std::upper_bound(below.begin() + 1, below.end() - 1, wanted);
    const double within = (wanted - *(next - 1)) / (*next - *(next - 1));
    const double r = (static_cast<double>(next - 1 - below.begin()) + within) / steps;
    const double cosine = 2 * u[1] - 1, sine = std::sqrt(1 - cosine * cosine);
    const double angle = 2 * std::numbers::pi * u[2];
    const Offset point{r * sine * std::cos(angle), r * sine * std::sin(angle), r * cosine};
    points.push_back(point);
    points.push_back({-point.x, -point.y, -point.z});
  }
  return points;
}

using OctaveArrays = AssociationTexture::OctaveArrays;

class Mean {
 public:
  Mean(const AssociationTexture& texture, const AssociationLayer& layer, double footprint,
       double error)
      : texture_(texture), layer_(layer), error_(error), hides_(footprint > 0) {
    std::fill_n(footprints_.data(), batch_capacity, static_cast<float>(footprint));
  }

  double value() const {
    double seen = 0;
    for (const ClumpLevel& level : texture_.levels()) seen += seen_of(level);
    const double octaves = mean_of_octaves(1 - seen);
    double result = octaves;
    for (std::size_t l = 0; l < texture_.levels().size(); ++l) {
      const ClumpLevel& level = texture_.levels()[l];
      const double clumps = double{level.occupancy} / (level.side * level.side);
      const double chance = clump_spread * seen_of(level) / std::sqrt(clumps);
      const double excess = chance / (level_error * error_);
      if (excess < 1 || 4 / (level.side * level.side) > most_cells) continue;
      const auto pairs = static_cast<std::size_t>(std::pow(excess, 1.5));
      const std::size_t points = std::clamp(2 * pairs, fewest_points, most_clump_points);
      result += seen_of(level) * (mean_of_clumps(l, points) - octaves);
    }
    return result * texture_.scale();
  }

 private:
  double seen_of(const ClumpLevel& level) const {
    return double{level.share} * seen_share(double{footprints_[0]} * double{level.frequency});
  }

  /// <M>, of which `share` counts.
  double mean_of_octaves(double share) const {
    const auto measure = [&](std::size_t size) {
      const Cloud cloud = layer_.cloud(size);
      const auto values = [&](const Points& points, float* out) {
        OctaveArrays products;
        fill_products(points, products);
        std::copy_n(products[texture_.octaves()].data(), padded(points.size), out);
      };
      return moments_over(cloud, 0, cloud.batches, values).mean();
    };
    const std::size_t first = std::min(first_points, layer_.most_points);
    const CloudMean rough = measure(first);
    const double excess = share * rough.error / rough.mean / error_;
    if (excess <= 1) return rough.mean;
    const double needed = points_margin * static_cast<double>(first) * excess * excess;
    return measure(
               static_cast<std::size_t>(std::min(needed, static_cast<double>(layer_.most_points))))
        .mean;
  }

  /// <M C_l>.
  double mean_of_clumps(std::size_t l, std::size_t points_of_clump) const {
    const std::vector<Clump> clumps = find_clumps(l);
    const std::vector<Offset> offsets = profile_points(points_of_clump);
    const std::size_t points = clumps.size() * offsets.size();
    std::vector<double> parts((points + batch_capacity - 1) / batch_capacity);
    parallel_for(parts.size(), [&](std::size_t b) {
      const std::size_t first = b * batch_capacity;
      const std::size_t size = std::min(points - first, batch_capacity);
      const auto clump_of = [&](std::size_t i) -> const Clump& {
        return clumps[(first + i) / offsets.size()];
      };
      BatchArray x{}, y{}, z{}, density;
      for (std::size_t i = 0; i < size; ++i) {
        const Clump& clump = clump_of(i);
        const Offset& offset = offsets[(first + i) % offsets.size()];
        x[i] = static_cast<float>(clump.x + clump.radius * offset.x);
        y[i] = static_cast<float>(clump.y + clump.radius * offset.y);
        z[i] = static_cast<float>(clump.z + clump.radius * offset.z);
      }
      const Points at{x.data(), y.data(), z.data(), size};
      layer_.density(at, density.data());
      OctaveArrays products;
      fill_products(at, products);
      const BatchArray& whole = products[texture_.octaves()];
      const BatchArray& crowding = products[texture_.octaves_before(l)];
      for (std::size_t i = 0; i < size; ++i) {
        const Clump& clump = clump_of(i);
        const double occupancy =
            std::min(clump.occupancy * double{std::max(crowding[i], least_complexes)},
                     double{most_occupancy});
        const double weight = std::clamp(
            (1 + double{fade_range} - clump.number / occupancy) / (2 * double{fade_range}), 0.0,
            1.0);
        parts[b] += weight / occupancy * clump.light * double{density[i]} * double{whole[i]};
      }
    });
    return std::accumulate(parts.begin(), parts.end(), 0.0) / static_cast<double>(offsets.size());
  }

  /// The clumps of level l that may be there.
  std::vector<Clump> find_clumps(std::size_t l) const {
    const ClumpLevel& level = texture_.levels()[l];
    const double c = double{level.cosine} * level.side, s = double{level.sine} * level.side;
    // The largest product of octaves is 2 for each.
    const double most = std::ldexp(1.0, static_cast<int>(texture_.octaves_before(l)));
    const int reach = static_cast<int>(std::ceil(1 / level.side)) + 1;
    const int middle_x = static_cast<int>(level.offset_x);
    const int middle_y = static_cast<int>(level.offset_y);
    std::vector<Clump> result;
    for (int j = middle_y - reach; j <= middle_y + reach; ++j) {
      const std::uint32_t along = mix32(static_cast<std::uint32_t>(j) * lattice_py + level.seed);
      for (int i = middle_x - reach; i <= middle_x + reach; ++i) {
        const std::uint32_t word = mix32((static_cast<std::uint32_t>(i) * lattice_px) ^ along);
        const double u = i + (word & 0xFFFF) * 0x1p-16 - double{level.offset_x};
        const double v = j + (word >> 16) * 0x1p-16 - double{level.offset_y};
        const double x = level.side * (c * u - s * v), y = level.side * (s * u + c * v);
        if (std::hypot(x, y) > 1 + level.side) continue;
        const std::uint32_t again = mix32(word + cell_step);
        const double number = (again & 0xFFFF) * 0x1p-16;
        const double occupancy = double{level.occupancy} * density_at(texture_.density(), x, y);
        const double largest = std::min(occupancy * most, double{most_occupancy});
        if (number > (1 + double{fade_range}) * largest) continue;
        const std::size_t k = again >> (32 - clump_bits);
        const double radius = 1 / std::sqrt(double{level.inverse_square[k]});
        result.push_back({x, y, double{level.height[k]}, radius, number, occupancy,
                          double{level.amplitude[k]} * clump_volume * radius * radius * radius});
      }
    }
    drop_absent(l, result);
    return result;
  }

  /// Drops the clumps that are not there because of the octaves near their centres.
  void drop_absent(std::size_t l, std::vector<Clump>& clumps) const {
    std::vector<Clump> kept;
    for (std::size_t first = 0; first < clumps.size(); first += batch_capacity) {
      const std::size_t size = std::min(clumps.size() - first, batch_capacity);
      BatchArray x{}, y{}, z{};
      for (std::size_t i = 0; i < size; ++i) {
        x[i] = static_cast<float>(clumps[first + i].x);
        y[i] = static_cast<float>(clumps[first + i].y);
        z[i] = static_cast<float>(clumps[first + i].z);
      }
      OctaveArrays products;
      fill_products({x.data(), y.data(), z.data(), size}, products);
      for (std::size_t i = 0; i < size; ++i) {
        const Clump& clump = clumps[first + i];
        const float crowding = std::max(products[texture_.octaves_before(l)][i], least_complexes);
        if (clump.number <= occupancy_margin * clump.occupancy * double{crowding}) {
          kept.push_back(clump);
        }
      }
    }
    clumps = std::move(kept);
  }

  void fill_products(const Points& points, OctaveArrays& products) const {
    OctaveArrays noise;
    texture_.fill_octaves(points, noise);
    texture_.multiply_octaves(points.size, noise, hides_ ? footprints_.data() : nullptr, products);
  }

  const AssociationTexture& texture_;
  const AssociationLayer& layer_;
  double error_;
  bool hides_;
  BatchArray footprints_;
};

}  // namespace

double association_mean(const AssociationTexture& texture, const AssociationLayer& layer,
                        double footprint, double error) {
  return Mean(texture, layer, footprint, error).value();
}

}  // namespace gamer
