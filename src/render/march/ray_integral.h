#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gamer {

/// Nodes of segments (intervals of rays, see NodeMap) with light and dust.
struct SegmentNodes {
  /// Extra numbers after the last node in every array, so that several can be read at once.
  static constexpr std::size_t padding = 3;

  std::size_t segments;
  const std::int32_t* first;  ///< [segment] index of its first node
  const std::int32_t* count;  ///< [segment] number of its nodes, odd, at least 9
  const std::int32_t* cover;
  const std::uint8_t* open;  ///< whether light and dust do not vanish at the segment's begin
  const std::uint8_t*
      open_end;  ///< whether they do not vanish at its end; it then has at most 65 nodes
  const std::uint8_t* variants;  ///< whether the integral is the mean over the variants of the dust
  const float* weight;           ///< [node] ds
  const float* const* light;     ///< [slot][node]
  const float* const* dust;      ///< [variant * dust_stride + slot][node]
  std::size_t dust_stride;
  std::span<const double> variant_weights;
};

/// The data of the covers' slots.
struct SegmentCovers {
  std::size_t covers;
  std::size_t nodes;                      ///< spectral
  std::span<const std::size_t> steering;  ///< the spectral node of each steering plane
  const std::int32_t* light_slots;        ///< of each cover
  const std::int32_t* dust_slots;
  const float* extinction;  ///< [(dust slot * nodes + j) * covers + cover]
  /// Dust-free flux of a unit of light in a steering plane, [(slot * planes + s) * covers + cover];
  /// 0 in slots that a cover lacks.
  const float* flux;
};

/// An integral over a segment, and its changes when the nodes were doubled.
struct Steered {
  float value, change, earlier_change;
  float missed;  ///< see SegmentIntegrals

  /// Sets the integrals by every fourth, every second and every node.
  void begin(float coarse, float middle, float fine) {
    value = fine;
    change = std::abs(fine - middle);
    earlier_change = std::abs(middle - coarse);
  }
  void refine(float better) {
    earlier_change = change;
    change = std::abs(better - value);
    value = better;
  }
  /// Estimates the error. Doubling the nodes at best squares an error relative to `scale`. Doubling
  /// leaves at least the share texture_share of a texture's error. A smaller change is a
  /// coincidence.
  double error(double scale, bool has_texture) const {
    const double earlier = double{earlier_change};
    const double least = has_texture ? texture_share * earlier : 0.0;
    double own = std::max(double{std::max(change, missed)}, least);
    if (scale > 0) own = std::max(own, earlier * earlier / scale);
    return has_texture ? own : smooth_weight * own;
  }
  /// Textures have kinks, at which a rule converges with the second power of the nodes' distance.
  static constexpr double texture_share = 0.15;
  /// Weight of errors of smooth light, which are equal on neighbouring rays. Errors of textures are
  /// random.
  static constexpr double smooth_weight = 2;
};

/// Largest fall of the transmission, e^-1.5, from one node to the next. The trapezoidal rule then
/// errs by at most a fifth of the interval's light.
constexpr float thick_ratio = 0.223f;

/// Integrals over segments; those of the i-th segment are at segment[i].
struct SegmentIntegrals {
  const std::int32_t* segment;
  std::size_t light_slots;  ///< at least the number of light slots of each cover
  float* light;             ///< [(segment * light_slots + slot) * nodes + j]: int e exp(-tau_j) ds
  float* depth;             ///< [segment * nodes + j]
  float* transmission;      ///< [segment * nodes + j]: exp(-depth), or its mean over variants
  /// [(segment * 2 + k) * planes + s]: the flux in a steering plane, k = 0, and the depth, k = 1.
  /// `missed` of the flux bounds the light between nodes whose transmission falls below thick_ratio
  /// of the node before. All nodes may miss the thin surface that emits this light.
  Steered* steered;
};

/// Sorts the segments so that similar segments share vectors.
void order_segments(const SegmentNodes& segments, const SegmentCovers& covers,
                    std::vector<std::uint32_t>& order);

/// Integrates by the trapezoidal rule in the map's u, with the weights of the cubic Gregory rule at
/// open ends. Optical depths up to the nodes use the cubic through the four nearest nodes. Between
/// nodes k - 1 and k, with opacities times weights f, the depth is
///   13/24 (f_(k-1) + f_k) - 1/24 (f_(k-2) + f_(k+1)),
/// which adds up to differences of sum_(i<=k) f_i - f_k/2 + (f_(k-1) - f_(k+1))/24. If `is_first`,
/// the steering integrals begin with these rules by every second and every fourth node; otherwise
/// they are refined. Segments are integrated in SIMD lanes; a segment's result depends on this
/// segment alone.
void integrate_segments(const SegmentNodes& segments, const SegmentCovers& covers,
                        std::span<const std::uint32_t> order, bool is_first,
                        const SegmentIntegrals& out);

}  // namespace gamer
