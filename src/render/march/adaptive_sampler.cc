#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "core/denormals.h"
#include "gamer/core/clock.h"
#include "gamer/render/march/sampler.h"
#include "render/march/node_map.h"
#include "render/march/ray_integral.h"

namespace gamer {

namespace {

// A run has at least fewest_nodes, so that every second one still makes a cubic. Runs that begin
// with more than most_first_nodes, or come to more than most_nodes, are cut into pieces.
constexpr std::int32_t fewest_nodes = 9;
constexpr std::int32_t most_first_nodes = 129;
constexpr std::int32_t most_nodes = 2 * most_first_nodes - 1;

// Number of intervals of a piece. Every fourth node still makes a cubic.
constexpr std::int32_t piece_intervals = 32;
// Rays of larger optical depths need no better relative errors than those of this one.
constexpr double deepest = 80;

// Largest number of pieces of a ray.
constexpr std::int32_t most_pieces = most_nodes_of_a_ray / piece_intervals;
// Largest number of halvings of a piece; single precision ends before.
constexpr int most_halvings = 24;

constexpr std::int32_t no_run = -1;

/// The stretch of a ray that a galaxy fills, with its focuses.
struct Part {
  Hit hit;
  double begin, end;
  bool has_variants, has_texture;
  std::vector<Focus> focuses;
};

/// A stretch of a ray that overlapping galaxies fill, or a piece of one.
struct Run {
  std::int32_t ray;
  std::int32_t cover;
  std::int32_t next;    ///< behind it on the ray
  std::int32_t result;  ///< the first of its integrals, among those of all runs
  double origin;        ///< of its nodes' s, along the ray
  double step;          ///< of a piece: between its nodes
  bool open;            ///< whether it begins inside a galaxy
  bool has_variants;    ///< see dust_variants.h
  bool has_texture;
  bool shares_pixel;  ///< see Hit
  bool is_piece;
  bool is_slice;   ///< a piece with nodes of the run that it was cut from
  bool continues;  ///< a piece of which the piece before it sees the same variants of the dust
  bool can_refine;
  bool refine;
  int halvings;

  /// A piece has integrals for each variant, since the pieces behind it see the same one.
  std::int32_t results() const {
    return is_piece && has_variants ? static_cast<std::int32_t>(dust_deviations.size()) : 1;
  }
};

/// Nodes of runs, all at the same level of refinement, and what fills them.
struct Level {
  std::vector<std::int32_t> run, first, count, cover, result;
  std::vector<std::uint8_t> open, open_end, has_variants;
  std::vector<float> step;  ///< between nodes, in the map's u, or of a piece along the ray
  std::vector<float> weight;
  RayNodes nodes;
  std::size_t variants = 1;
  std::int32_t size = 0;

  void clear() {
    variants = 1;
    size = 0;
    for (auto* values : {&run, &first, &count, &cover, &result}) values->clear();
    for (auto* values : {&open, &open_end, &has_variants}) values->clear();
    step.clear();
    weight.clear();
    nodes.clear();
  }
  /// Adds a run, whose nodes are to be filled in after make_room().
  void add(std::int32_t index, const Run& own, std::int32_t nodes_of_run, double distance) {
    add_integral(index, own, size, nodes_of_run, distance);
    size += nodes_of_run;
    nodes.runs.push_back({own.ray, own.cover, first.back(), nodes_of_run, own.origin});
  }
  /// Adds an integral over nodes that belong to a run already added.
  void add_integral(std::int32_t index, const Run& own, std::int32_t first_node,
                    std::int32_t nodes_of_run, double distance) {
    run.push_back(index);
    first.push_back(first_node);
    count.push_back(nodes_of_run);
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
    weight.resize(static_cast<std::size_t>(size) + RunNodes::padding);
  }
};

/// The nodes of a refined run: known ones, and fresh ones between them. A run without known nodes
/// has fresh ones alone.
struct Source {
  std::int32_t known, fresh, merged;
  std::int32_t count;  ///< of the fresh ones
};
constexpr std::int32_t none_known = -1;

/// Nodes that a piece takes over from a run.
struct Slice {
  std::int32_t from, to, count;
};

/// The share of light that passes the runs so far. One factor is common to all variants of the
/// dust; pieces of one run add a factor of each variant.
class Transmitted {
 public:
  /// Moves on to a run.
  void enter(const Run& run) {
    if (run.continues) return;
    common_ *= mean();
    own_.fill(1.0);
    variants_ = run.results();
  }
  /// The share of light that passes what is in front of the run, in a variant, times its weight.
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
struct Workspace {
  std::vector<Part> parts;
  std::size_t part_count = 0;
  std::vector<std::size_t> part_order;
  std::vector<Hit> run_hits;
  std::vector<Focus> focuses;
  RayPlan plan;
  std::vector<Cover> covers;
  std::map<std::vector<int>, std::int32_t> cover_of;
  std::vector<int> last_galaxies, galaxies;
  std::int32_t last_cover = 0;

  std::vector<Run> runs;
  std::vector<std::int32_t> first_run;  ///< of each ray
  NodeMap map;
  std::vector<std::uint64_t> starts;  ///< cover, pairs of nodes and number of each run
  std::size_t results = 0;            ///< integrals of all runs
  Level level, pieces, fresh, merged;
  std::vector<std::int32_t> new_pieces;  ///< without nodes so far
  std::vector<std::int32_t> pieces_of_ray;
  std::vector<float> bounds;
  std::vector<float> no_weights;
  std::vector<Source> sources;
  std::vector<Slice> slices;

  /// Slots of the covers, as RunCovers has them.
  std::vector<std::int32_t> cover_light_slots, cover_dust_slots;
  std::vector<float> extinction, flux;
  std::vector<std::size_t> steering_node;
  std::size_t light_slots = 0, dust_slots = 0;
  std::vector<const float*> light, dust;
  std::vector<std::uint32_t> order;  ///< of the level's runs
  std::vector<std::uint8_t> no_variants;
  std::vector<std::int32_t> result;

  /// What integrate_runs() gives for every run at its level: [result].
  std::vector<float> run_light, run_depth, run_transmission;
  std::vector<Steered> steered;
  std::vector<std::int32_t> active, still_active;
  std::vector<double> errors;
  std::vector<Transmitted> transmitted;
  std::vector<std::size_t> places;
};

Workspace& workspace() {
  thread_local Workspace instance;
  return instance;
}

class AdaptiveSampler : public Sampler {
 public:
  explicit AdaptiveSampler(const Medium& medium) : medium_(medium) {}

  void integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                 RenderCounts& counts) const override;

 private:
  void find_runs(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const;
  std::int32_t find_cover(Workspace& ws) const;
  /// Tabulates what the covers' slots do.
  void describe_covers(Workspace& ws) const;
  void begin_level(Workspace& ws) const;
  /// Replaces a run by `count` copies of itself that follow each other, the first in its own place;
  /// `change` makes a piece of the k-th.
  template <class Change>
  void cut(std::int32_t index, std::int32_t count, Workspace& ws, const Change& change) const;
  /// Replaces a run by the pieces between ws.bounds, which get nodes of their own.
  void cut_anew(std::int32_t index, Workspace& ws) const;
  /// Cuts the i-th run of ws.level into pieces that keep its nodes, and adds them to ws.merged.
  void slice(std::size_t i, Workspace& ws) const;
  /// Doubles the nodes of the runs that are to be refined.
  void refine_runs(std::span<const std::span<const Hit>> hits, Workspace& ws,
                   RenderCounts& counts) const;
  /// Replaces pieces that are to be refined by their halves, of as many nodes, and evaluates new
  /// pieces. Runs of ws.level that are to be refined and would have too many nodes become pieces.
  void refine_pieces(std::span<const std::span<const Hit>> hits, Workspace& ws,
                     RenderCounts& counts) const;
  /// Fills ws.merged with the light and dust of `known` nodes and ws.fresh.
  void merge(Level& known, Workspace& ws) const;
  void evaluate(std::span<const std::span<const Hit>> hits, Level& level, Workspace& ws,
                RenderCounts& counts) const;
  /// Integrates runs as means over their variants.
  void integrate_runs_of(const Level& level, bool is_first, Workspace& ws) const;
  /// Integrates pieces for each variant.
  void integrate_pieces(Workspace& ws) const;
  void integrate(const Level& level, std::size_t variant, std::span<const double> weights,
                 const std::uint8_t* has_variants, bool is_first, Workspace& ws) const;
  /// Marks the runs of a ray that need more nodes; false when none. A ray whose error stays above
  /// what is allowed counts as unconverged: a bound kept a run from more nodes, or the run had been
  /// left as it is before the runs in front turned out to be clearer.
  bool judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws,
             RenderCounts& counts) const;
  void sum_up(std::span<const std::span<const Hit>> hits, Workspace& ws, RayLight& out) const;

  const Medium& medium_;
};

std::int32_t AdaptiveSampler::find_cover(Workspace& ws) const {
  ws.galaxies.clear();
  for (const Hit& hit : ws.run_hits) ws.galaxies.push_back(hit.galaxy);
  if (!ws.covers.empty() && ws.galaxies == ws.last_galaxies) return ws.last_cover;
  ws.last_galaxies = ws.galaxies;
  std::sort(ws.galaxies.begin(), ws.galaxies.end());
  const auto [place, is_new] =
      ws.cover_of.try_emplace(ws.galaxies, static_cast<std::int32_t>(ws.covers.size()));
  if (is_new) ws.covers.push_back(medium_.cover(ws.run_hits));
  return ws.last_cover = place->second;
}

void AdaptiveSampler::find_runs(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const {
  ws.part_count = 0;
  ws.part_order.clear();
  for (const Hit& hit : hits) {
    medium_.plan(hit, ws.plan);
    if (!(ws.plan.begin < ws.plan.end)) continue;
    if (ws.parts.size() == ws.part_count) ws.parts.emplace_back();
    Part& part = ws.parts[ws.part_count];
    part.hit = hit;
    part.begin = hit.centre + ws.plan.begin;
    part.end = hit.centre + ws.plan.end;
    part.has_variants = medium_.has_variants(hit);
    part.has_texture = ws.plan.has_texture;
    std::swap(part.focuses, ws.plan.focuses);
    ws.part_order.push_back(ws.part_count++);
  }
  // Hits come nearest first, but what there is in a galaxy may begin later.
  std::stable_sort(ws.part_order.begin(), ws.part_order.end(), [&](std::size_t a, std::size_t b) {
    return ws.parts[a].begin < ws.parts[b].begin;
  });
  std::int32_t last = no_run;
  for (std::size_t i = 0; i < ws.part_order.size();) {
    const double begin = ws.parts[ws.part_order[i]].begin;
    double end = begin;
    bool has_variants = false, has_texture = false;
    std::size_t behind = i;
    ws.run_hits.clear();
    while (behind < ws.part_order.size() &&
           (behind == i || ws.parts[ws.part_order[behind]].begin < end)) {
      const Part& part = ws.parts[ws.part_order[behind++]];
      end = std::max(end, part.end);
      has_variants = has_variants || part.has_variants;
      has_texture = has_texture || part.has_texture;
      ws.run_hits.push_back(part.hit);
    }
    // Alone, a galaxy's own centre keeps the most digits where it is densest.
    const double origin = behind == i + 1 ? ws.run_hits.front().centre : 0.5 * (begin + end);
    ws.focuses.clear();
    for (std::size_t k = i; k < behind; ++k) {
      const Part& part = ws.parts[ws.part_order[k]];
      for (const Focus& focus : part.focuses) {
        ws.focuses.push_back({focus.centre + part.hit.centre - origin, focus.width, focus.rate});
      }
    }
    ws.map.add(begin - origin, end - origin, ws.focuses);
    const auto run = static_cast<std::int32_t>(ws.runs.size());
    ws.runs.push_back({.ray = ray,
                       .cover = find_cover(ws),
                       .next = no_run,
                       .result = run,
                       .origin = origin,
                       .step = 0,
                       .open = !(begin > 0),
                       .has_variants = has_variants,
                       .has_texture = has_texture,
                       .shares_pixel = hits.front().shares_pixel,
                       .is_piece = false,
                       .is_slice = false,
                       .continues = false,
                       .can_refine = true,
                       .refine = false,
                       .halvings = 0});
    if (last == no_run) {
      ws.first_run[static_cast<std::size_t>(ray)] = run;
    } else {
      ws.runs[static_cast<std::size_t>(last)].next = run;
    }
    last = run;
    i = behind;
  }
}

void AdaptiveSampler::describe_covers(Workspace& ws) const {
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

template <class Change>
void AdaptiveSampler::cut(std::int32_t index, std::int32_t count, Workspace& ws,
                          const Change& change) const {
  const Run whole = ws.runs[static_cast<std::size_t>(index)];
  std::int32_t last = no_run;
  for (std::int32_t k = 0; k < count; ++k) {
    Run piece = whole;
    piece.is_piece = piece.can_refine = true;
    piece.is_slice = piece.refine = false;
    piece.continues = whole.continues || last != no_run;
    piece.result = static_cast<std::int32_t>(ws.results);
    ws.results += static_cast<std::size_t>(piece.results());
    const auto own = last == no_run ? index : static_cast<std::int32_t>(ws.runs.size());
    change(k, own, piece);
    if (last == no_run) {
      ws.runs[static_cast<std::size_t>(own)] = piece;
    } else {
      ws.runs[static_cast<std::size_t>(last)].next = own;
      ws.runs.push_back(piece);
    }
    last = own;
  }
  ws.pieces_of_ray[static_cast<std::size_t>(whole.ray)] += whole.is_piece ? count - 1 : count;
}

void AdaptiveSampler::cut_anew(std::int32_t index, Workspace& ws) const {
  const double origin = ws.runs[static_cast<std::size_t>(index)].origin;
  // There is nothing between bounds that single precision cannot tell apart.
  ws.bounds.erase(std::unique(ws.bounds.begin(), ws.bounds.end()), ws.bounds.end());
  const auto count = static_cast<std::int32_t>(ws.bounds.size()) - 1;
  if (count == 0) {
    ws.runs[static_cast<std::size_t>(index)].can_refine = false;
    return;
  }
  cut(index, count, ws, [&](std::int32_t k, std::int32_t own, Run& piece) {
    const double begin = double{ws.bounds[static_cast<std::size_t>(k)]};
    const double end = double{ws.bounds[static_cast<std::size_t>(k + 1)]};
    piece.origin = origin + begin;
    piece.step = (end - begin) / piece_intervals;
    ws.new_pieces.push_back(own);
  });
}

void AdaptiveSampler::slice(std::size_t i, Workspace& ws) const {
  const Level& old = ws.level;
  Level& merged = ws.merged;
  const std::int32_t fours = (old.count[i] - 1) / 4;
  const std::int32_t pieces = (fours + piece_intervals / 4 - 1) / (piece_intervals / 4);
  cut(old.run[i], pieces, ws, [&](std::int32_t k, std::int32_t own, Run& piece) {
    const std::int32_t first = 4 * (k * fours / pieces), last = 4 * ((k + 1) * fours / pieces);
    piece.is_slice = true;
    ws.slices.push_back({old.first[i] + first, merged.size, last - first + 1});
    merged.add_integral(own, piece, merged.size, last - first + 1, 0);
    merged.size += last - first + 1;
  });
}

void AdaptiveSampler::begin_level(Workspace& ws) const {
  ws.map.measure();
  Level& level = ws.level;
  level.clear();
  ws.pieces.clear();
  ws.new_pieces.clear();
  ws.starts.clear();
  ws.results = ws.runs.size();
  constexpr int run_bits = 28, pair_bits = 13;
  static_assert((most_first_nodes - 1) / 2 < 1 << pair_bits);
  const std::size_t whole_runs = ws.runs.size();
  for (std::size_t r = 0; r < whole_runs; ++r) {
    const Accuracy& accuracy = medium_.accuracy();
    const double distance =
        accuracy.first_step * (ws.runs[r].shares_pixel ? accuracy.shared_step : 1);
    const double pairs = std::ceil(0.5 * ws.map.length(r) / distance);
    if (2 * pairs + 1 > most_first_nodes) {
      const double pieces = std::min(std::ceil(2 * pairs / piece_intervals), 0.5 * most_pieces);
      const auto run = static_cast<std::int32_t>(r), first = 0;
      const auto count = static_cast<std::int32_t>(pieces) + 1;
      const auto step = static_cast<float>(ws.map.length(r) / pieces);
      ws.bounds.resize(static_cast<std::size_t>(count));
      ws.no_weights.resize(ws.bounds.size());
      ws.map.place({std::span(&run, 1), std::span(&first, 1), std::span(&count, 1),
                    std::span(&step, 1), 0.0f, ws.bounds.data(), ws.no_weights.data()});
      cut_anew(run, ws);
      continue;
    }
    const auto cover = static_cast<std::uint64_t>(ws.runs[r].cover);
    const auto kept = static_cast<std::uint64_t>(std::max(pairs, 0.5 * (fewest_nodes - 1)));
    ws.starts.push_back((cover << pair_bits | kept) << run_bits | r);
  }
  // A galaxy's nodes together, and runs that share vectors of about the same length.
  std::sort(ws.starts.begin(), ws.starts.end());
  for (const std::uint64_t start : ws.starts) {
    const std::size_t run = start & ((std::uint64_t{1} << run_bits) - 1);
    const auto count =
        2 * static_cast<std::int32_t>(start >> run_bits & ((1 << pair_bits) - 1)) + 1;
    level.add(static_cast<std::int32_t>(run), ws.runs[run], count,
              ws.map.length(run) / (count - 1));
  }
  level.make_room();
  ws.map.place({level.run, level.first, level.count, level.step, 0.0f, level.nodes.s.data(),
                level.weight.data()});
}

void AdaptiveSampler::evaluate(std::span<const std::span<const Hit>> hits, Level& level,
                               Workspace& ws, RenderCounts& counts) const {
  medium_.evaluate(hits, ws.covers, level.variants, level.nodes, counts);
  counts.nodes += level.nodes.size();
}

void AdaptiveSampler::merge(Level& known, Workspace& ws) const {
  const Level& fresh = ws.fresh;
  Level& merged = ws.merged;
  const auto interleave = [&](const auto& even, const auto& odd, auto& out) {
    for (const Source& source : ws.sources) {
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
  // A level that holds no runs may lack room for their slots.
  known.nodes.make_room(ws.light_slots, ws.dust_slots, merged.variants);
  merged.nodes.make_room(ws.light_slots, ws.dust_slots, merged.variants);
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    interleave(known.nodes.light[slot], fresh.nodes.light[slot], merged.nodes.light[slot]);
  }
  for (std::size_t k = 0; k < merged.variants * ws.dust_slots; ++k) {
    interleave(known.nodes.dust[k], fresh.nodes.dust[k], merged.nodes.dust[k]);
  }
}

void AdaptiveSampler::refine_runs(std::span<const std::span<const Hit>> hits, Workspace& ws,
                                  RenderCounts& counts) const {
  Level& old = ws.level;
  Level& fresh = ws.fresh;
  Level& merged = ws.merged;
  fresh.clear();
  merged.clear();
  ws.sources.clear();
  for (std::size_t i = 0; i < old.run.size(); ++i) {
    Run& run = ws.runs[static_cast<std::size_t>(old.run[i])];
    if (run.is_piece) continue;
    run.can_refine = run.refine;
    if (!run.refine) continue;
    const std::int32_t intervals = old.count[i] - 1;
    ws.sources.push_back({old.first[i], fresh.size, merged.size, intervals});
    fresh.add(old.run[i], run, intervals, double{old.step[i]});
    merged.add(old.run[i], run, 2 * intervals + 1, 0.5 * double{old.step[i]});
  }
  fresh.make_room();
  merged.make_room();
  ws.map.place({fresh.run, fresh.first, fresh.count, fresh.step, 0.5f, fresh.nodes.s.data(),
                fresh.weight.data()});
  evaluate(hits, fresh, ws, counts);
  merge(old, ws);
  std::swap(ws.level, ws.merged);
}

void AdaptiveSampler::refine_pieces(std::span<const std::span<const Hit>> hits, Workspace& ws,
                                    RenderCounts& counts) const {
  Level& old = ws.pieces;
  Level& fresh = ws.fresh;
  Level& merged = ws.merged;
  fresh.clear();
  merged.clear();
  ws.sources.clear();
  ws.slices.clear();
  for (std::size_t i = 0; i < old.run.size(); ++i) {
    const auto first_half = static_cast<std::size_t>(old.run[i]);
    ws.runs[first_half].can_refine = ws.runs[first_half].refine;
    if (!ws.runs[first_half].refine) continue;
    if (ws.runs[first_half].is_slice) {
      const float* const s = old.nodes.s.data() + old.first[i];
      const std::int32_t last = old.count[i] - 1;
      ws.bounds = {s[0], s[last / 2], s[last]};
      cut_anew(old.run[i], ws);
      continue;
    }
    ws.sources.push_back({old.first[i], fresh.size, merged.size, piece_intervals});
    fresh.add(old.run[i], ws.runs[first_half], piece_intervals, ws.runs[first_half].step);
    const auto behind = static_cast<std::int32_t>(ws.runs.size());
    Run second = ws.runs[first_half];
    second.step *= 0.5;
    ++second.halvings;
    Run first = second;
    second.origin += piece_intervals * second.step;
    second.continues = true;
    second.result = static_cast<std::int32_t>(ws.results);
    ws.results += static_cast<std::size_t>(second.results());
    first.next = behind;
    ++ws.pieces_of_ray[static_cast<std::size_t>(first.ray)];
    merged.add_integral(old.run[i], first, merged.size, piece_intervals + 1, first.step);
    merged.add_integral(behind, second, merged.size + piece_intervals, piece_intervals + 1,
                        second.step);
    merged.size += 2 * piece_intervals + 1;
    ws.runs[first_half] = first;
    ws.runs.push_back(second);
  }
  const std::size_t refined = ws.sources.size();
  for (const std::int32_t index : ws.new_pieces) {
    const Run& piece = ws.runs[static_cast<std::size_t>(index)];
    ws.sources.push_back({none_known, fresh.size, merged.size, piece_intervals + 1});
    fresh.add(index, piece, piece_intervals + 1, piece.step);
    merged.add_integral(index, piece, merged.size, piece_intervals + 1, piece.step);
    merged.size += piece_intervals + 1;
  }
  ws.new_pieces.clear();
  const std::size_t even = merged.run.size();
  for (std::size_t i = 0; i < ws.level.run.size(); ++i) {
    const Run& run = ws.runs[static_cast<std::size_t>(ws.level.run[i])];
    if (run.refine && !run.is_piece && 2 * ws.level.count[i] - 1 > most_nodes) slice(i, ws);
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
  const auto copy = [&](const auto& from, auto& to) {
    for (const Slice& own : ws.slices) {
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
  std::swap(ws.pieces, ws.merged);
}

void AdaptiveSampler::integrate(const Level& level, std::size_t variant,
                                std::span<const double> weights, const std::uint8_t* has_variants,
                                bool is_first, Workspace& ws) const {
  static_assert(RayNodes::padding >= RunNodes::padding);
  ws.light.clear();
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    ws.light.push_back(level.nodes.light[slot].data());
  }
  ws.dust.clear();
  for (std::size_t k = variant * ws.dust_slots; k < level.nodes.dust.size(); ++k) {
    ws.dust.push_back(level.nodes.dust[k].data());
  }
  const RunNodes runs{level.run.size(),   level.first.data(),  level.count.data(),
                      level.cover.data(), level.open.data(),   level.open_end.data(),
                      has_variants,       level.weight.data(), ws.light.data(),
                      ws.dust.data(),     ws.dust_slots,       weights};
  const RunCovers covers{ws.covers.size(),
                         medium_.nodes(),
                         ws.steering_node,
                         ws.cover_light_slots.data(),
                         ws.cover_dust_slots.data(),
                         ws.extinction.data(),
                         ws.flux.data()};
  order_runs(runs, covers, ws.order);
  integrate_runs(runs, covers, ws.order, is_first,
                 {ws.result.data(), ws.light_slots, ws.run_light.data(), ws.run_depth.data(),
                  ws.run_transmission.data(), ws.steered.data()});
}

void AdaptiveSampler::integrate_runs_of(const Level& level, bool is_first, Workspace& ws) const {
  ws.result = level.result;
  integrate(level, 0, std::span(dust_variant_weights).first(level.variants),
            level.has_variants.data(), is_first, ws);
}

void AdaptiveSampler::integrate_pieces(Workspace& ws) const {
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  ws.run_light.resize(ws.results * ws.light_slots * nodes);
  ws.run_depth.resize(ws.results * nodes);
  ws.run_transmission.resize(ws.results * nodes);
  ws.steered.resize(ws.results * 2 * planes);
  const Level& level = ws.pieces;
  ws.no_variants.assign(level.run.size(), 0);
  static constexpr double alone[] = {1.0};
  for (std::size_t v = level.variants; v-- > 0;) {
    // A piece without variants has one result: the last pass, that of the first variant, counts.
    ws.result.clear();
    for (std::size_t i = 0; i < level.run.size(); ++i) {
      const auto shift = level.has_variants[i] != 0 ? static_cast<std::int32_t>(v) : 0;
      ws.result.push_back(level.result[i] + shift);
    }
    // The first variant steers the refinement.
    integrate(level, v, alone, ws.no_variants.data(), v == 0, ws);
  }
}

bool AdaptiveSampler::judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws,
                            RenderCounts& counts) const {
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  const Accuracy& accuracy = medium_.accuracy();
  const std::int32_t first = ws.first_run[static_cast<std::size_t>(ray)];
  const bool is_full = ws.pieces_of_ray[static_cast<std::size_t>(ray)] >= most_pieces;
  bool any = false, is_within = true;
  for (std::size_t s = 0; s < planes; ++s) {
    const auto light_of = [&](std::int32_t result) -> const Steered& {
      return ws.steered[static_cast<std::size_t>(result) * 2 * planes + s];
    };
    const auto depth_of = [&](std::int32_t result) -> const Steered& {
      return ws.steered[(static_cast<std::size_t>(result) * 2 + 1) * planes + s];
    };
    const auto share_of = [&](std::int32_t result) {
      const std::size_t at = static_cast<std::size_t>(result) * nodes + ws.steering_node[s];
      return double{ws.run_transmission[at]};
    };
    double intensity = 0, depth = 0, count = 0;
    Transmitted transmitted;
    for (std::int32_t r = first; r != no_run; r = ws.runs[static_cast<std::size_t>(r)].next) {
      const Run& run = ws.runs[static_cast<std::size_t>(r)];
      transmitted.enter(run);
      for (std::int32_t v = 0; v < run.results(); ++v) {
        intensity += transmitted.in_front(v) * double{light_of(run.result + v).value};
        transmitted.pass(v, share_of(run.result + v));
      }
      depth += double{depth_of(run.result).value};
      ++count;
    }
    double typical = 0;
    for (const Hit& hit : hits) {
      typical = std::max(typical, medium_.typical_brightness(hit.galaxy, s));
    }
    // An image of thick dust may be far fainter than its galaxy face on.
    const double dimmed = typical * std::exp(-0.5 * std::min(depth, deepest));
    const double scale = std::max(intensity, accuracy.faint_share * dimmed);
    const double allowed =
        accuracy.ray_error * (hits.front().shares_pixel ? accuracy.shared_error : 1) * scale;
    double in_front = 0, square = 0;
    ws.errors.clear();
    transmitted = {};
    for (std::int32_t r = first; r != no_run; r = ws.runs[static_cast<std::size_t>(r)].next) {
      const Run& run = ws.runs[static_cast<std::size_t>(r)];
      transmitted.enter(run);
      double passed = 0;
      for (std::int32_t v = 0; v < run.results(); ++v) {
        const double share = transmitted.in_front(v);
        passed += share;
        in_front += share * double{light_of(run.result + v).value};
        transmitted.pass(v, share_of(run.result + v));
      }
      // An error of depth dims all the light behind. All variants err as the first one does.
      const double error = passed * light_of(run.result).error(scale, run.has_texture) +
                           (intensity - in_front) * depth_of(run.result).error(1, run.has_texture);
      ws.errors.push_back(error);
      square += error * error;
    }
    if (square <= allowed * allowed) continue;
    is_within = false;
    std::size_t i = 0;
    for (std::int32_t r = first; r != no_run; r = ws.runs[static_cast<std::size_t>(r)].next) {
      Run& run = ws.runs[static_cast<std::size_t>(r)];
      if (ws.errors[i++] <= allowed / std::sqrt(count) || !run.can_refine) continue;
      const bool is_bound = run.is_piece && (is_full || run.halvings >= most_halvings);
      if (!is_bound) run.refine = any = true;
    }
  }
  if (!any && !is_within) ++counts.unconverged_rays;
  return any;
}

void AdaptiveSampler::sum_up(std::span<const std::span<const Hit>> hits, Workspace& ws,
                             RayLight& out) const {
  const std::size_t nodes = medium_.nodes();
  for (std::size_t ray = 0; ray < hits.size(); ++ray) {
    ws.transmitted.assign(nodes, {});
    double* depth = out.depth.data() + ray * nodes;
    for (std::int32_t r = ws.first_run[ray]; r != no_run;
         r = ws.runs[static_cast<std::size_t>(r)].next) {
      const Run& run = ws.runs[static_cast<std::size_t>(r)];
      if (!run.continues) {
        medium_.places(out, ray, ws.covers[static_cast<std::size_t>(run.cover)], ws.places);
      }
      for (Transmitted& transmitted : ws.transmitted) transmitted.enter(run);
      for (std::int32_t v = 0; v < run.results(); ++v) {
        const auto result = static_cast<std::size_t>(run.result + v);
        for (std::size_t slot = 0; slot < ws.places.size(); ++slot) {
          double* sum = out.light.data() + ws.places[slot];
          const float* light = ws.run_light.data() + (result * ws.light_slots + slot) * nodes;
          for (std::size_t j = 0; j < nodes; ++j) {
            sum[j] += ws.transmitted[j].in_front(v) * double{light[j]};
          }
        }
        const double share =
            run.results() > 1 ? dust_variant_weights[static_cast<std::size_t>(v)] : 1;
        for (std::size_t j = 0; j < nodes; ++j) {
          depth[j] += share * double{ws.run_depth[result * nodes + j]};
          ws.transmitted[j].pass(v, double{ws.run_transmission[result * nodes + j]});
        }
      }
    }
  }
}

void AdaptiveSampler::integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                                RenderCounts& counts) const {
  const DenormalsAreZero mode;
  const Clock clock;
  const double evaluating = counts.noise_seconds + counts.envelope_seconds;
  Workspace& ws = workspace();
  ws.runs.clear();
  ws.map.clear();
  ws.covers.clear();
  ws.cover_of.clear();
  ws.first_run.assign(hits.size(), no_run);
  ws.pieces_of_ray.assign(hits.size(), 0);
  ws.active.clear();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    find_runs(hits[i], static_cast<std::int32_t>(i), ws);
    if (ws.first_run[i] != no_run) ws.active.push_back(static_cast<std::int32_t>(i));
  }
  out.prepare(medium_, hits);
  counts.rays += hits.size();
  if (ws.active.empty()) return;
  describe_covers(ws);
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  begin_level(ws);
  ws.run_light.resize(ws.results * ws.light_slots * nodes);
  ws.run_depth.resize(ws.results * nodes);
  ws.run_transmission.resize(ws.results * nodes);
  ws.steered.resize(ws.results * 2 * planes);
  evaluate(hits, ws.level, ws, counts);
  integrate_runs_of(ws.level, true, ws);
  if (!ws.new_pieces.empty()) {
    refine_pieces(hits, ws, counts);
    integrate_pieces(ws);
  }
  while (true) {
    for (Run& run : ws.runs) run.refine = false;
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
    refine_runs(hits, ws, counts);
    integrate_runs_of(ws.level, false, ws);
  }
  sum_up(hits, ws, out);
  counts.transfer_seconds +=
      clock.seconds() - (counts.noise_seconds + counts.envelope_seconds - evaluating);
}

}  // namespace

std::unique_ptr<Sampler> make_adaptive_sampler(const Medium& medium) {
  return std::make_unique<AdaptiveSampler>(medium);
}

}  // namespace gamer
