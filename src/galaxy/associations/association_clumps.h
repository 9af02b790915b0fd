#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "galaxy/associations/association_texture.h"

namespace gamer {

/// A clump that may exist.
struct AssociationClump {
  double x, y, z, radius;
  double number;      ///< the random number that decides whether the clump exists
  double occupancy;   ///< without the octaves
  std::size_t model;  ///< its index among the model clumps
  ClumpShape shape;
  std::uint64_t cell;  ///< the indices of its cell
};

/// The weight w of a clump with this random number where the occupancy is p.
inline double weight_of(double number, double occupancy) {
  return std::clamp((1 + double{fade_range} - number / occupancy) / (2 * double{fade_range}), 0.0,
                    1.0);
}

/// A place in a clump, in its radii along the lattice's axes.
struct ClumpPlace {
  double x, y, z;
};

/// The radius within which the share u of the density q^3 lies, in a ball of radius 1.
double radius_of_share(double u);
/// A place in this ball. It has the density q^3 if u is uniform in [0, 1)^3.
ClumpPlace place_in_ball(const std::array<double, 3>& u);

/// The halo's light at a place of the clump before it is bent, relative to q^3.
double halo_share(const ClumpTier& tier, const AssociationClump& clump, const ClumpPlace& at);
/// Where the waves that bend the clump move this place.
ClumpPlace bent_place(const ClumpTier& tier, const AssociationClump& clump, ClumpPlace at);

/// Approximate number of lattice cells of a tier within the galaxy's radius.
double cells_of(const ClumpTier& tier);

/// The clumps of tier l that may exist.
std::vector<AssociationClump> find_clumps(const AssociationTexture& texture, std::size_t l);

}  // namespace gamer
