#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "galaxy/spiral_coordinates.h"
#include "gamer/core/batch.h"
#include "gamer/noise/noise.h"

namespace gamer {

// The part of VeinTexture that works on whole vectors: its inputs, and functions that run the best
// instruction set of this machine. Arrays are those of batches (batch.h).

/// The visibility of an octave. A helical octave has its frequency at radius 1 divided by r; other
/// octaves have a constant frequency.
struct SeenInput {
  float sharpest;  ///< largest frequency for the visibility
  bool helical;
};

/// A HelicalMap for kernels. `z_slope` turns z/r to cells. `x_magic` and `y_magic` are grid_magic()
/// of x and y.
struct MapInput {
  float x_slope, y_slope, z_slope;
  float p, q;
  float x_magic, y_magic;
};

struct DisplacementOctave {
  Octave octave;
  SeenInput seen;
  float variance;
};

struct DisplacementInput {
  MapInput map;
  std::vector<DisplacementOctave> octaves;
};

struct VeinInput {
  float count, inverse_count, cycle;
  float magic;                          ///< grid_magic() of u
  float vein_kappa, vein_y, vein_mean;  ///< y of InverseI0Exp(), I0e(kappa) = <A>
  float vein_square;                    ///< <A^2> - <A>^2
  float spur_kappa, spur_y, spur_mean;
  float spur_square;  ///< <G^2> - <G>^2 of spurs
  float rate, slope, curvature, inverse_length, strength, variation;
  float inverse_rise;  ///< inverse range of the fade within the arm
  int branches;
  std::vector<float> phases;  ///< phases of each arm's spurs, padded() with zeros
  std::uint32_t seed;
  float high, low, mean;  ///< D_h - D_l, D_l, and V where veins are not resolved
  float core;             ///< isotropic scale
  float square_start;     ///< footprint^2 from which veins are widened
  float relative;         ///< ((D_h - D_l)/<density>)^2
};

/// An octave of N.
struct MultiplyInput {
  Octave octave;
  MapInput map;  ///< of a helical one
  SeenInput seen;
  float contrast;      ///< c/sigma
  float variance;      ///< variance of the factor; c^2 for a helical octave
  float layers;        ///< 2 thickness frequency
  float blend_shift;   ///< the helical blend's argument is blend_shift + s/ln 2
  float clumpiness;    ///< power of a Cartesian factor
  float inverse_mean;  ///< inverse mean of that power
};

/// An octave that counts in a batch, with its index and whether any view of the batch sees it.
struct CountedOctave {
  const MultiplyInput* in;
  std::size_t index;
  bool seen;
};

// Largest number of octaves of a VeinTexture.
constexpr int most_octaves = 32;

constexpr float largest_contrast = 1.5f;

// Veins fade near the centre, where arms are close. The fading begins and ends where the isotropic
// scale is this many spacings of the arms.
constexpr float core_begin = 0.4f;
constexpr float core_end = 1.2f;

// Spurs fade, as in a bar, between these ratios of tan p to its value at the reference pitch.
constexpr float bar_begin = 1.8f;
constexpr float bar_end = 3.5f;

// Largest offset. Offsets only keep lattice points of different octaves apart, and stay on the grid
// below.
constexpr double largest_offset = 16.0;
constexpr double offset_steps = 1024;

/// A number that, added to a value and subtracted again, rounds the value to the spacing of single
/// precision at this size.
inline float grid_magic(double largest) {
  return static_cast<float>(1.5 * std::exp2(std::ceil(std::log2(largest))));
}

/// A grid_magic() for a coordinate of a lattice.
inline float grid_magic(double slope, int turn) {
  constexpr double most_radial = 5;  // |ln r| where helical octaves count
  return grid_magic(std::abs(slope) * most_radial + 0.5 * std::abs(turn) + largest_offset);
}

// Largest standard deviation of the logarithm of a coherent hidden factor.
constexpr float largest_deviation = 1.2f;

// InverseI0Exp() has one polynomial below this argument and one above.
constexpr float bessel_border = 2.5f;
// Ratio of y of InverseI0Exp() to the variance of a Gaussian of period 1; the argument is kappa =
// 1/(4 pi^2 variance).
constexpr auto y_factor =
    static_cast<float>(4 * bessel_border * std::numbers::pi * std::numbers::pi);

/// A batch of points as seen with one set of footprints.
struct VeinView {
  const float* footprints;  ///< null if everything is resolved
  float* density;           ///< (D_h - D_l) V + D_l, then times N
  float* coherent;          ///< hidden coherent variance of the logarithm, or null
  Range widths;             ///< range of the footprints; 0 if there are none
  std::size_t whole;        ///< number of octaves of the displacement that all points resolve
  /// Whether an octave of N is partly hidden at any point.
  std::array<bool, most_octaves> fades;
  BatchArray displacement;
  BatchArray unseen;   ///< variance of the hidden displacement
  BatchArray product;  ///< product of the Cartesian octaves of N

  VeinView(const float* seen_by, float* density_out, float* coherent_out)
      : footprints(seen_by), density(density_out), coherent(coherent_out) {}
};

/// Computes the displacement that views resolve, and the variance of the hidden rest.
void fill_displacement(const Points& points, const SpiralBatch& spiral, const DisplacementInput& in,
                       std::span<VeinView> views);
/// Computes (D_h - D_l) V + D_l. Footprints, `coherent` and all arguments after `in` except the
/// density may be null.
void fill_veins(std::size_t size, const SpiralBatch& spiral, const float* footprints,
                const float* displacement, const float* unseen, const VeinInput& in, float* density,
                float* coherent, float* arms, float* spurs, float* veins);
/// Multiplies the densities by the resolved parts of `count` helical octaves of N. With `cycles`
/// lattice points are identified in both directions.
void multiply_helical(const Points& points, const SpiralBatch& spiral, const CountedOctave* counted,
                      std::size_t count, bool cycles, std::span<const VeinView> views);
/// out = clamp(1 + contrast value, 0, 2)^power.
void fill_factors(std::size_t size, const float* value, float contrast, float power, float* out);
/// Multiplies the products by the resolved part of a Cartesian octave of N, given by its factor. A
/// fully resolved octave gives the factor itself, to the last bit.
void multiply_cartesian(std::size_t size, const float* value, const CountedOctave& octave,
                        std::span<VeinView> views);
void multiply_by(std::size_t size, const float* value, float* density);
/// out = scale density, times the factor of a deviation of the coherent part; `coherence` may be
/// null.
void deviate(std::size_t size, const float* density, const float* coherent, const float* coherence,
             float scale, float deviation, float* out);
void fill_scaled(std::size_t size, const float* density, float scale, float* out);

}  // namespace gamer
