#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

// The part of AssociationTexture that works on whole vectors: its inputs, and functions that run
// the best instruction set of this machine. Arrays are those of batches (batch.h).

/// Number of different clumps of a level, and the bits of a hash that choose one.
constexpr int clump_bits = 9;
constexpr std::size_t clump_count = std::size_t{1} << clump_bits;

// A clump's profile is q^3 (1 + core_height q^9) with q = 1 - r^2/R^2: a halo with a core.
constexpr float core_height = 6;

/// The profile at a distance r from the centre, in radii of the clump.
constexpr double clump_profile(double r) {
  const double q = r < 1 ? 1 - r * r : 0;
  const double cube = q * q * q;
  return cube * (1 + double{core_height} * cube * cube * cube);
}

// Volume integrals of (1 - r^2)^3 and (1 - r^2)^12, and of the profile.
constexpr double halo_volume = 64 * std::numbers::pi / 315;
constexpr double core_volume = 16777216 * std::numbers::pi / 456326325;
constexpr double clump_volume = halo_volume + double{core_height} * core_volume;

// Half the range of a clump's random number, relative to the occupancy, in which it fades.
constexpr float fade_range = 0.3f;

// Largest occupancy of cells; above it clumps become brighter.
constexpr float most_occupancy = 1 / (1 + fade_range);

// Least part of the octaves in the occupancy. Below it clumps become fainter, so that they have no
// sharp edges where the octaves vanish.
constexpr float least_complexes = 0.15f;

/// The clumps of a level: one in each occupied cell of a square lattice.
struct ClumpLevel {
  float cosine = 0, sine = 0;        ///< of the lattice's angle, in cells per galaxy radius
  float offset_x = 0, offset_y = 0;  ///< of the lattice, cells
  std::uint32_t seed = 0;
  double side = 0;      ///< side of a cell, galaxy radii
  float cell = 0;       ///< `side`, in single precision
  float occupancy = 0;  ///< mean number of clumps in a cell where the surface density is 1
  float share = 0;      ///< of the light
  float frequency = 0;  ///< for the visibility, cycles per galaxy radius
  std::vector<float> inverse_square;  ///< 1/R^2
  std::vector<float> amplitude;       ///< height of the profile
  std::vector<float> height;          ///< z of the centre
};

/// The surface density of clumps on a square grid over [-1, 1]^2, x first.
struct SurfaceDensity {
  int points = 0;  ///< along each axis, at least 2
  std::vector<float> values;
};

/// out = before clamp(1 + contrast noise, 0, 2). Rays of these footprints (null for none) see the
/// share of the factor that they resolve at this frequency; the rest counts as 1.
void multiply_octave(std::size_t size, const float* noise, float contrast, float frequency,
                     const float* footprints, const float* before, float* out);

/// Adds share seen (C - 1) to `sum`. C is the light of the level's clumps relative to its mean;
/// `complexes` is the part of the octaves that decides which cells are occupied.
void add_clumps(const Points& points, const ClumpLevel& level, const SurfaceDensity& density,
                const float* complexes, const float* footprints, float* sum);

/// out = (1 + sum) factor, at least 0.
void fill_light(std::size_t size, const float* sum, const float* factor, float* out);

}  // namespace gamer
