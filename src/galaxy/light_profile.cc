#include "gamer/galaxy/light_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gamer/galaxy/sample_batch.h"

namespace gamer {
namespace {

// Numbers of points of midpoint rules in asinh(r / finest_radius), asinh(z / finest_radius) and
// azimuth.
constexpr int radii = 240, heights = 60, azimuths = 16, azimuths_of_uneven = 96;
constexpr double finest_radius = 1e-4;

double radius_at(double share) {
  return finest_radius * std::sinh(share * std::asinh(1 / finest_radius));
}

/// The derivative dr/dshare of radius_at().
double slope_at(double share) {
  const double most = std::asinh(1 / finest_radius);
  return finest_radius * std::cosh(share * most) * most;
}

/// Directions in the plane, and heights above it, of the points of all rings.
struct Grid {
  explicit Grid(int count) : azimuth_count(count) {
    for (int k = 0; k < 2 * count; ++k) {
      const double angle = std::numbers::pi * k / count;
      azimuth.push_back(std::remainder(angle, 2 * std::numbers::pi));
      cosine.push_back(std::cos(angle));
      sine.push_back(std::sin(angle));
    }
    for (int j = 0; j < heights; ++j) {
      const double share = (j + 0.5) / heights;
      height.push_back(radius_at(share));
      weight.push_back(slope_at(share) / heights / count);
    }
  }

  int azimuth_count;
  std::vector<double> azimuth, cosine, sine;  ///< twice as many as a ring has points
  std::vector<double> height, weight;
};

/// Light above one side of a ring, per area.
struct Column {
  double light = 0, light_z2 = 0;  ///< the light, also times z^2
};

/// Sums the envelope over the heights and azimuths of the ring of radius r.
Column add_up(const Component& component, const Grid& grid, double r) {
  Column result;
  SampleBatch batch{};
  std::array<double, batch_capacity> weight{};
  // Heights count from the mid-plane of a warped component.
  const auto lift = [&] {
    BatchArray lifted;
    component.lift(batch, lifted.data());
    for (std::size_t i = 0; i < batch.size; ++i) {
      batch.z[i] += lifted[i];
      batch.taper[i] = static_cast<float>(taper_at(std::hypot(r, double{batch.z[i]})));
    }
  };
  const auto flush = [&] {
    for (std::size_t i = batch.size; i < padded(batch.size); ++i) {
      batch.x[i] = batch.y[i] = batch.z[i] = batch.r[i] = 1;
      batch.azimuth[i] = batch.winding[i] = batch.taper[i] = 0;
    }
    if (component.is_warped()) lift();
    BatchArray envelope;
    component.envelope(batch, envelope.data());
    for (std::size_t i = 0; i < batch.size; ++i) {
      const double light = weight[i] * double{envelope[i]};
      result.light += light;
      result.light_z2 += light * double{batch.z[i]} * double{batch.z[i]};
    }
    batch.size = 0;
  };
  for (std::size_t j = 0; j < grid.height.size(); ++j) {
    const double z = grid.height[j], distance2 = r * r + z * z;
    if (distance2 >= 1) break;
    const auto taper = static_cast<float>(taper_at(std::sqrt(distance2)));
    for (int k = 0; k < grid.azimuth_count; ++k) {
      // Azimuths of neighbouring heights alternate.
      const auto direction = 2 * static_cast<std::size_t>(k) + j % 2;
      const std::size_t i = batch.size++;
      batch.x[i] = static_cast<float>(r * grid.cosine[direction]);
      batch.y[i] = static_cast<float>(r * grid.sine[direction]);
      batch.z[i] = static_cast<float>(z);
      batch.r[i] = static_cast<float>(r);
      batch.azimuth[i] = static_cast<float>(grid.azimuth[direction]);
      batch.winding[i] = 0;
      batch.taper[i] = taper;
      weight[i] = grid.weight[j];
      if (batch.size == batch_capacity) flush();
    }
  }
  flush();
  return result;
}

}  // namespace

ComponentProfile::ComponentProfile(const Component& component) : inside(radii + 1, 0.0) {
  // The arms' winding turns a ring as a whole, and has no influence.
  const Grid grid(component.varies_around_axis() ? azimuths_of_uneven : azimuths);
  for (int i = 0; i < radii; ++i) {
    const double share = (i + 0.5) / radii, r = radius_at(share);
    const double area = 2 * std::numbers::pi * r * slope_at(share) / radii;
    const Column column = add_up(component, grid, r);
    const auto at = static_cast<std::size_t>(i);
    inside[at + 1] = inside[at] + area * column.light;
    mean_r2 += area * column.light * r * r;
    mean_z2 += area * column.light_z2;
  }
  const double all = inside.back();
  if (!(all > 0)) return;
  for (double& light : inside) light /= all;
  mean_r2 /= all;
  mean_z2 /= all;
}

LightProfile::LightProfile(std::span<const ComponentProfile> profiles,
                           std::span<const double> light, std::span<const double> axis) {
  double total = 0, r2 = 0, z2 = 0;
  for (std::size_t c = 0; c < profiles.size(); ++c) {
    if (!(profiles[c].inside.back() > 0)) continue;
    total += light[c];
    r2 += light[c] * profiles[c].mean_r2;
    z2 += light[c] * profiles[c].mean_z2;
  }
  if (!(total > 0)) throw std::invalid_argument("LightProfile: no light");
  const auto inside = [&](std::size_t i) {
    double sum = 0;
    for (std::size_t c = 0; c < profiles.size(); ++c) sum += light[c] * profiles[c].inside[i];
    return sum;
  };
  // The half-light radius is between the radii of indices `low` and `high`.
  std::size_t low = 0, high = radii;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (inside(middle) < 0.5 * total ? low : high) = middle;
  }
  const double share = (0.5 * total - inside(low)) / (inside(high) - inside(low));
  half_light_radius_ =
      radius_at((static_cast<double>(low) + share) / radii) * std::max(axis[0], axis[1]);
  const double x2 = 0.5 * r2 * axis[0] * axis[1];
  edge_on_ratio_ = std::min(std::sqrt(z2 / x2) * axis[2], 1.0);
}

}  // namespace gamer
