#include "gamer/galaxy/light_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gamer/galaxy/sample_batch.h"

namespace gamer {
namespace {

// Midpoint rules in asinh(r / finest) and asinh(z / finest), and in azimuth.
constexpr int radii = 480, heights = 80, azimuths = 16, azimuths_of_arms = 96;
constexpr double finest = 1e-4;

double radius_at(double share) { return finest * std::sinh(share * std::asinh(1 / finest)); }

/// dr/dshare of radius_at().
double slope_at(double share) {
  const double most = std::asinh(1 / finest);
  return finest * std::cosh(share * most) * most;
}

/// Points of a ring above each other, in batches.
class Column {
 public:
  Column(const Component& component, double r) : component_(component), r_(r) {}

  /// Sums of the envelope and of the envelope times z^2 over heights and azimuths.
  double sum = 0, sum_z2 = 0;

  void add_all(int count) {
    for (int j = 0; j < heights; ++j) {
      const double share = (j + 0.5) / heights, z = radius_at(share);
      if (r_ * r_ + z * z >= 1) break;
      for (int k = 0; k < count; ++k) {
        // Azimuths of neighbouring heights lie between each other.
        const double azimuth = 2 * std::numbers::pi * (k + 0.5 * (j % 2)) / count;
        add(azimuth, z, slope_at(share) / heights / count);
      }
    }
    flush();
  }

 private:
  void add(double azimuth, double z, double weight) {
    const std::size_t i = batch_.size++;
    batch_.x[i] = static_cast<float>(r_ * std::cos(azimuth));
    batch_.y[i] = static_cast<float>(r_ * std::sin(azimuth));
    batch_.z[i] = static_cast<float>(z);
    batch_.r[i] = static_cast<float>(r_);
    batch_.azimuth[i] = static_cast<float>(std::remainder(azimuth, 2 * std::numbers::pi));
    batch_.winding[i] = 0;
    batch_.taper[i] = static_cast<float>(taper_at(std::hypot(r_, z)));
    weight_[i] = weight;
    if (batch_.size == batch_capacity) flush();
  }
  void flush() {
    for (std::size_t i = batch_.size; i < padded(batch_.size); ++i) {
      batch_.x[i] = batch_.y[i] = batch_.z[i] = batch_.r[i] = 1;
      batch_.azimuth[i] = batch_.winding[i] = batch_.taper[i] = 0;
    }
    BatchArray envelope;
    component_.envelope(batch_, envelope.data());
    for (std::size_t i = 0; i < batch_.size; ++i) {
      const double light = weight_[i] * double{envelope[i]};
      sum += light;
      sum_z2 += light * double{batch_.z[i]} * double{batch_.z[i]};
    }
    batch_.size = 0;
  }

  const Component& component_;
  double r_;
  SampleBatch batch_{};
  std::array<double, batch_capacity> weight_{};
};

}  // namespace

ComponentProfile::ComponentProfile(const Component& component) : inside(radii + 1, 0.0) {
  // The arms' winding turns a ring as a whole, so that it does not count.
  const int count = component.needs_azimuth() ? azimuths_of_arms : azimuths;
  double sum_r2 = 0, sum_z2 = 0;
  for (int i = 0; i < radii; ++i) {
    const double share = (i + 0.5) / radii, r = radius_at(share);
    Column column(component, r);
    column.add_all(count);
    const double area = 2 * std::numbers::pi * r * slope_at(share) / radii;
    const auto at = static_cast<std::size_t>(i);
    inside[at + 1] = inside[at] + 2 * area * column.sum;
    sum_r2 += 2 * area * column.sum * r * r;
    sum_z2 += 2 * area * column.sum_z2;
  }
  if (!(inside.back() > 0)) return;
  mean_r2 = sum_r2 / inside.back();
  mean_z2 = sum_z2 / inside.back();
}

LightProfile::LightProfile(std::span<const ComponentProfile> profiles,
                           std::span<const double> light, std::span<const double> axis) {
  std::vector<double> inside(radii + 1, 0.0);
  double total = 0, r2 = 0, z2 = 0;
  for (std::size_t c = 0; c < profiles.size(); ++c) {
    if (!(light[c] > 0) || !(profiles[c].inside.back() > 0)) continue;
    for (std::size_t i = 0; i < inside.size(); ++i) {
      inside[i] += light[c] * profiles[c].inside[i] / profiles[c].inside.back();
    }
    total += light[c];
    r2 += light[c] * profiles[c].mean_r2;
    z2 += light[c] * profiles[c].mean_z2;
  }
  if (!(total > 0)) throw std::invalid_argument("LightProfile: no light");
  const auto above = std::lower_bound(inside.begin(), inside.end(), 0.5 * total);
  const auto i = static_cast<double>(above - inside.begin());
  const double low = *(above - 1), share = (0.5 * total - low) / (*above - low);
  half_light_radius_ = radius_at((i - 1 + share) / radii) * std::max(axis[0], axis[1]);
  const double x2 = 0.5 * r2 * axis[0] * axis[1];
  edge_on_ratio_ = std::min(std::sqrt(z2 / x2) * axis[2], 1.0);
}

}  // namespace gamer
