#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gamer {

/// Nodes of segments (stretches of rays, see NodeMap) and what fills them.
struct SegmentNodes {
  /// Numbers of any value behind the last node's in every array, so that several can be read at
  /// once.
  static constexpr std::size_t padding = 3;

  std::size_t segments;
  const std::int32_t* first;  ///< of each segment's nodes
  const std::int32_t* count;  ///< odd, at least 9
  const std::int32_t* cover;
  const std::uint8_t* open;      ///< whether the segment begins where light and dust do not vanish
  const std::uint8_t* open_end;  ///< whether it ends so; it then has at most 65 nodes
  const std::uint8_t* variants;  ///< whether the segment is the mean over variants of its dust
  const float* weight;           ///< of each node, ds
  const float* const* light;     ///< [slot][node]
  const float* const* dust;      ///< [variant * dust_stride + slot][node]
  std::size_t dust_stride;
  std::span<const double> variant_weights;
};

/// What slots do, for each cover.
struct SegmentCovers {
  std::size_t covers;
  std::size_t nodes;                      ///< spectral
  std::span<const std::size_t> steering;  ///< the spectral node of each steering plane
  const std::int32_t* light_slots;        ///< of each cover
  const std::int32_t* dust_slots;
  const float* extinction;  ///< [(dust slot * nodes + j) * covers + cover]
  /// Dust-free flux of a unit of light in a steering plane, [(slot * planes + s) * covers + cover];
  /// 0 in slots that a cover has not.
  const float* flux;
};

/// An integral over a segment and how it changed when the nodes were doubled.
struct Steered {
  float value, change, earlier_change;
  float missed;  ///< see SegmentIntegrals

  /// By every fourth, every second and every node.
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
  /// Twice the nodes at best square an error relative to `scale`, and leave texture_share of that
  /// of a texture: a change smaller than that is chance.
  double error(double scale, bool has_texture) const {
    const double earlier = double{earlier_change};
    const double least = has_texture ? texture_share * earlier : 0.0;
    double own = std::max(double{std::max(change, missed)}, least);
    if (scale > 0) own = std::max(own, earlier * earlier / scale);
    return has_texture ? own : smooth_weight * own;
  }
  /// Textures have kinks, at which a rule converges with the second power of the nodes' distance.
  static constexpr double texture_share = 0.15;
  /// What is smooth errs alike on neighbouring rays, a texture by chance.
  static constexpr double smooth_weight = 2;
};

/// The transmission may fall by this factor, e^-1.5, from one node to the next: the trapezoidal
/// rule is then wrong by a fifth of the interval's light at most.
constexpr float thick_ratio = 0.223f;

/// Integrals over segments; what belongs to the i-th stands at segment[i].
struct SegmentIntegrals {
  const std::int32_t* segment;
  std::size_t light_slots;  ///< at least those of each cover
  float* light;             ///< [(segment * light_slots + slot) * nodes + j]: int e exp(-tau_j) ds
  float* depth;             ///< [segment * nodes + j]
  float* transmission;      ///< [segment * nodes + j]: exp(-depth), or its mean over variants
  /// [(segment * 2 + k) * planes + s]: the flux in a steering plane, k = 0, and the depth, k = 1.
  /// `missed` of the flux bounds the light between nodes of which the second shows less than
  /// thick_ratio of what the first shows: no node need lie in the skin from which it comes.
  Steered* steered;
};

/// Sorts the segments so that those much alike follow each other and share vectors.
void order_segments(const SegmentNodes& segments, const SegmentCovers& covers,
                    std::vector<std::uint32_t>& order);

/// The trapezoidal rule in the map's u, with the weights of the cubic Gregory rule at open ends;
/// optical depths up to the nodes by the cubic
/// through the four nearest: between nodes k - 1 and k, of opacities times weights f,
///   13/24 (f_(k-1) + f_k) - 1/24 (f_(k-2) + f_(k+1)),
/// which adds up to differences of sum_(i<=k) f_i - f_k/2 + (f_(k-1) - f_(k+1))/24. What steers
/// begins with the same rules by every second and every fourth node where `is_first`, and is
/// refined otherwise. Segments are worked on in SIMD lanes; each one's result depends on it alone.
void integrate_segments(const SegmentNodes& segments, const SegmentCovers& covers,
                        std::span<const std::uint32_t> order, bool is_first,
                        const SegmentIntegrals& out);

}  // namespace gamer
