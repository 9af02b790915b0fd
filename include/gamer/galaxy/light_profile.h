#pragma once

#include <span>
#include <vector>

#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// The distribution of a component's light, without noise and dust, in the ball frame.
struct ComponentProfile {
  explicit ComponentProfile(const Component& component);

  /// Share of the light within cylinders about the axis, at radii from 0 to 1 that all profiles
  /// share. Without light all shares are 0.
  std::vector<double> inside;
  double mean_r2 = 0;  ///< <x^2 + y^2>
  double mean_z2 = 0;  ///< <z^2>
};

/// The distribution of a galaxy's light, without noise and dust, to which sizes and shapes of
/// catalogues refer. Components are weighted with their light in a band.
class LightProfile {
 public:
  /// `profiles` of the components, `light` of each of them (0 for dust), and the galaxy's stretch
  /// along x, y, z. Throws std::invalid_argument if no light is above 0.
  LightProfile(std::span<const ComponentProfile> profiles, std::span<const double> light,
               std::span<const double> axis);

  /// The semi-major axis, galaxy radii, of the ellipse that holds half of the light of the galaxy
  /// seen face on. Thin disks have this radius along their major axis at every inclination.
  double half_light_radius() const { return half_light_radius_; }
  /// sqrt(<z^2> / <x^2>), at most 1: the axis ratio of the galaxy seen edge on, by second moments.
  /// Where its plane is stretched, <x^2> is the geometric mean over both axes. At an inclination i
  /// the axis ratio is q, with q^2 = cos^2 i + (edge_on_ratio())^2 sin^2 i.
  double edge_on_ratio() const { return edge_on_ratio_; }

 private:
  double half_light_radius_ = 0;
  double edge_on_ratio_ = 0;
};

}  // namespace gamer
