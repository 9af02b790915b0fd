#pragma once

#include <cstdint>
#include <span>

#include "render/march/ray_segments.h"

namespace gamer {

// A segment has at least fewest_nodes nodes, so that a cubic fits through every second node.
// Segments that begin with more than most_first_nodes, or reach more than most_nodes, are cut into
// pieces.
inline constexpr std::int32_t fewest_nodes = 9;
inline constexpr std::int32_t most_first_nodes = 129;
inline constexpr std::int32_t most_nodes = 2 * most_first_nodes - 1;

// Number of intervals of a piece. Every fourth node of a piece still suffices for a cubic.
inline constexpr std::int32_t piece_intervals = 32;

/// A sampler with nodes where components need them. The nodes of segments are doubled until the
/// error of each ray is within Accuracy::ray_error (docs/method.md, "The adaptive sampler").
class AdaptiveSampler : public Sampler {
 public:
  explicit AdaptiveSampler(const Medium& medium) : medium_(medium) {}

  void integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                 RenderCounts& counts) const override;

 private:
  /// Finds the crossings of the galaxies that a ray hits, in the order in which they begin.
  void find_crossings(std::span<const Hit> hits, AdaptiveWorkspace& ws) const;
  void find_segments(std::span<const Hit> hits, std::int32_t ray, AdaptiveWorkspace& ws) const;
  std::int32_t find_cover(AdaptiveWorkspace& ws) const;
  /// Tabulates the data of the covers' slots.
  void describe_covers(AdaptiveWorkspace& ws) const;
  void begin_level(AdaptiveWorkspace& ws) const;
  /// Replaces a segment by `count` successive copies, the first in its own place; `change` turns
  /// the k-th copy into a piece.
  template <class Change>
  void cut(std::int32_t index, std::int32_t count, AdaptiveWorkspace& ws,
           const Change& change) const;
  /// Replaces a segment by the pieces between ws.bounds, which get new nodes.
  void cut_anew(std::int32_t index, AdaptiveWorkspace& ws) const;
  /// Cuts the i-th segment of ws.level into pieces that keep its nodes, and adds them to ws.merged.
  void slice(std::size_t i, AdaptiveWorkspace& ws) const;
  /// Doubles the nodes of segments that need refinement.
  void refine_segments(std::span<const std::span<const Hit>> hits, AdaptiveWorkspace& ws,
                       RenderCounts& counts) const;
  /// Replaces pieces that need refinement by their halves, each with an equal number of nodes, and
  /// evaluates new pieces. Segments of ws.level that would get too many nodes become pieces.
  void refine_pieces(std::span<const std::span<const Hit>> hits, AdaptiveWorkspace& ws,
                     RenderCounts& counts) const;
  /// Replaces the i-th piece by its halves, and adds them to ws.merged.
  void halve(std::size_t i, AdaptiveWorkspace& ws) const;
  /// Copies the nodes that pieces take over from segments into ws.merged.
  void copy_slices(AdaptiveWorkspace& ws) const;
  /// Fills ws.merged with the light and dust of `known` nodes and ws.fresh.
  void merge(SegmentLevel& known, AdaptiveWorkspace& ws) const;
  void evaluate(std::span<const std::span<const Hit>> hits, SegmentLevel& level,
                AdaptiveWorkspace& ws, RenderCounts& counts) const;
  /// Integrates segments; dust that has variants counts by its mean over them.
  void integrate_segments_of(const SegmentLevel& level, bool is_first, AdaptiveWorkspace& ws) const;
  /// Integrates pieces for each variant.
  void integrate_pieces(AdaptiveWorkspace& ws) const;
  void integrate(const SegmentLevel& level, std::size_t variant, std::span<const double> weights,
                 const std::uint8_t* has_variants, bool is_first, AdaptiveWorkspace& ws) const;
  /// The unit of a segment's light, a brightness.
  double unit_of(const Segment& segment, const AdaptiveWorkspace& ws) const;
  /// The largest Medium::typical_brightness() of hit galaxies, in units of the nearest galaxy.
  double typical_brightness(std::span<const Hit> hits, std::size_t s) const;
  /// Sum of the squared errors of a ray's segments in one steering plane, the allowed error of the
  /// ray, and the number of segments. Light is in units of the nearest galaxy, so that a ray
  /// through one galaxy does not depend on its brightness.
  struct Errors {
    double square, allowed, count;
  };
  /// Fills ws.errors by segment.
  Errors errors_of(std::span<const Hit> hits, std::int32_t first, std::size_t s,
                   AdaptiveWorkspace& ws) const;
  /// Errors of the optical depth, for a ray whose optical depth decides the nodes.
  Errors depth_errors_of(std::int32_t first, std::size_t s, AdaptiveWorkspace& ws) const;
  /// Marks the segments of a ray that need more nodes, and returns whether there are any. A ray
  /// whose error stays too large counts as unconverged. Either a limit kept a segment from more
  /// nodes, or a finished segment gained weight when segments in front of it became clearer.
  bool judge(std::span<const Hit> hits, std::int32_t ray, AdaptiveWorkspace& ws,
             RenderCounts& counts) const;
  void sum_up(std::span<const std::span<const Hit>> hits, AdaptiveWorkspace& ws,
              RayLight& out) const;

  const Medium& medium_;
};

}  // namespace gamer
