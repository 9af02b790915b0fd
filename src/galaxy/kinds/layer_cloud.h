#pragma once

#include <cstddef>

namespace gamer {

/// The cells of a cloud in a layer: radial x azimuthal x vertical, counted along z first.
struct CloudInput {
  float radial, azimuthal, vertical;
  const float* node_radius;  ///< m with the share k/cloud_nodes of the light inside
  float z0;
  float flare;
  float twirl;
};

// Number of nodes between which r is linear in the share of the light inside.
inline constexpr int cloud_nodes = 1024;

// Largest share of the light on one side of the plane, which keeps the cloud within finite heights.
inline constexpr float largest_share = 1 - 1e-6f;

// Upper bound of the points of a cloud, which single precision can count.
inline constexpr std::size_t largest_cloud_size = std::size_t{1} << 23;

}  // namespace gamer
