#include "render/march/adaptive_sampler.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/denormals.h"
#include "gamer/core/cancellation.h"
#include "gamer/core/clock.h"

namespace gamer {
namespace {

// Optical depth beyond which relative errors need not decrease further.
constexpr double deepest = 80;
// Error of a ray that seeks the optical depth, relative to the error of a ray's light. No mean over
// many rays reduces the error of the depth.
constexpr double depth_error = 0.05;
// Largest number of pieces of a ray.
constexpr std::int32_t most_pieces = most_nodes_of_a_ray / piece_intervals;
// Largest number of halvings of a piece; single precision ends before.
constexpr int most_halvings = 24;

}  // namespace

std::int32_t AdaptiveSampler::find_cover(AdaptiveWorkspace& ws) const {
  ws.galaxies.clear();
  for (const Hit& hit : ws.segment_hits) ws.galaxies.push_back(hit.galaxy);
  if (!ws.covers.empty() && ws.galaxies == ws.last_galaxies) return ws.last_cover;
  ws.last_galaxies = ws.galaxies;
  std::ranges::sort(ws.galaxies);
  const auto [place, is_new] =
      ws.cover_of.try_emplace(ws.galaxies, static_cast<std::int32_t>(ws.covers.size()));
  if (is_new) ws.covers.push_back(medium_.cover(ws.segment_hits));
  return ws.last_cover = place->second;
}

void AdaptiveSampler::find_crossings(std::span<const Hit> hits, AdaptiveWorkspace& ws) const {
  ws.crossing_count = 0;
  ws.crossing_order.clear();
  for (const Hit& hit : hits) {
    medium_.plan(hit, ws.plan);
    if (!(ws.plan.begin < ws.plan.end)) continue;
    if (ws.crossings.size() == ws.crossing_count) ws.crossings.emplace_back();
    Crossing& crossing = ws.crossings[ws.crossing_count];
    crossing.hit = hit;
    crossing.begin = hit.centre + ws.plan.begin;
    crossing.end = hit.centre + ws.plan.end;
    crossing.has_variants = medium_.has_variants(hit);
    crossing.has_texture = ws.plan.has_texture;
    std::swap(crossing.focuses, ws.plan.focuses);
    ws.crossing_order.push_back(ws.crossing_count++);
  }
  // Hits are sorted by distance, but a galaxy's components may begin later.
  std::ranges::stable_sort(ws.crossing_order, [&](std::size_t a, std::size_t b) {
    return ws.crossings[a].begin < ws.crossings[b].begin;
  });
}

void AdaptiveSampler::find_segments(std::span<const Hit> hits, std::int32_t ray,
                                    AdaptiveWorkspace& ws) const {
  find_crossings(hits, ws);
  std::int32_t last = no_segment;
  for (std::size_t i = 0; i < ws.crossing_order.size();) {
    const double begin = ws.crossings[ws.crossing_order[i]].begin;
    double end = begin;
    bool has_variants = false, has_texture = false;
    std::size_t behind = i;
    ws.segment_hits.clear();
    while (behind < ws.crossing_order.size() &&
           (behind == i || ws.crossings[ws.crossing_order[behind]].begin < end)) {
      const Crossing& crossing = ws.crossings[ws.crossing_order[behind++]];
      end = std::max(end, crossing.end);
      has_variants = has_variants || crossing.has_variants;
      has_texture = has_texture || crossing.has_texture;
      ws.segment_hits.push_back(crossing.hit);
    }
    // For a single galaxy, s is counted from its centre, which keeps most digits where it is
    // densest.
    const double origin = behind == i + 1 ? ws.segment_hits.front().centre : 0.5 * (begin + end);
    ws.focuses.clear();
    for (std::size_t k = i; k < behind; ++k) {
      const Crossing& crossing = ws.crossings[ws.crossing_order[k]];
      for (const Focus& focus : crossing.focuses) {
        ws.focuses.push_back(
            {focus.centre + crossing.hit.centre - origin, focus.width, focus.rate});
      }
    }
    ws.map.add(begin - origin, end - origin, ws.focuses);
    const auto segment = static_cast<std::int32_t>(ws.segments.size());
    ws.segments.push_back({.ray = ray,
                           .cover = find_cover(ws),
                           .next = no_segment,
                           .result = segment,
                           .origin = origin,
                           .step = 0,
                           .first_step = medium_.accuracy().first_step * hits.front().step_factor,
                           .open = !(begin > 0),
                           .has_variants = has_variants,
                           .has_texture = has_texture,
                           .is_piece = false,
                           .is_slice = false,
                           .continues = false,
                           .can_refine = true,
                           .refine = false,
                           .halvings = 0});
    if (last == no_segment) {
      ws.first_segment[static_cast<std::size_t>(ray)] = segment;
    } else {
      ws.segments[static_cast<std::size_t>(last)].next = segment;
    }
    last = segment;
    i = behind;
  }
}

void AdaptiveSampler::describe_covers(AdaptiveWorkspace& ws) const {
  ws.light_slots = ws.dust_slots = 0;
  ws.cover_light_slots.clear();
  ws.cover_dust_slots.clear();
  for (const Cover& cover : ws.covers) {
    ws.light_slots = std::max(ws.light_slots, static_cast<std::size_t>(cover.light_slots));
    ws.dust_slots = std::max(ws.dust_slots, static_cast<std::size_t>(cover.dust_slots));
    ws.cover_light_slots.push_back(cover.light_slots);
    ws.cover_dust_slots.push_back(cover.dust_slots);
  }
  const std::size_t planes = medium_.steering().size(), nodes = medium_.nodes();
  const std::size_t covers = ws.covers.size();
  ws.flux.assign(covers * planes * ws.light_slots, 0.0f);
  ws.extinction.assign(ws.dust_slots * nodes * covers, 0.0f);
  for (std::size_t c = 0; c < covers; ++c) {
    for (std::size_t s = 0; s < planes; ++s) {
      for (int slot = 0; slot < ws.covers[c].light_slots; ++slot) {
        ws.flux[(static_cast<std::size_t>(slot) * planes + s) * covers + c] =
            medium_.steering_flux(ws.covers[c], slot, s);
      }
    }
    for (int slot = 0; slot < ws.covers[c].dust_slots; ++slot) {
      for (std::size_t j = 0; j < nodes; ++j) {
        ws.extinction[(static_cast<std::size_t>(slot) * nodes + j) * covers + c] =
            medium_.extinction(ws.covers[c], slot, j);
      }
    }
  }
  ws.steering_node.clear();
  for (const std::size_t plane : medium_.steering()) {
    ws.steering_node.push_back(medium_.basis().main_node(plane));
  }
}

void AdaptiveSampler::begin_level(AdaptiveWorkspace& ws) const {
  ws.map.measure();
  SegmentLevel& level = ws.level;
  level.clear();
  ws.pieces.clear();
  ws.new_pieces.clear();
  ws.starts.clear();
  ws.results = ws.segments.size();
  constexpr int segment_bits = 28, pair_bits = 13;
  static_assert((most_first_nodes - 1) / 2 < 1 << pair_bits);
  const std::size_t whole_segments = ws.segments.size();
  for (std::size_t r = 0; r < whole_segments; ++r) {
    const double pairs = std::ceil(0.5 * ws.map.length(r) / ws.segments[r].first_step);
    if (2 * pairs + 1 > most_first_nodes) {
      const double pieces = std::min(std::ceil(2 * pairs / piece_intervals), 0.5 * most_pieces);
      ws.map.cut(r, static_cast<int>(pieces), ws.bounds);
      cut_anew(static_cast<std::int32_t>(r), ws);
      continue;
    }
    const auto cover = static_cast<std::uint64_t>(ws.segments[r].cover);
    const auto kept = static_cast<std::uint64_t>(std::max(pairs, 0.5 * (fewest_nodes - 1)));
    ws.starts.push_back((cover << pair_bits | kept) << segment_bits | r);
  }
  // This order keeps a galaxy's nodes together, and gives segments that share vectors similar
  // lengths.
  std::ranges::sort(ws.starts);
  for (const std::uint64_t start : ws.starts) {
    const std::size_t segment = start & ((std::uint64_t{1} << segment_bits) - 1);
    const auto count =
        2 * static_cast<std::int32_t>(start >> segment_bits & ((1 << pair_bits) - 1)) + 1;
    level.add(static_cast<std::int32_t>(segment), ws.segments[segment], count,
              ws.map.length(segment) / (count - 1));
  }
  level.make_room();
  ws.map.place({level.segment, level.first, level.count, level.step, 0.0f, level.nodes.s.data(),
                level.weight.data()});
}

void AdaptiveSampler::evaluate(std::span<const std::span<const Hit>> hits, SegmentLevel& level,
                               AdaptiveWorkspace& ws, RenderCounts& counts) const {
  check_cancelled();
  medium_.evaluate(hits, ws.covers, level.variants, level.nodes, counts);
  counts.nodes += level.nodes.size();
}

void AdaptiveSampler::integrate(const SegmentLevel& level, std::size_t variant,
                                std::span<const double> weights, const std::uint8_t* has_variants,
                                bool is_first, AdaptiveWorkspace& ws) const {
  static_assert(RayNodes::padding >= SegmentNodes::padding);
  check_cancelled();
  ws.light.clear();
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    ws.light.push_back(level.nodes.light[slot].data());
  }
  ws.dust.clear();
  for (std::size_t k = variant * ws.dust_slots; k < level.nodes.dust.size(); ++k) {
    ws.dust.push_back(level.nodes.dust[k].data());
  }
  const SegmentNodes segments{level.segment.size(), level.first.data(),  level.count.data(),
                              level.cover.data(),   level.open.data(),   level.open_end.data(),
                              has_variants,         level.weight.data(), ws.light.data(),
                              ws.dust.data(),       ws.dust_slots,       weights};
  const SegmentCovers covers{ws.covers.size(),
                             medium_.nodes(),
                             ws.steering_node,
                             ws.cover_light_slots.data(),
                             ws.cover_dust_slots.data(),
                             ws.extinction.data(),
                             ws.flux.data()};
  order_segments(segments, covers, ws.order);
  integrate_segments(segments, covers, ws.order, is_first,
                     {ws.result.data(), ws.light_slots, ws.segment_light.data(),
                      ws.segment_depth.data(), ws.segment_transmission.data(), ws.steered.data()});
}

void AdaptiveSampler::integrate_segments_of(const SegmentLevel& level, bool is_first,
                                            AdaptiveWorkspace& ws) const {
  ws.result = level.result;
  integrate(level, 0, std::span(dust_variant_weights).first(level.variants),
            level.has_variants.data(), is_first, ws);
}

void AdaptiveSampler::integrate_pieces(AdaptiveWorkspace& ws) const {
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  ws.segment_light.resize(ws.results * ws.light_slots * nodes);
  ws.segment_depth.resize(ws.results * nodes);
  ws.segment_transmission.resize(ws.results * nodes);
  ws.steered.resize(ws.results * 2 * planes);
  const SegmentLevel& level = ws.pieces;
  ws.no_variants.assign(level.segment.size(), 0);
  static constexpr double alone[] = {1.0};
  for (std::size_t v = level.variants; v-- > 0;) {
    // A piece without variants has one result. The last pass, for the first variant, sets this
    // result.
    ws.result.clear();
    for (std::size_t i = 0; i < level.segment.size(); ++i) {
      const auto shift = level.has_variants[i] != 0 ? static_cast<std::int32_t>(v) : 0;
      ws.result.push_back(level.result[i] + shift);
    }
    // The first variant steers the refinement.
    integrate(level, v, alone, ws.no_variants.data(), v == 0, ws);
  }
}

double AdaptiveSampler::unit_of(const Segment& segment, const AdaptiveWorkspace& ws) const {
  return medium_.unit_of(ws.covers[static_cast<std::size_t>(segment.cover)].galaxies.front());
}

double AdaptiveSampler::typical_brightness(std::span<const Hit> hits, std::size_t s) const {
  if (hits.size() == 1) return medium_.typical_brightness(hits.front().galaxy, s);
  const double unit = medium_.unit_of(hits.front().galaxy);
  double typical = 0;
  for (const Hit& hit : hits) {
    const double own = medium_.typical_brightness(hit.galaxy, s);
    typical = std::max(typical, medium_.unit_of(hit.galaxy) / unit * own);
  }
  return typical;
}

AdaptiveSampler::Errors AdaptiveSampler::depth_errors_of(std::int32_t first, std::size_t s,
                                                         AdaptiveWorkspace& ws) const {
  const std::size_t planes = ws.steering_node.size();
  const auto depth_of = [&](std::int32_t r) -> const Steered& {
    const auto result = static_cast<std::size_t>(ws.segments[static_cast<std::size_t>(r)].result);
    return ws.steered[(result * 2 + 1) * planes + s];
  };
  const auto next = [&](std::int32_t r) { return ws.segments[static_cast<std::size_t>(r)].next; };
  double depth = 0, square = 0, count = 0;
  for (std::int32_t r = first; r != no_segment; r = next(r)) depth += double{depth_of(r).value};
  ws.errors.clear();
  for (std::int32_t r = first; r != no_segment; r = next(r)) {
    const bool has_texture = ws.segments[static_cast<std::size_t>(r)].has_texture;
    ws.errors.push_back(depth_of(r).error(depth, has_texture));
    square += ws.errors.back() * ws.errors.back();
    ++count;
  }
  return {square, depth_error * medium_.accuracy().ray_error * depth, count};
}

AdaptiveSampler::Errors AdaptiveSampler::errors_of(std::span<const Hit> hits, std::int32_t first,
                                                   std::size_t s, AdaptiveWorkspace& ws) const {
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  const Accuracy& accuracy = medium_.accuracy();
  const auto light_of = [&](std::int32_t result) -> const Steered& {
    return ws.steered[static_cast<std::size_t>(result) * 2 * planes + s];
  };
  const auto depth_of = [&](std::int32_t result) -> const Steered& {
    return ws.steered[(static_cast<std::size_t>(result) * 2 + 1) * planes + s];
  };
  const auto share_of = [&](std::int32_t result) {
    const std::size_t at = static_cast<std::size_t>(result) * nodes + ws.steering_node[s];
    return double{ws.segment_transmission[at]};
  };
  const double unit = medium_.unit_of(hits.front().galaxy);
  const auto units_of = [&](const Segment& segment) {
    return hits.size() == 1 ? 1.0 : unit_of(segment, ws) / unit;
  };
  double intensity = 0, depth = 0;
  Transmitted transmitted;
  ws.seen.clear();
  for (std::int32_t r = first; r != no_segment; r = ws.segments[static_cast<std::size_t>(r)].next) {
    const Segment& segment = ws.segments[static_cast<std::size_t>(r)];
    transmitted.enter(segment);
    const double units = units_of(segment);
    double passed = 0;
    for (std::int32_t v = 0; v < segment.results(); ++v) {
      const double share = transmitted.in_front(v) * units;
      passed += share;
      intensity += share * double{light_of(segment.result + v).value};
      transmitted.pass(v, share_of(segment.result + v));
    }
    depth += double{depth_of(segment.result).value};
    ws.seen.push_back({r, units, passed, intensity});
  }
  double faint = accuracy.faint_share * typical_brightness(hits, s);
  // Behind thick dust an image may be much fainter than the galaxy's face-on brightness.
  if (intensity < faint) faint *= std::exp(-0.5 * std::min(depth, deepest));
  const double scale = std::max(intensity, faint);
  const double allowed = accuracy.ray_error * hits.front().error_factor * scale;
  double square = 0;
  ws.errors.clear();
  for (const SeenSegment& seen : ws.seen) {
    const Segment& segment = ws.segments[static_cast<std::size_t>(seen.segment)];
    // An error of depth affects all light behind it. The error of the first variant stands for all
    // variants.
    const double error =
        seen.passed * light_of(segment.result).error(scale / seen.units, segment.has_texture) +
        (intensity - seen.light) * depth_of(segment.result).error(1, segment.has_texture);
    ws.errors.push_back(error);
    square += error * error;
  }
  return {square, allowed, static_cast<double>(ws.seen.size())};
}

bool AdaptiveSampler::judge(std::span<const Hit> hits, std::int32_t ray, AdaptiveWorkspace& ws,
                            RenderCounts& counts) const {
  const std::size_t planes = ws.steering_node.size();
  const std::int32_t first = ws.first_segment[static_cast<std::size_t>(ray)];
  const bool is_full = ws.pieces_of_ray[static_cast<std::size_t>(ray)] >= most_pieces;
  bool any = false, is_within = true;
  for (std::size_t s = 0; s < planes; ++s) {
    const auto [square, allowed, count] =
        hits.front().seeks_depth ? depth_errors_of(first, s, ws) : errors_of(hits, first, s, ws);
    if (square <= allowed * allowed) continue;
    is_within = false;
    std::size_t i = 0;
    for (std::int32_t r = first; r != no_segment;
         r = ws.segments[static_cast<std::size_t>(r)].next) {
      Segment& segment = ws.segments[static_cast<std::size_t>(r)];
      if (ws.errors[i++] <= allowed / std::sqrt(count) || !segment.can_refine) continue;
      const bool is_bound = segment.is_piece && (is_full || segment.halvings >= most_halvings);
      if (!is_bound) segment.refine = any = true;
    }
  }
  if (!any && !is_within) ++counts.unconverged_rays;
  return any;
}

void AdaptiveSampler::sum_up(std::span<const std::span<const Hit>> hits, AdaptiveWorkspace& ws,
                             RayLight& out) const {
  const std::size_t nodes = medium_.nodes();
  for (std::size_t ray = 0; ray < hits.size(); ++ray) {
    ws.transmitted.assign(nodes, {});
    double* depth = out.depth.data() + ray * nodes;
    for (std::int32_t r = ws.first_segment[ray]; r != no_segment;
         r = ws.segments[static_cast<std::size_t>(r)].next) {
      const Segment& segment = ws.segments[static_cast<std::size_t>(r)];
      if (!segment.continues) {
        medium_.places(out, ray, ws.covers[static_cast<std::size_t>(segment.cover)], ws.places);
      }
      for (Transmitted& transmitted : ws.transmitted) transmitted.enter(segment);
      for (std::int32_t v = 0; v < segment.results(); ++v) {
        const auto result = static_cast<std::size_t>(segment.result + v);
        for (std::size_t slot = 0; slot < ws.places.size(); ++slot) {
          double* sum = out.light.data() + ws.places[slot];
          const float* light = ws.segment_light.data() + (result * ws.light_slots + slot) * nodes;
          for (std::size_t j = 0; j < nodes; ++j) {
            sum[j] += ws.transmitted[j].in_front(v) * double{light[j]};
          }
        }
        const double share =
            segment.results() > 1 ? dust_variant_weights[static_cast<std::size_t>(v)] : 1;
        for (std::size_t j = 0; j < nodes; ++j) {
          depth[j] += share * double{ws.segment_depth[result * nodes + j]};
          ws.transmitted[j].pass(v, double{ws.segment_transmission[result * nodes + j]});
        }
      }
    }
    for (std::size_t j = 0; j < nodes; ++j) {
      out.through[ray * nodes + j] = ws.transmitted[j].behind();
    }
  }
}

void AdaptiveSampler::integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                                RenderCounts& counts) const {
  const DenormalsAreZero mode;
  const Clock clock;
  const double evaluating = counts.noise_seconds + counts.envelope_seconds;
  thread_local AdaptiveWorkspace own;
  AdaptiveWorkspace& ws = own;
  ws.segments.clear();
  ws.map.clear();
  ws.covers.clear();
  ws.cover_of.clear();
  ws.first_segment.assign(hits.size(), no_segment);
  ws.pieces_of_ray.assign(hits.size(), 0);
  ws.active.clear();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    find_segments(hits[i], static_cast<std::int32_t>(i), ws);
    if (ws.first_segment[i] != no_segment) ws.active.push_back(static_cast<std::int32_t>(i));
  }
  out.prepare(medium_, hits);
  counts.rays += hits.size();
  if (ws.active.empty()) return;
  describe_covers(ws);
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  begin_level(ws);
  ws.segment_light.resize(ws.results * ws.light_slots * nodes);
  ws.segment_depth.resize(ws.results * nodes);
  ws.segment_transmission.resize(ws.results * nodes);
  ws.steered.resize(ws.results * 2 * planes);
  evaluate(hits, ws.level, ws, counts);
  integrate_segments_of(ws.level, true, ws);
  if (!ws.new_pieces.empty()) {
    refine_pieces(hits, ws, counts);
    integrate_pieces(ws);
  }
  while (true) {
    for (Segment& segment : ws.segments) segment.refine = false;
    ws.still_active.clear();
    for (const std::int32_t ray : ws.active) {
      if (judge(hits[static_cast<std::size_t>(ray)], ray, ws, counts)) {
        ws.still_active.push_back(ray);
      }
    }
    std::swap(ws.active, ws.still_active);
    if (ws.active.empty()) break;
    refine_pieces(hits, ws, counts);
    integrate_pieces(ws);
    refine_segments(hits, ws, counts);
    integrate_segments_of(ws.level, false, ws);
  }
  sum_up(hits, ws, out);
  counts.transfer_seconds +=
      clock.seconds() - (counts.noise_seconds + counts.envelope_seconds - evaluating);
}

std::unique_ptr<Sampler> make_adaptive_sampler(const Medium& medium) {
  return std::make_unique<AdaptiveSampler>(medium);
}

}  // namespace gamer
