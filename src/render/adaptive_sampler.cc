#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "core/denormals.h"
#include "gamer/core/clock.h"
#include "gamer/render/sampler.h"
#include "render/node_map.h"
#include "render/ray_integral.h"

namespace gamer {

namespace {

// Nodes of a run at least, so that every second one still makes a cubic, and at most.
constexpr std::int32_t fewest_nodes = 9;
constexpr std::int32_t most_nodes = (1 << 13) + 1;

constexpr std::int32_t no_run = -1;

/// The stretch of a ray that a galaxy fills, and how.
struct Part {
  Hit hit;
  double begin, end;
  bool has_variants;
  std::vector<Focus> focuses;
};

/// A stretch of a ray that overlapping galaxies fill.
struct Run {
  std::int32_t ray;
  std::int32_t cover;
  std::int32_t next;  ///< behind it on the ray
  double origin;      ///< of the map's s, along the ray
  bool open;          ///< whether it begins inside a galaxy
  bool has_variants;  ///< see dust_variants.h
  bool can_refine;
  bool refine;
};

/// Nodes of runs, all at the same level of refinement, and what fills them.
struct Level {
  std::vector<std::int32_t> run, first, count, cover;
  std::vector<std::uint8_t> open, has_variants;
  std::vector<float> step;  ///< between nodes, in the map's u
  std::vector<float> weight;
  RayNodes nodes;
  std::size_t variants = 1;
  std::int32_t size = 0;

  void clear() {
    variants = 1;
    size = 0;
    for (auto* values : {&run, &first, &count, &cover}) values->clear();
    open.clear();
    has_variants.clear();
    step.clear();
    weight.clear();
    nodes.clear();
  }
  /// Adds a run, whose nodes are to be filled in after make_room().
  void add(std::int32_t index, const Run& own, std::int32_t nodes_of_run, double distance) {
    run.push_back(index);
    first.push_back(size);
    count.push_back(nodes_of_run);
    cover.push_back(own.cover);
    open.push_back(own.open ? 1 : 0);
    has_variants.push_back(own.has_variants ? 1 : 0);
    step.push_back(static_cast<float>(distance));
    size += nodes_of_run;
    nodes.runs.push_back({own.ray, own.cover, first.back(), nodes_of_run, own.origin});
    if (own.has_variants) variants = dust_deviations.size();
  }
  void make_room() {
    nodes.s.resize(static_cast<std::size_t>(size));
    weight.resize(static_cast<std::size_t>(size) + RunNodes::padding);
  }
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
  Level level, fresh, merged;

  /// Of the covers, as RunCovers has it.
  std::vector<std::int32_t> cover_light_slots, cover_dust_slots;
  std::vector<float> extinction, flux;
  std::vector<std::size_t> steering_node;
  std::size_t light_slots = 0, dust_slots = 0;
  std::vector<const float*> light, dust;
  std::vector<std::uint32_t> order;  ///< of the level's runs

  /// Of every run, at its level, what integrate_runs() gives.
  std::vector<float> run_light, run_depth, run_transmission;
  std::vector<Steered> steered;
  std::vector<std::int32_t> active, still_active;
  std::vector<double> transmitted;
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
  /// The same runs with twice the nodes, where they are to be refined.
  void refine_level(std::span<const std::span<const Hit>> hits, Workspace& ws,
                    RenderCounts& counts) const;
  void evaluate(std::span<const std::span<const Hit>> hits, Level& level, Workspace& ws,
                RenderCounts& counts) const;
  void integrate_level(bool is_first, Workspace& ws) const;
  /// Marks the runs of a ray that need more nodes; false when none.
  bool judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const;
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
    bool has_variants = false;
    std::size_t behind = i;
    ws.run_hits.clear();
    while (behind < ws.part_order.size() &&
           (behind == i || ws.parts[ws.part_order[behind]].begin < end)) {
      const Part& part = ws.parts[ws.part_order[behind++]];
      end = std::max(end, part.end);
      has_variants = has_variants || part.has_variants;
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
    ws.runs.push_back(
        {ray, find_cover(ws), no_run, origin, !(begin > 0), has_variants, true, false});
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

void AdaptiveSampler::begin_level(Workspace& ws) const {
  ws.map.measure();
  Level& level = ws.level;
  level.clear();
  ws.starts.clear();
  constexpr int run_bits = 28, pair_bits = 13;
  static_assert((most_nodes - 1) / 2 < 1 << pair_bits);
  for (std::size_t r = 0; r < ws.runs.size(); ++r) {
    const double pairs =
        std::clamp(std::ceil(0.5 * ws.map.length(r) / medium_.accuracy().first_step),
                   0.5 * (fewest_nodes - 1), 0.5 * (most_nodes - 1));
    const auto cover = static_cast<std::uint64_t>(ws.runs[r].cover);
    ws.starts.push_back((cover << pair_bits | static_cast<std::uint64_t>(pairs)) << run_bits | r);
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

void AdaptiveSampler::refine_level(std::span<const std::span<const Hit>> hits, Workspace& ws,
                                   RenderCounts& counts) const {
  const Level& old = ws.level;
  Level& fresh = ws.fresh;
  Level& merged = ws.merged;
  fresh.clear();
  merged.clear();
  std::vector<std::size_t> sources;
  for (std::size_t i = 0; i < old.run.size(); ++i) {
    Run& run = ws.runs[static_cast<std::size_t>(old.run[i])];
    run.can_refine = run.refine && 4 * old.count[i] - 3 <= most_nodes;
    if (!run.refine) continue;
    sources.push_back(i);
    fresh.add(old.run[i], run, old.count[i] - 1, double{old.step[i]});
    merged.add(old.run[i], run, 2 * old.count[i] - 1, 0.5 * double{old.step[i]});
  }
  fresh.make_room();
  merged.make_room();
  ws.map.place({fresh.run, fresh.first, fresh.count, fresh.step, 0.5f, fresh.nodes.s.data(),
                fresh.weight.data()});
  evaluate(hits, fresh, ws, counts);
  const auto interleave = [&](const auto& even, const auto& odd, auto& out) {
    for (std::size_t k = 0; k < sources.size(); ++k) {
      const auto* from = even.data() + old.first[sources[k]];
      const auto* between = odd.data() + fresh.first[k];
      auto* to = out.data() + merged.first[k];
      for (std::int32_t n = 0; n < fresh.count[k]; ++n) {
        to[2 * n] = from[n];
        to[2 * n + 1] = between[n];
      }
      to[2 * fresh.count[k]] = from[fresh.count[k]];
    }
  };
  interleave(old.nodes.s, fresh.nodes.s, merged.nodes.s);
  interleave(old.weight, fresh.weight, merged.weight);
  for (float& weight : merged.weight) weight *= 0.5f;
  merged.nodes.make_room(ws.light_slots, ws.dust_slots, merged.variants);
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    interleave(old.nodes.light[slot], fresh.nodes.light[slot], merged.nodes.light[slot]);
  }
  for (std::size_t k = 0; k < merged.variants * ws.dust_slots; ++k) {
    interleave(old.nodes.dust[k], fresh.nodes.dust[k], merged.nodes.dust[k]);
  }
  std::swap(ws.level, ws.merged);
}

void AdaptiveSampler::integrate_level(bool is_first, Workspace& ws) const {
  static_assert(RayNodes::padding >= RunNodes::padding);
  const Level& level = ws.level;
  ws.light.clear();
  for (std::size_t slot = 0; slot < ws.light_slots; ++slot) {
    ws.light.push_back(level.nodes.light[slot].data());
  }
  ws.dust.clear();
  for (const auto& dust : level.nodes.dust) ws.dust.push_back(dust.data());
  const RunNodes runs{level.run.size(),
                      level.first.data(),
                      level.count.data(),
                      level.cover.data(),
                      level.open.data(),
                      level.has_variants.data(),
                      level.weight.data(),
                      ws.light.data(),
                      ws.dust.data(),
                      ws.dust_slots,
                      std::span(dust_variant_weights).first(level.variants)};
  const RunCovers covers{ws.covers.size(),
                         medium_.nodes(),
                         ws.steering_node,
                         ws.cover_light_slots.data(),
                         ws.cover_dust_slots.data(),
                         ws.extinction.data(),
                         ws.flux.data()};
  order_runs(runs, covers, ws.order);
  integrate_runs(runs, covers, ws.order, is_first,
                 {level.run.data(), ws.light_slots, ws.run_light.data(), ws.run_depth.data(),
                  ws.run_transmission.data(), ws.steered.data()});
}

bool AdaptiveSampler::judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const {
  const std::size_t planes = ws.steering_node.size(), nodes = medium_.nodes();
  const Accuracy& accuracy = medium_.accuracy();
  bool any = false;
  for (std::size_t s = 0; s < planes; ++s) {
    double intensity = 0, transmitted = 1, count = 0;
    for (std::int32_t r = ws.first_run[static_cast<std::size_t>(ray)]; r != no_run;
         r = ws.runs[static_cast<std::size_t>(r)].next) {
      const auto run = static_cast<std::size_t>(r);
      intensity += transmitted * double{ws.steered[run * 2 * planes + s].value};
      transmitted *= double{ws.run_transmission[run * nodes + ws.steering_node[s]]};
      ++count;
    }
    double typical = 0;
    for (const Hit& hit : hits) {
      typical = std::max(typical, medium_.typical_brightness(hit.galaxy, s));
    }
    const double scale = std::max(intensity, accuracy.faint_share * typical);
    const double allowed = accuracy.ray_error * scale / std::sqrt(count);
    double in_front = 0;
    transmitted = 1;
    for (std::int32_t r = ws.first_run[static_cast<std::size_t>(ray)]; r != no_run;
         r = ws.runs[static_cast<std::size_t>(r)].next) {
      const auto run = static_cast<std::size_t>(r);
      const Steered& light = ws.steered[run * 2 * planes + s];
      const Steered& depth = ws.steered[(run * 2 + 1) * planes + s];
      in_front += transmitted * double{light.value};
      // An error of depth dims all the light behind.
      const double error =
          transmitted * light.error(scale) + (intensity - in_front) * depth.error(1);
      transmitted *= double{ws.run_transmission[run * nodes + ws.steering_node[s]]};
      if (error > allowed && ws.runs[run].can_refine) ws.runs[run].refine = any = true;
    }
  }
  return any;
}

void AdaptiveSampler::sum_up(std::span<const std::span<const Hit>> hits, Workspace& ws,
                             RayLight& out) const {
  const std::size_t nodes = medium_.nodes();
  for (std::size_t ray = 0; ray < hits.size(); ++ray) {
    ws.transmitted.assign(nodes, 1.0);
    double* depth = out.depth.data() + ray * nodes;
    for (std::int32_t r = ws.first_run[ray]; r != no_run;
         r = ws.runs[static_cast<std::size_t>(r)].next) {
      const auto run = static_cast<std::size_t>(r);
      medium_.places(out, ray, ws.covers[static_cast<std::size_t>(ws.runs[run].cover)], ws.places);
      for (std::size_t slot = 0; slot < ws.places.size(); ++slot) {
        double* sum = out.light.data() + ws.places[slot];
        const float* light = ws.run_light.data() + (run * ws.light_slots + slot) * nodes;
        for (std::size_t j = 0; j < nodes; ++j) sum[j] += ws.transmitted[j] * double{light[j]};
      }
      for (std::size_t j = 0; j < nodes; ++j) {
        depth[j] += double{ws.run_depth[run * nodes + j]};
        ws.transmitted[j] *= double{ws.run_transmission[run * nodes + j]};
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
  ws.run_light.resize(ws.runs.size() * ws.light_slots * nodes);
  ws.run_depth.resize(ws.runs.size() * nodes);
  ws.run_transmission.resize(ws.runs.size() * nodes);
  ws.steered.resize(ws.runs.size() * 2 * planes);
  begin_level(ws);
  evaluate(hits, ws.level, ws, counts);
  integrate_level(true, ws);
  while (true) {
    for (Run& run : ws.runs) run.refine = false;
    ws.still_active.clear();
    for (const std::int32_t ray : ws.active) {
      if (judge(hits[static_cast<std::size_t>(ray)], ray, ws)) ws.still_active.push_back(ray);
    }
    std::swap(ws.active, ws.still_active);
    if (ws.active.empty()) break;
    refine_level(hits, ws, counts);
    integrate_level(false, ws);
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
