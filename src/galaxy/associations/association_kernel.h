#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

// The part of AssociationTexture that works on whole vectors: its inputs, and functions that run
// the best instruction set of this machine. Arrays are those of batches (batch.h).

/// Number of bits of a hash that choose one of a tier's model clumps, and number of model clumps.
constexpr int clump_bits = 9;
constexpr std::size_t clump_count = std::size_t{1} << clump_bits;

// The light of a clump at a place x, in radii of the clump: a halo H (q^3 - c q^3 Q^2)(1 + e.x) and
// two cores C (q_1^3 + second_core q_2^3). q = 1 - |x|^2, and Q is q in the plane, 1 - x^2 - y^2.
// The cavity of depth c is thus a hole along z, with a rim that e makes brighter on one side. q_i
// is the q of a sphere of radius core_radius about the core. Places x are those of the bent clump:
// waves move rows of points along the lattice's axes, which changes no area.
constexpr float core_radius = 0.6f;
constexpr float second_core = 0.5f;
// Largest offset of a core along an axis, and largest e along an axis.
constexpr float core_offset = 0.35f;
constexpr float largest_tilt = 0.6f;

/// A wave that bends a clump. Its amplitude is `height` times the irregularity, in radii of the
/// clump, and its frequency is `cycles` per radius.
struct Bend {
  float height, cycles;
};
constexpr Bend wide_bend{0.2f, 0.4f}, narrow_bend{0.06f, 1.1f};
// Cycles by which the phase of a wide wave shifts per radius along z.
constexpr float bend_turn = 0.3f;

// Volume integrals of q^3, of q^3 Q^2, and of both cores with C = 1.
constexpr double halo_volume = 64 * std::numbers::pi / 315;
constexpr double cavity_volume = 64 * std::numbers::pi / 455;
constexpr double cores_volume = (1 + double{second_core}) * double{core_radius} *
                                double{core_radius} * double{core_radius} * halo_volume;

/// How far a clump of this irregularity reaches along an axis of its lattice, in radii.
constexpr double clump_reach(double irregularity) {
  return 1 + irregularity * (double{wide_bend.height} + double{narrow_bend.height});
}

/// The shape of one clump, from the bytes of a hash.
struct ClumpShape {
  explicit constexpr ClumpShape(std::uint32_t word)
      : phase{part(word, 0), part(word, 1), part(word, 2), part(word, 3)},
        core{core_offset * (2 * phase[0] - 1), core_offset * (2 * phase[2] - 1)},
        tilt{largest_tilt * (2 * phase[1] - 1), largest_tilt * (2 * phase[3] - 1)} {}

  /// Byte k as a number in [0, 1).
  static constexpr float part(std::uint32_t word, int k) {
    return static_cast<float>((word >> (8 * k)) & 0xFF) * 0x1p-8f;
  }

  float phase[4];  ///< of the waves, cycles
  float core[2];   ///< place of the first core; the second is at (-y, x)
  float tilt[2];   ///< e
};

// A clump is faded where its random number differs from the occupancy by less than this share of
// the occupancy.
constexpr float fade_range = 0.3f;

// Largest occupancy of cells; above it clumps become brighter.
constexpr float most_occupancy = 1 / (1 + fade_range);

// An octave's factor is between 1 - octave_depth and 1 + octave_depth.
constexpr float octave_depth = 0.9f;

// Smallest product of octaves in the occupancy. Below it clumps become fainter, so that they have
// no sharp edges where the octaves vanish.
constexpr float least_complexes = 0.15f;

/// The clumps of a tier: one in each occupied cell of a square lattice.
struct ClumpTier {
  float cosine = 0, sine = 0;        ///< of the lattice's angle, in cells per galaxy radius
  float offset_x = 0, offset_y = 0;  ///< of the lattice, cells
  std::uint32_t seed = 0;
  double side = 0;      ///< side of a cell, galaxy radii
  float cell = 0;       ///< `side`, in single precision
  float occupancy = 0;  ///< mean number of clumps in a cell where the surface density is 1
  float share = 0;      ///< of the light
  float frequency = 0;  ///< for the visibility, cycles per galaxy radius
  float bends = 0;      ///< irregularity of clumps
  std::vector<float> inverse_radius;  ///< 1/R
  std::vector<float> halo;            ///< H
  std::vector<float> cavity;          ///< c
  std::vector<float> cores;           ///< C
  std::vector<float> height;          ///< z of the centre
};

/// The surface density of clumps on a square grid over [-1, 1]^2, x first.
struct SurfaceDensity {
  int points = 0;  ///< along each axis, at least 2
  std::vector<float> values;
};

/// out = before (1 + octave_depth s (1 - 4/27 s^2)), s = clamp(contrast noise, -3/2, 3/2). Rays of
/// these footprints (null for none) see the share of the factor that they resolve at this
/// frequency; the rest counts as 1.
void multiply_octave(std::size_t size, const float* noise, float contrast, float frequency,
                     const float* footprints, const float* before, float* out);

/// Adds share (C - 1) to `sum`, where `share` is the part of tier.share that the footprint
/// resolves. C is the light of the tier's clumps relative to its mean; `complexes` is the part of
/// the octaves that decides which cells are occupied.
void add_clumps(const Points& points, const ClumpTier& tier, const SurfaceDensity& density,
                const float* complexes, const float* footprints, float* sum);

/// out = (1 + sum) factor, at least 0.
void fill_light(std::size_t size, const float* sum, const float* factor, float* out);

}  // namespace gamer
