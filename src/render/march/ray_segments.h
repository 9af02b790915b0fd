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

/// The interval of a ray that a galaxy fills, with its focuses.
struct Crossing {
  Hit hit;
  double begin, end;
  bool has_variants, has_texture;
  std::vector<Focus> focuses;
};

/// An interval of a ray that one galaxy or overlapping galaxies fill, or a piece of such an
/// interval.
struct Segment {
  std::int32_t ray;
  std::int32_t cover;
  std::int32_t next;    ///< segment behind it on the ray
  std::int32_t result;  ///< index of its first integral, among those of all segments
  double origin;        ///< place on the ray where s = 0
  double step;          ///< distance between the nodes of a piece
  double first_step;    ///< largest distance of the first nodes, in units of the node map
  bool open;            ///< whether the ray begins inside it, as for a camera within a galaxy
  bool has_variants;    ///< see dust_variants.h
  bool has_texture;
  bool is_piece;
  bool is_slice;   ///< a piece with nodes of the segment that it was cut from
  bool continues;  ///< a piece whose dust variants continue those of the piece before it
  bool can_refine;
  bool refine;
  int halvings;

  /// Number of integrals. A piece has integrals for each variant, since pieces behind it continue
  /// the variant.
  std::int32_t results() const {
    return is_piece && has_variants ? static_cast<std::int32_t>(dust_deviations.size()) : 1;
  }
};

/// Nodes of segments at one level of refinement, with light and dust.
struct SegmentLevel {
  std::vector<std::int32_t> segment, first, count, cover, result;
  std::vector<std::uint8_t> open, open_end, has_variants;
  std::vector<float> step;  ///< distance of nodes in the map's u, or along the ray for a piece
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
  /// Adds a segment, whose nodes must be filled after make_room().
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

/// The nodes of a refined segment: known nodes, and fresh nodes between them. A segment without
/// known nodes has only fresh nodes.
struct NodeSource {
  std::int32_t known, fresh, merged;
  std::int32_t count;  ///< number of fresh nodes
};
inline constexpr std::int32_t none_known = -1;

/// Nodes that a piece takes over from a segment.
struct NodeSlice {
  std::int32_t from, to, count;
};

/// The transmission of the segments so far. One factor is common to all variants of the dust;
/// pieces of one segment add a factor for each variant.
class Transmitted {
 public:
  /// Moves on to a segment.
  void enter(const Segment& segment) {
    if (segment.continues) return;
    common_ *= mean();
    own_.fill(1.0);
    variants_ = segment.results();
  }
  /// The transmission in front of the segment, in a variant, times the variant's weight.
  double in_front(std::int32_t variant) const {
    return common_ * weight(variant) * own_[static_cast<std::size_t>(variant)];
  }
  /// The transmission of all segments so far.
  double behind() const { return common_ * mean(); }
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

/// A segment of a ray as the camera sees it, in one plane.
struct SeenSegment {
  std::int32_t segment;
  double units;   ///< unit of its light, relative to that of the ray's first galaxy
  double passed;  ///< transmission in front of it, times `units`
  double light;   ///< light of all segments up to this one's end
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
  std::vector<std::uint64_t>
      starts;               ///< [segment] cover, pairs of nodes, and number, as a key for sorting
  std::size_t results = 0;  ///< number of integrals of all segments
  SegmentLevel level, pieces, fresh, merged;
  std::vector<std::int32_t> new_pieces;  ///< pieces that have no nodes yet
  std::vector<std::int32_t> pieces_of_ray;
  std::vector<float> bounds;
  std::vector<NodeSource> sources;
  std::vector<NodeSlice> slices;

  /// Slots of the covers, as in SegmentCovers.
  std::vector<std::int32_t> cover_light_slots, cover_dust_slots;
  std::vector<float> extinction, flux;
  std::vector<std::size_t> steering_node;
  std::size_t light_slots = 0, dust_slots = 0;
  std::vector<const float*> light, dust;
  std::vector<std::uint32_t> order;  ///< order of the level's segments
  std::vector<std::uint8_t> no_variants;
  std::vector<std::int32_t> result;

  /// Results of integrate_segments() for every segment at its level, by result.
  std::vector<float> segment_light, segment_depth, segment_transmission;
  std::vector<Steered> steered;
  std::vector<std::int32_t> active, still_active;
  std::vector<SeenSegment> seen;
  std::vector<double> errors;
  std::vector<Transmitted> transmitted;
  std::vector<std::size_t> places;
};

}  // namespace gamer
