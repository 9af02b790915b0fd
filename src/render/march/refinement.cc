#include <algorithm>
#include <cstdint>

#include "render/march/adaptive_sampler.h"

namespace gamer {

template <class Change>
void AdaptiveSampler::cut(std::int32_t index, std::int32_t count, AdaptiveWorkspace& ws,
                          const Change& change) const {
  const Segment whole = ws.segments[static_cast<std::size_t>(index)];
  std::int32_t last = no_segment;
  for (std::int32_t k = 0; k < count; ++k) {
    Segment piece = whole;
    piece.is_piece = piece.can_refine = true;
    piece.is_slice = piece.refine = false;
    piece.continues = whole.continues || last != no_segment;
    piece.result = static_cast<std::int32_t>(ws.results);
    ws.results += static_cast<std::size_t>(piece.results());
    const auto own = last == no_segment ? index : static_cast<std::int32_t>(ws.segments.size());
    change(k, own, piece);
    if (last == no_segment) {
      ws.segments[static_cast<std::size_t>(own)] = piece;
    } else {
      ws.segments[static_cast<std::size_t>(last)].next = own;
      ws.segments.push_back(piece);
    }
    last = own;
  }
  ws.pieces_of_ray[static_cast<std::size_t>(whole.ray)] += whole.is_piece ? count - 1 : count;
}

void AdaptiveSampler::cut_anew(std::int32_t index, AdaptiveWorkspace& ws) const {
  const double origin = ws.segments[static_cast<std::size_t>(index)].origin;
  // Bounds that are equal in single precision leave no piece between them.
  ws.bounds.erase(std::unique(ws.bounds.begin(), ws.bounds.end()), ws.bounds.end());
  const auto count = static_cast<std::int32_t>(ws.bounds.size()) - 1;
  if (count == 0) {
    ws.segments[static_cast<std::size_t>(index)].can_refine = false;
    return;
  }
  cut(index, count, ws, [&](std::int32_t k, std::int32_t own, Segment& piece) {
    const double begin = double{ws.bounds[static_cast<std::size_t>(k)]};
    const double end = double{ws.bounds[static_cast<std::size_t>(k + 1)]};
    piece.origin = origin + begin;
    piece.step = (end - begin) / piece_intervals;
    ws.new_pieces.push_back(own);
  });
}

void AdaptiveSampler::slice(std::size_t i, AdaptiveWorkspace& ws) const {
  const SegmentLevel& old = ws.level;
  SegmentLevel& merged = ws.merged;
  const std::int32_t fours = (old.count[i] - 1) / 4;
  const std::int32_t pieces = (fours + piece_intervals / 4 - 1) / (piece_intervals / 4);
  cut(old.segment[i], pieces, ws, [&](std::int32_t k, std::int32_t own, Segment& piece) {
    const std::int32_t first = 4 * (k * fours / pieces), last = 4 * ((k + 1) * fours / pieces);
    piece.is_slice = true;
    ws.slices.push_back({old.first[i] + first, merged.size, last - first + 1});
    merged.add_integral(own, piece, merged.size, last - first + 1, 0);
    merged.size += last - first + 1;
  });
}

void AdaptiveSampler::halve(std::size_t i, AdaptiveWorkspace& ws) const {
  const SegmentLevel& old = ws.pieces;
  SegmentLevel& fresh = ws.fresh;
  SegmentLevel& merged = ws.merged;
  const auto first_half = static_cast<std::size_t>(old.segment[i]);
  ws.sources.push_back({old.first[i], fresh.size, merged.size, piece_intervals});
  fresh.add(old.segment[i], ws.segments[first_half], piece_intervals, ws.segments[first_half].step);
  const auto behind = static_cast<std::int32_t>(ws.segments.size());
  Segment second = ws.segments[first_half];
  second.step *= 0.5;
  ++second.halvings;
  Segment first = second;
  second.origin += piece_intervals * second.step;
  second.continues = true;
  second.result = static_cast<std::int32_t>(ws.results);
  ws.results += static_cast<std::size_t>(second.results());
  first.next = behind;
  ++ws.pieces_of_ray[static_cast<std::size_t>(first.ray)];
  merged.add_integral(old.segment[i], first, merged.size, piece_intervals + 1, first.step);
  merged.add_integral(behind, second, merged.size + piece_intervals, piece_intervals + 1,
                      second.step);
  merged.size += 2 * piece_intervals + 1;
  ws.segments[first_half] = first;
  ws.segments.push_back(second);
}

void AdaptiveSampler::merge(SegmentLevel& known, AdaptiveWorkspace& ws) const {
  const SegmentLevel& fresh = ws.fresh;
  SegmentLevel& merged = ws.merged;
  const auto interleave = [&](const auto& even, const auto& odd, auto& out) {
    for (const NodeSource& source : ws.sources) {
      const auto* between = odd.data() + source.fresh;
      auto* to = out.data() + source.merged;
      if (source.known == none_known) {
        std::copy_n(between, source.count, to);
        continue;
      }
      const auto* from = even.data() + source.known;
      for (std::int32_t n = 0; n < source.count; ++n) {
        to[2 * n] = from[n];
        to[2 * n + 1] = between[n];
      }
      to[2 * source.count] = from[source.count];
    }
  };
  if (&known == &ws.level) {
    interleave(known.nodes.s, fresh.nodes.s, merged.nodes.s);
    interleave(known.weight, fresh.weight, merged.weight);
    for (float& weight : merged.weight) weight *= 0.5f;
  }
  // A level that holds no segments may lack room for their slots.
  known.nodes.make_room(ws.light_slots, ws.dust_slots, merged.variants);
  merged.nodes.make_room(ws.light_slots, ws.dust_slots, merged.variants);
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    interleave(known.nodes.light[slot], fresh.nodes.light[slot], merged.nodes.light[slot]);
  }
  for (std::size_t k = 0; k < merged.variants * ws.dust_slots; ++k) {
    interleave(known.nodes.dust[k], fresh.nodes.dust[k], merged.nodes.dust[k]);
  }
}

void AdaptiveSampler::refine_segments(std::span<const std::span<const Hit>> hits,
                                      AdaptiveWorkspace& ws, RenderCounts& counts) const {
  SegmentLevel& old = ws.level;
  SegmentLevel& fresh = ws.fresh;
  SegmentLevel& merged = ws.merged;
  fresh.clear();
  merged.clear();
  ws.sources.clear();
  for (std::size_t i = 0; i < old.segment.size(); ++i) {
    Segment& segment = ws.segments[static_cast<std::size_t>(old.segment[i])];
    if (segment.is_piece) continue;
    segment.can_refine = segment.refine;
    if (!segment.refine) continue;
    const std::int32_t intervals = old.count[i] - 1;
    ws.sources.push_back({old.first[i], fresh.size, merged.size, intervals});
    fresh.add(old.segment[i], segment, intervals, double{old.step[i]});
    merged.add(old.segment[i], segment, 2 * intervals + 1, 0.5 * double{old.step[i]});
  }
  fresh.make_room();
  merged.make_room();
  ws.map.place({fresh.segment, fresh.first, fresh.count, fresh.step, 0.5f, fresh.nodes.s.data(),
                fresh.weight.data()});
  evaluate(hits, fresh, ws, counts);
  merge(old, ws);
  std::swap(ws.level, ws.merged);
}

void AdaptiveSampler::copy_slices(AdaptiveWorkspace& ws) const {
  SegmentLevel& merged = ws.merged;
  const auto copy = [&](const auto& from, auto& to) {
    for (const NodeSlice& own : ws.slices) {
      std::copy_n(from.data() + own.from, own.count, to.data() + own.to);
    }
  };
  copy(ws.level.nodes.s, merged.nodes.s);
  copy(ws.level.weight, merged.weight);
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    copy(ws.level.nodes.light[slot], merged.nodes.light[slot]);
  }
  for (std::size_t k = 0; k < std::min(merged.variants, ws.level.variants) * ws.dust_slots; ++k) {
    copy(ws.level.nodes.dust[k], merged.nodes.dust[k]);
  }
}

void AdaptiveSampler::refine_pieces(std::span<const std::span<const Hit>> hits,
                                    AdaptiveWorkspace& ws, RenderCounts& counts) const {
  SegmentLevel& old = ws.pieces;
  SegmentLevel& fresh = ws.fresh;
  SegmentLevel& merged = ws.merged;
  fresh.clear();
  merged.clear();
  ws.sources.clear();
  ws.slices.clear();
  for (std::size_t i = 0; i < old.segment.size(); ++i) {
    const auto first_half = static_cast<std::size_t>(old.segment[i]);
    ws.segments[first_half].can_refine = ws.segments[first_half].refine;
    if (!ws.segments[first_half].refine) continue;
    if (ws.segments[first_half].is_slice) {
      const float* const s = old.nodes.s.data() + old.first[i];
      const std::int32_t last = old.count[i] - 1;
      ws.bounds = {s[0], s[last / 2], s[last]};
      cut_anew(old.segment[i], ws);
      continue;
    }
    halve(i, ws);
  }
  const std::size_t refined = ws.sources.size();
  for (const std::int32_t index : ws.new_pieces) {
    const Segment& piece = ws.segments[static_cast<std::size_t>(index)];
    ws.sources.push_back({none_known, fresh.size, merged.size, piece_intervals + 1});
    fresh.add(index, piece, piece_intervals + 1, piece.step);
    merged.add_integral(index, piece, merged.size, piece_intervals + 1, piece.step);
    merged.size += piece_intervals + 1;
  }
  ws.new_pieces.clear();
  const std::size_t even = merged.segment.size();
  for (std::size_t i = 0; i < ws.level.segment.size(); ++i) {
    const Segment& segment = ws.segments[static_cast<std::size_t>(ws.level.segment[i])];
    if (segment.refine && !segment.is_piece && 2 * ws.level.count[i] - 1 > most_nodes) slice(i, ws);
  }
  fresh.make_room();
  merged.make_room();
  for (std::size_t i = 0; i < ws.sources.size(); ++i) {
    const float shift = i < refined ? 0.5f : 0.0f;
    float* const s = fresh.nodes.s.data() + fresh.first[i];
    for (std::int32_t k = 0; k < fresh.count[i]; ++k) {
      s[k] = (static_cast<float>(k) + shift) * fresh.step[i];
    }
  }
  for (std::size_t i = 0; i < even; ++i) {
    std::fill_n(merged.weight.data() + merged.first[i], merged.count[i], merged.step[i]);
  }
  evaluate(hits, fresh, ws, counts);
  merge(old, ws);
  copy_slices(ws);
  std::swap(ws.pieces, ws.merged);
}

}  // namespace gamer
