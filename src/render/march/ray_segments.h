#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "gamer/render/march/sampler.h"
#include "render/march/node_map.h"
#include "render/march/ray_integral.h"

namespace gamer {

inline constexpr std::int32_t no_segment = -1;

/// The stretch of a ray that a galaxy fills, with its focuses.
struct Crossing {
  Hit hit;
  double begin, end;
  bool has_variants, has_texture;
  std::vector<Focus> focuses;
};

/// A stretch of a ray that overlapping galaxies fill, or a piece of one.
struct Segment {
  std::int32_t ray;
  std::int32_t cover;
  std::int32_t next;    ///< behind it on the ray
  std::int32_t result;  ///< the first of its integrals, among those of all segments
  double origin;        ///< of its nodes' s, along the ray
  double step;          ///< of a piece: between its nodes
  bool open;            ///< whether it begins inside a galaxy
  bool has_variants;    ///< see dust_variants.h
  bool has_texture;
  bool shares_pixel;  ///< see Hit
  bool is_piece;
  bool is_slice;   ///< a piece with nodes of the segment that it was cut from
  bool continues;  ///< a piece of which the piece before it sees the same variants of the dust
  bool can_refine;
  bool refine;
  int halvings;

  /// A piece has integrals for each variant, since the pieces behind it see the same one.
  std::int32_t results() const {
    return is_piece && has_variants ? static_cast<std::int32_t>(dust_deviations.size()) : 1;
  }
};

/// Nodes of segments, all at the same level of refinement, and what fills them.
struct SegmentLevel {
  std::vector<std::int32_t> segment, first, count, cover, result;
  std::vector<std::uint8_t> open, open_end, has_variants;
  std::vector<float> step;  ///< between nodes, in the map's u, or of a piece along the ray
  std::vector<float> weight;
  RayNodes nodes;
  std::size_t variants = 1;
  std::int32_t size = 0;

  void clear() {
    variants = 1;
    size = 0;
    for (auto* values : {&segment, &first, &count, &cover, &result}) values->clear();
    for (auto* values : {&open, &open_end, &has_variants}) values->clear();
    step.clear();
    weight.clear();
    nodes.clear();
  }
  /// Adds a segment, whose nodes are to be filled in after make_room().
  void add(std::int32_t index, const Segment& own, std::int32_t nodes_of_segment, double distance) {
    add_integral(index, own, size, nodes_of_segment, distance);
    size += nodes_of_segment;
    nodes.segments.push_back({own.ray, own.cover, first.back(), nodes_of_segment, own.origin});
  }
  /// Adds an integral over nodes that belong to a segment already added.
  void add_integral(std::int32_t index, const Segment& own, std::int32_t first_node,
                    std::int32_t nodes_of_segment, double distance) {
    segment.push_back(index);
    first.push_back(first_node);
    count.push_back(nodes_of_segment);
    cover.push_back(own.cover);
    result.push_back(own.result);
    open.push_back(own.open || own.is_piece ? 1 : 0);
    open_end.push_back(own.is_piece ? 1 : 0);
    has_variants.push_back(own.has_variants ? 1 : 0);
    step.push_back(static_cast<float>(distance));
    if (own.has_variants) variants = dust_deviations.size();
  }
  void make_room() {
    nodes.s.resize(static_cast<std::size_t>(size));
    weight.resize(static_cast<std::size_t>(size) + SegmentNodes::padding);
  }
};

/// The nodes of a refined segment: known ones, and fresh ones between them. A segment without known
/// nodes has fresh ones alone.
struct NodeSource {
  std::int32_t known, fresh, merged;
  std::int32_t count;  ///< of the fresh ones
};
inline constexpr std::int32_t none_known = -1;

/// Nodes that a piece takes over from a segment.
struct NodeSlice {
  std::int32_t from, to, count;
};

/// The share of light that passes the segments so far. One factor is common to all variants of the
/// dust; pieces of one segment add a factor of each variant.
class Transmitted {
 public:
  /// Moves on to a segment.
  void enter(const Segment& segment) {
    if (segment.continues) return;
    common_ *= mean();
    own_.fill(1.0);
    variants_ = segment.results();
  }
  /// The share of light that passes what is in front of the segment, in a variant, times its
  /// weight.
  double in_front(std::int32_t variant) const {
    return common_ * weight(variant) * own_[static_cast<std::size_t>(variant)];
  }
  void pass(std::int32_t variant, double share) {
    own_[static_cast<std::size_t>(variant)] *= share;
  }

 private:
  double weight(std::int32_t variant) const {
    return variants_ == 1 ? 1.0 : dust_variant_weights[static_cast<std::size_t>(variant)];
  }
  double mean() const {
    double sum = 0;
    for (std::int32_t v = 0; v < variants_; ++v) {
      sum += weight(v) * own_[static_cast<std::size_t>(v)];
    }
    return sum;
  }

  double common_ = 1;
  std::array<double, dust_deviations.size()> own_{1, 1, 1};
  std::int32_t variants_ = 1;
};

/// Arrays of one thread, kept between calls.
struct AdaptiveWorkspace {
  std::vector<Crossing> crossings;
  std::size_t crossing_count = 0;
  std::vector<std::size_t> crossing_order;
  std::vector<Hit> segment_hits;
  std::vector<Focus> focuses;
  RayPlan plan;
  std::vector<Cover> covers;
  std::map<std::vector<int>, std::int32_t> cover_of;
  std::vector<int> last_galaxies, galaxies;
  std::int32_t last_cover = 0;

  std::vector<Segment> segments;
  std::vector<std::int32_t> first_segment;  ///< of each ray
  NodeMap map;
  std::vector<std::uint64_t> starts;  ///< cover, pairs of nodes and number of each segment
  std::size_t results = 0;            ///< integrals of all segments
  SegmentLevel level, pieces, fresh, merged;
  std::vector<std::int32_t> new_pieces;  ///< without nodes so far
  std::vector<std::int32_t> pieces_of_ray;
  std::vector<float> bounds;
  std::vector<float> no_weights;
  std::vector<NodeSource> sources;
  std::vector<NodeSlice> slices;

  /// Slots of the covers, as SegmentCovers has them.
  std::vector<std::int32_t> cover_light_slots, cover_dust_slots;
  std::vector<float> extinction, flux;
  std::vector<std::size_t> steering_node;
  std::size_t light_slots = 0, dust_slots = 0;
  std::vector<const float*> light, dust;
  std::vector<std::uint32_t> order;  ///< of the level's segments
  std::vector<std::uint8_t> no_variants;
  std::vector<std::int32_t> result;

  /// What integrate_segments() gives for every segment at its level: [result].
  std::vector<float> segment_light, segment_depth, segment_transmission;
  std::vector<Steered> steered;
  std::vector<std::int32_t> active, still_active;
  std::vector<double> errors;
  std::vector<Transmitted> transmitted;
  std::vector<std::size_t> places;
};

}  // namespace gamer
