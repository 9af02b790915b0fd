#include "gamer/render/sampler.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/adaptive_sampler.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/math-inl.h"

#ifndef GAMER_RENDER_PANELS
#define GAMER_RENDER_PANELS
namespace gamer {
namespace {

constexpr int panel_nodes = 5;

/// A run of panels, and what fills them; arrays over panels are padded.
struct PanelRun {
  const std::int32_t* node[panel_nodes];  ///< of each panel
  const float* spacing;                   ///< a quarter of the panel's length
  const std::int32_t* cover;
  const float* const* light;  ///< [slot][node]
  const float* const* dust;
  std::size_t light_slots;
  std::size_t dust_slots;
  /// Nodes of the run's slots, gathered: (slots * panel_nodes) vectors.
  float* gathered;
};

/// What steers the refinement: one plane of a run.
struct SteeringPlane {
  const float* flux;        ///< [slot * covers + cover]
  const float* extinction;  ///< [slot * covers + cover]
  float* light;             ///< int j exp(-tau) ds from the panel's near end
  float* light_error;
  float* depth;  ///< int kappa ds
  float* depth_error;
  float* transmission;  ///< exp(-depth)
};

/// What a run of panels becomes at each spectral node.
struct PanelResults {
  const float* extinction;  ///< [(slot * nodes + j) * covers + cover]
  std::size_t nodes;
  std::size_t stride;   ///< panels between the arrays below
  float* depth;         ///< [j * stride + panel]
  float* transmission;  ///< [j * stride + panel]
  float* light;         ///< [(slot * nodes + j) * stride + panel]
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

/// Values at a panel's nodes.
struct Five {
  V v0, v1, v2, v3, v4;
};

HWY_INLINE Five Gather(const float* values, const PanelRun& run, std::size_t i) {
  const D d;
  const hn::RebindToSigned<D> di;
  const auto at = [&](int n) HWY_ATTR {
    return hn::GatherIndex(d, values, hn::LoadU(di, run.node[n] + i));
  };
  return {at(0), at(1), at(2), at(3), at(4)};
}

HWY_INLINE void Keep(const Five& f, float* to) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  hn::StoreU(f.v0, d, to);
  hn::StoreU(f.v1, d, to + lanes);
  hn::StoreU(f.v2, d, to + 2 * lanes);
  hn::StoreU(f.v3, d, to + 3 * lanes);
  hn::StoreU(f.v4, d, to + 4 * lanes);
}

HWY_INLINE Five Kept(const float* from) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  return {hn::LoadU(d, from), hn::LoadU(d, from + lanes), hn::LoadU(d, from + 2 * lanes),
          hn::LoadU(d, from + 3 * lanes), hn::LoadU(d, from + 4 * lanes)};
}

HWY_INLINE Five Zeroes() {
  const D d;
  const V zero = hn::Zero(d);
  return {zero, zero, zero, zero, zero};
}

/// sum + factor * a.
HWY_INLINE Five AddScaled(const Five& sum, V factor, const Five& a) {
  return {hn::MulAdd(factor, a.v0, sum.v0), hn::MulAdd(factor, a.v1, sum.v1),
          hn::MulAdd(factor, a.v2, sum.v2), hn::MulAdd(factor, a.v3, sum.v3),
          hn::MulAdd(factor, a.v4, sum.v4)};
}

HWY_INLINE V Largest(const Five& a) {
  return hn::Max(hn::Max(hn::Max(a.v0, a.v1), hn::Max(a.v2, a.v3)), a.v4);
}

/// Boole's rule, in units of the spacing; summed as IntegratePanels does it behind dust, so that a
/// panel's light does not depend on those beside it.
HWY_INLINE V Boole(const Five& a) {
  const D d;
  const auto outer = hn::Set(d, 14.0f / 45), inner = hn::Set(d, 64.0f / 45);
  return hn::MulAdd(outer, a.v4,
                    hn::MulAdd(inner, a.v3,
                               hn::MulAdd(hn::Set(d, 24.0f / 45), a.v2,
                                          hn::MulAdd(inner, a.v1, hn::Mul(outer, a.v0)))));
}

HWY_INLINE V FourthDifference(const Five& a) {
  const D d;
  return hn::MulAdd(hn::Set(d, 4.0f), hn::Add(a.v1, a.v3),
                    hn::NegMulAdd(hn::Set(d, 6.0f), a.v2, hn::Neg(hn::Add(a.v0, a.v4))));
}

/// Integrals of the quartic through five values up to nodes 1, 2, 3 and 4, in units of the spacing.
struct UpTo {
  V v1, v2, v3, v4;
};

HWY_INLINE UpTo Integrals(const Five& k) {
  const D d;
  const auto row = [&](float a, float b, float c, float e, float f, float divisor) HWY_ATTR {
    return hn::MulAdd(hn::Set(d, a / divisor), k.v0,
                      hn::MulAdd(hn::Set(d, b / divisor), k.v1,
                                 hn::MulAdd(hn::Set(d, c / divisor), k.v2,
                                            hn::MulAdd(hn::Set(d, e / divisor), k.v3,
                                                       hn::Mul(hn::Set(d, f / divisor), k.v4)))));
  };
  return {row(251, 646, -264, 106, -19, 720), row(29, 124, 24, 4, -1, 90),
          row(27, 102, 72, 42, -3, 80), Boole(k)};
}

/// exp(-tau), tau at least 0.
HWY_INLINE V Fade(V tau) {
  const D d;
  return Exp(d, hn::Neg(hn::Max(tau, hn::Zero(d))));
}

HWY_INLINE void GatherSlots(const PanelRun& run, std::size_t i) {
  const D d;
  const std::size_t size = panel_nodes * hn::Lanes(d);
  float* to = run.gathered;
  for (std::size_t slot = 0; slot < run.light_slots; ++slot, to += size) {
    Keep(Gather(run.light[slot], run, i), to);
  }
  for (std::size_t slot = 0; slot < run.dust_slots; ++slot, to += size) {
    Keep(Gather(run.dust[slot], run, i), to);
  }
}

/// Boole's rule over five equally spaced nodes, with optical depths up to each node from the
/// quartic through all five; the error estimate is the difference to two Simpson rules, that is
/// h/45 times the fourth difference.
void SteerPanels(const PanelRun& run, const SteeringPlane* planes, std::size_t plane_count,
                 std::size_t covers, std::size_t size) {
  const D d;
  const hn::RebindToSigned<D> di;
  const std::size_t five = panel_nodes * hn::Lanes(d);
  const auto zero = hn::Zero(d);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    GatherSlots(run, i);
    const auto h = hn::LoadU(d, run.spacing + i);
    const auto cover = hn::LoadU(di, run.cover + i);
    const auto error_scale = hn::Mul(h, hn::Set(d, 1.0f / 45));
    for (std::size_t p = 0; p < plane_count; ++p) {
      const SteeringPlane& plane = planes[p];
      const float* from = run.gathered;
      Five f = Zeroes(), k = Zeroes();
      for (std::size_t slot = 0; slot < run.light_slots; ++slot, from += five) {
        f = AddScaled(f, hn::GatherIndex(d, plane.flux + slot * covers, cover), Kept(from));
      }
      for (std::size_t slot = 0; slot < run.dust_slots; ++slot, from += five) {
        k = AddScaled(k, hn::GatherIndex(d, plane.extinction + slot * covers, cover), Kept(from));
      }
      const auto dusty = Largest(k);
      auto depth = zero;
      auto depth_error = zero;
      auto transmission = hn::Set(d, 1.0f);
      if (!hn::AllFalse(d, hn::Gt(dusty, zero))) {
        const UpTo tau = Integrals(k);
        f.v1 = hn::Mul(f.v1, Fade(hn::Mul(h, tau.v1)));
        f.v2 = hn::Mul(f.v2, Fade(hn::Mul(h, tau.v2)));
        f.v3 = hn::Mul(f.v3, Fade(hn::Mul(h, tau.v3)));
        depth = hn::Mul(h, tau.v4);
        transmission = Fade(depth);
        f.v4 = hn::Mul(f.v4, transmission);
        depth_error = hn::Mul(error_scale, hn::Abs(FourthDifference(k)));
      }
      hn::StoreU(hn::Mul(h, Boole(f)), d, plane.light + i);
      hn::StoreU(hn::Mul(error_scale, hn::Abs(FourthDifference(f))), d, plane.light_error + i);
      hn::StoreU(depth, d, plane.depth + i);
      hn::StoreU(depth_error, d, plane.depth_error + i);
      hn::StoreU(transmission, d, plane.transmission + i);
    }
  }
}

/// The same rule for every light slot and spectral node.
void IntegratePanels(const PanelRun& run, const PanelResults& out, std::size_t covers,
                     std::size_t size) {
  const D d;
  const hn::RebindToSigned<D> di;
  const std::size_t five = panel_nodes * hn::Lanes(d);
  const auto zero = hn::Zero(d);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    GatherSlots(run, i);
    const auto h = hn::LoadU(d, run.spacing + i);
    const auto cover = hn::LoadU(di, run.cover + i);
    float* dust = run.gathered + run.light_slots * five;
    auto dusty = zero;
    for (std::size_t slot = 0; slot < run.dust_slots; ++slot) {
      // Depths up to the nodes replace the opacities.
      const Five k = Kept(dust + slot * five);
      dusty = hn::Max(dusty, Largest(k));
      const UpTo tau = Integrals(k);
      Keep({zero, hn::Mul(h, tau.v1), hn::Mul(h, tau.v2), hn::Mul(h, tau.v3), hn::Mul(h, tau.v4)},
           dust + slot * five);
    }
    const bool is_clear = hn::AllFalse(d, hn::Gt(dusty, zero));
    for (std::size_t slot = 0; slot < run.light_slots && is_clear; ++slot) {
      const auto light = hn::Mul(h, Boole(Kept(run.gathered + slot * five)));
      for (std::size_t j = 0; j < out.nodes; ++j) {
        hn::StoreU(light, d, out.light + (slot * out.nodes + j) * out.stride + i);
      }
    }
    for (std::size_t j = 0; j < out.nodes; ++j) {
      if (is_clear) {
        hn::StoreU(zero, d, out.depth + j * out.stride + i);
        hn::StoreU(hn::Set(d, 1.0f), d, out.transmission + j * out.stride + i);
        continue;
      }
      Five tau = Zeroes();
      for (std::size_t slot = 0; slot < run.dust_slots; ++slot) {
        const auto relative =
            hn::GatherIndex(d, out.extinction + (slot * out.nodes + j) * covers, cover);
        tau = AddScaled(tau, relative, Kept(dust + slot * five));
      }
      const auto e1 = hn::Mul(hn::Set(d, 64.0f / 45), Fade(tau.v1));
      const auto e2 = hn::Mul(hn::Set(d, 24.0f / 45), Fade(tau.v2));
      const auto e3 = hn::Mul(hn::Set(d, 64.0f / 45), Fade(tau.v3));
      const auto transmission = Fade(tau.v4);
      const auto e4 = hn::Mul(hn::Set(d, 14.0f / 45), transmission);
      hn::StoreU(tau.v4, d, out.depth + j * out.stride + i);
      hn::StoreU(transmission, d, out.transmission + j * out.stride + i);
      for (std::size_t slot = 0; slot < run.light_slots; ++slot) {
        const Five f = Kept(run.gathered + slot * five);
        const auto sum = hn::MulAdd(
            e4, f.v4,
            hn::MulAdd(
                e3, f.v3,
                hn::MulAdd(e2, f.v2, hn::MulAdd(e1, f.v1, hn::Mul(hn::Set(d, 14.0f / 45), f.v0)))));
        hn::StoreU(hn::Mul(h, sum), d, out.light + (slot * out.nodes + j) * out.stride + i);
      }
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SteerPanels);
HWY_EXPORT(IntegratePanels);

namespace {

// Halvings of a first panel at most: beyond, single precision has nothing left to refine.
constexpr int deepest_level = 20;

// Panels whose results for all slots and spectral nodes are kept at a time.
constexpr std::size_t panels_at_once = 256;

// Vectors have at most this many floats.
constexpr std::size_t most_lanes = 64;

constexpr std::int32_t no_panel = -1;

/// The panels of a set of rays, as arrays; every array is padded to whole vectors.
struct Panels {
  std::vector<std::int32_t> node[panel_nodes];
  std::vector<float> spacing;
  std::vector<std::int32_t> cover;
  std::vector<double> begin, end;
  std::vector<std::int32_t> next;  ///< the panel behind it on its ray
  std::vector<std::uint8_t> level;
  /// Per steering plane.
  std::vector<std::vector<float>> light, light_error, depth, depth_error, transmission;

  std::size_t size() const { return begin.size(); }

  void clear(std::size_t planes) {
    for (auto& n : node) n.clear();
    spacing.clear();
    cover.clear();
    begin.clear();
    end.clear();
    next.clear();
    level.clear();
    for (auto* results : {&light, &light_error, &depth, &depth_error, &transmission}) {
      results->resize(planes);
    }
  }

  std::int32_t add(double from, double to, std::int32_t cover_index,
                   std::uint8_t depth_of_refinement) {
    cover.push_back(cover_index);
    begin.push_back(from);
    end.push_back(to);
    spacing.push_back(static_cast<float>((to - from) / (panel_nodes - 1)));
    next.push_back(no_panel);
    level.push_back(depth_of_refinement);
    for (auto& n : node) n.push_back(0);
    return static_cast<std::int32_t>(size() - 1);
  }
};

/// Arrays of one thread, kept between calls.
struct Workspace {
  RayNodes nodes;
  Panels panels, kept;
  Marks marks;
  std::vector<double> edges;
  std::vector<std::int32_t> first_panel;  ///< of each ray
  std::vector<std::int32_t> leaves;
  std::vector<std::int32_t> still_active, active;
  std::vector<std::uint8_t> refine;
  /// Of each leaf: the transmission in front of it and the light up to its end.
  std::vector<double> in_front;
  /// Of the covers: [plane][slot][cover] and [slot][spectral node][cover].
  std::vector<float> steering_flux, steering_extinction, extinction;
  std::vector<const float*> light_slots, dust_slots;
  std::vector<float> gathered;
  std::vector<float> depth, transmission, light;  ///< PanelResults
  std::vector<double> transmitted;                ///< of each spectral node
  std::vector<std::size_t> places;                ///< Medium::places() of a cover
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
  void cut_ray(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const;
  /// Index of the cover at t, a new one where it is not known; none where nothing covers it.
  std::int32_t find_cover(std::span<const Hit> hits, double t, RayNodes& nodes) const;
  /// Tabulates what the covers' slots do.
  void describe_covers(Workspace& ws) const;
  PanelRun run_of(std::size_t first, std::size_t size, Workspace& ws) const;
  void steer(std::size_t first, Workspace& ws) const;
  /// Marks the panels of a ray that must be halved; false when none.
  bool judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const;
  void halve(std::int32_t ray, Workspace& ws) const;
  /// Drops the panels that were halved and sorts the others along the rays.
  void keep_leaves(Workspace& ws) const;
  void sum_up(std::span<const std::span<const Hit>> hits, Workspace& ws, RayLight& out) const;

  const Medium& medium_;
};

std::int32_t AdaptiveSampler::find_cover(std::span<const Hit> hits, double t,
                                         RayNodes& nodes) const {
  Cover cover = medium_.cover(hits, t);
  if (cover.galaxies.empty()) return -1;
  for (std::size_t c = nodes.covers.size(); c-- > 0;) {
    if (nodes.covers[c].galaxies == cover.galaxies) return static_cast<std::int32_t>(c);
  }
  nodes.covers.push_back(std::move(cover));
  return static_cast<std::int32_t>(nodes.covers.size() - 1);
}

void AdaptiveSampler::cut_ray(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const {
  ws.marks.clear();
  ws.edges.clear();
  for (const Hit& hit : hits) {
    medium_.mark(hit, ws.marks);
    ws.edges.push_back(hit.begin);
    ws.edges.push_back(hit.end);
  }
  // A camera inside a galaxy sees nothing behind it.
  for (double edge : ws.marks.edges) {
    if (edge > 0) ws.edges.push_back(edge);
  }
  std::sort(ws.edges.begin(), ws.edges.end());
  std::int32_t last_panel = no_panel;
  std::int32_t last_node = -1;
  double last_end = 0;
  for (std::size_t e = 0; e + 1 < ws.edges.size(); ++e) {
    const double begin = ws.edges[e], end = ws.edges[e + 1];
    const double length = end - begin;
    if (!(length > 0)) continue;
    const double middle = 0.5 * (begin + end);
    const std::int32_t cover = find_cover(hits, middle, ws.nodes);
    if (cover < 0) continue;
    double count = 1;
    for (const auto& stretch : ws.marks.stretches) {
      if (stretch.begin < middle && middle < stretch.end) {
        count = std::max(count, std::ceil(length / stretch.step));
      }
    }
    for (double k = 0; k < count; ++k) {
      const double from = begin + length * k / count;
      const double to = k + 1 < count ? begin + length * (k + 1) / count : end;
      const std::int32_t panel = ws.panels.add(from, to, cover, 0);
      const auto p = static_cast<std::size_t>(panel);
      if (last_panel == no_panel) {
        ws.first_panel[static_cast<std::size_t>(ray)] = panel;
      } else {
        ws.panels.next[static_cast<std::size_t>(last_panel)] = panel;
      }
      const bool joined = last_panel != no_panel && last_end == from &&
                          ws.panels.cover[static_cast<std::size_t>(last_panel)] == cover;
      ws.panels.node[0][p] = joined ? last_node : ws.nodes.add(ray, cover, from);
      for (int n = 1; n < panel_nodes; ++n) {
        ws.panels.node[n][p] = ws.nodes.add(ray, cover, from + (to - from) * n / (panel_nodes - 1));
      }
      last_node = ws.panels.node[panel_nodes - 1][p];
      last_panel = panel;
      last_end = to;
    }
  }
}

void AdaptiveSampler::describe_covers(Workspace& ws) const {
  const std::vector<Cover>& covers = ws.nodes.covers;
  std::size_t light_slots = 0, dust_slots = 0;
  for (const Cover& cover : covers) {
    light_slots = std::max(light_slots, static_cast<std::size_t>(cover.light_slots));
    dust_slots = std::max(dust_slots, static_cast<std::size_t>(cover.dust_slots));
  }
  const std::size_t planes = medium_.steering().size(), nodes = medium_.nodes();
  ws.steering_flux.assign(planes * light_slots * covers.size(), 0.0f);
  ws.steering_extinction.assign(planes * dust_slots * covers.size(), 0.0f);
  ws.extinction.assign(dust_slots * nodes * covers.size(), 0.0f);
  for (std::size_t c = 0; c < covers.size(); ++c) {
    for (int slot = 0; slot < covers[c].light_slots; ++slot) {
      for (std::size_t s = 0; s < planes; ++s) {
        ws.steering_flux[(s * light_slots + static_cast<std::size_t>(slot)) * covers.size() + c] =
            medium_.steering_flux(covers[c], slot, s);
      }
    }
    for (int slot = 0; slot < covers[c].dust_slots; ++slot) {
      const auto d = static_cast<std::size_t>(slot);
      for (std::size_t j = 0; j < nodes; ++j) {
        ws.extinction[(d * nodes + j) * covers.size() + c] = medium_.extinction(covers[c], slot, j);
      }
      for (std::size_t s = 0; s < planes; ++s) {
        ws.steering_extinction[(s * dust_slots + d) * covers.size() + c] =
            medium_.extinction(covers[c], slot, medium_.basis().main_node(medium_.steering()[s]));
      }
    }
  }
  ws.light_slots.resize(light_slots);
  ws.dust_slots.resize(dust_slots);
  ws.gathered.resize((light_slots + dust_slots) * panel_nodes * most_lanes);
}

PanelRun AdaptiveSampler::run_of(std::size_t first, std::size_t size, Workspace& ws) const {
  Panels& panels = ws.panels;
  // Whole vectors: the padding repeats node 0 of cover 0.
  const std::size_t room = std::max(first + padded(size), panels.size());
  for (auto& n : panels.node) n.resize(room, 0);
  panels.spacing.resize(room, 0.0f);
  panels.cover.resize(room, 0);
  PanelRun run{};
  for (int n = 0; n < panel_nodes; ++n) run.node[n] = panels.node[n].data() + first;
  run.spacing = panels.spacing.data() + first;
  run.cover = panels.cover.data() + first;
  for (std::size_t slot = 0; slot < ws.light_slots.size(); ++slot) {
    ws.light_slots[slot] = ws.nodes.light[slot].data();
  }
  for (std::size_t slot = 0; slot < ws.dust_slots.size(); ++slot) {
    ws.dust_slots[slot] = ws.nodes.dust[slot].data();
  }
  run.light = ws.light_slots.data();
  run.dust = ws.dust_slots.data();
  run.light_slots = ws.light_slots.size();
  run.dust_slots = ws.dust_slots.size();
  run.gathered = ws.gathered.data();
  return run;
}

void AdaptiveSampler::steer(std::size_t first, Workspace& ws) const {
  Panels& panels = ws.panels;
  const std::size_t size = panels.size() - first;
  if (size == 0) return;
  const std::size_t covers = ws.nodes.covers.size(), planes = medium_.steering().size();
  std::vector<SteeringPlane> steering(planes);
  for (std::size_t s = 0; s < planes; ++s) {
    for (auto* results : {&panels.light, &panels.light_error, &panels.depth, &panels.depth_error,
                          &panels.transmission}) {
      (*results)[s].resize(first + padded(size));
    }
    steering[s] = {ws.steering_flux.data() + s * ws.light_slots.size() * covers,
                   ws.steering_extinction.data() + s * ws.dust_slots.size() * covers,
                   panels.light[s].data() + first,
                   panels.light_error[s].data() + first,
                   panels.depth[s].data() + first,
                   panels.depth_error[s].data() + first,
                   panels.transmission[s].data() + first};
  }
  const PanelRun run = run_of(first, size, ws);
  HWY_DYNAMIC_DISPATCH(SteerPanels)(run, steering.data(), planes, covers, size);
  for (auto& n : panels.node) n.resize(panels.size());
  panels.spacing.resize(panels.size());
  panels.cover.resize(panels.size());
}

bool AdaptiveSampler::judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const {
  const Panels& panels = ws.panels;
  ws.leaves.clear();
  for (std::int32_t p = ws.first_panel[static_cast<std::size_t>(ray)]; p != no_panel;
       p = panels.next[static_cast<std::size_t>(p)]) {
    ws.leaves.push_back(p);
  }
  const std::size_t count = ws.leaves.size();
  ws.refine.assign(count, 0);
  ws.in_front.resize(2 * count);
  bool any = false;
  for (std::size_t w = 0; w < medium_.steering().size(); ++w) {
    const float* light = panels.light[w].data();
    const float* transmission = panels.transmission[w].data();
    double intensity = 0, transmitted = 1;
    for (std::size_t k = 0; k < count; ++k) {
      const auto p = static_cast<std::size_t>(ws.leaves[k]);
      ws.in_front[2 * k] = transmitted;
      intensity += transmitted * double{light[p]};
      ws.in_front[2 * k + 1] = intensity;
      transmitted *= double{transmission[p]};
    }
    double typical = 0;
    for (const Hit& hit : hits) {
      typical = std::max(typical, medium_.typical_brightness(hit.galaxy, w));
    }
    const double allowed = medium_.accuracy().panel_error *
                           std::max(intensity, medium_.accuracy().faint_share * typical) /
                           std::sqrt(static_cast<double>(count));
    for (std::size_t k = 0; k < count; ++k) {
      const auto p = static_cast<std::size_t>(ws.leaves[k]);
      // An error of depth dims all the light behind.
      const double error = ws.in_front[2 * k] * double{panels.light_error[w][p]} +
                           (intensity - ws.in_front[2 * k + 1]) * double{panels.depth_error[w][p]};
      if (error > allowed && panels.level[p] < deepest_level) {
        ws.refine[k] = 1;
        any = true;
      }
    }
  }
  return any;
}

void AdaptiveSampler::halve(std::int32_t ray, Workspace& ws) const {
  Panels& panels = ws.panels;
  std::int32_t before = no_panel;
  for (std::size_t k = 0; k < ws.leaves.size(); ++k) {
    const std::int32_t parent = ws.leaves[k];
    if (!ws.refine[k]) {
      before = parent;
      continue;
    }
    const auto p = static_cast<std::size_t>(parent);
    const double begin = panels.begin[p], end = panels.end[p];
    const double middle = 0.5 * (begin + end);
    std::int32_t old[panel_nodes];
    for (int n = 0; n < panel_nodes; ++n) old[n] = panels.node[n][p];
    const std::int32_t behind = panels.next[p];
    const auto level = static_cast<std::uint8_t>(panels.level[p] + 1);
    const std::int32_t cover = panels.cover[p];
    std::int32_t child[2];
    for (int side = 0; side < 2; ++side) {
      const double from = side == 0 ? begin : middle;
      const double to = side == 0 ? middle : end;
      child[side] = panels.add(from, to, cover, level);
      const auto c = static_cast<std::size_t>(child[side]);
      panels.node[0][c] = old[2 * side];
      panels.node[1][c] = ws.nodes.add(ray, cover, from + 0.25 * (to - from));
      panels.node[2][c] = old[2 * side + 1];
      panels.node[3][c] = ws.nodes.add(ray, cover, from + 0.75 * (to - from));
      panels.node[4][c] = old[2 * side + 2];
    }
    if (before == no_panel) {
      ws.first_panel[static_cast<std::size_t>(ray)] = child[0];
    } else {
      panels.next[static_cast<std::size_t>(before)] = child[0];
    }
    panels.next[static_cast<std::size_t>(child[0])] = child[1];
    panels.next[static_cast<std::size_t>(child[1])] = behind;
    before = child[1];
  }
}

void AdaptiveSampler::keep_leaves(Workspace& ws) const {
  Panels& kept = ws.kept;
  kept.clear(medium_.steering().size());
  for (std::int32_t& first : ws.first_panel) {
    std::int32_t before = no_panel;
    for (std::int32_t old = first; old != no_panel;) {
      const auto o = static_cast<std::size_t>(old);
      const std::int32_t panel =
          kept.add(ws.panels.begin[o], ws.panels.end[o], ws.panels.cover[o], ws.panels.level[o]);
      const auto p = static_cast<std::size_t>(panel);
      for (int n = 0; n < panel_nodes; ++n) kept.node[n][p] = ws.panels.node[n][o];
      if (before == no_panel) {
        first = panel;
      } else {
        kept.next[static_cast<std::size_t>(before)] = panel;
      }
      before = panel;
      old = ws.panels.next[o];
    }
  }
  std::swap(ws.panels, kept);
}

void AdaptiveSampler::sum_up(std::span<const std::span<const Hit>> hits, Workspace& ws,
                             RayLight& out) const {
  const std::size_t nodes = medium_.nodes(), covers = ws.nodes.covers.size();
  const std::size_t light_slots = ws.light_slots.size();
  ws.depth.resize(nodes * panels_at_once);
  ws.transmission.resize(nodes * panels_at_once);
  ws.light.resize(light_slots * nodes * panels_at_once);
  const PanelResults results{ws.extinction.data(),   nodes,
                             panels_at_once,         ws.depth.data(),
                             ws.transmission.data(), ws.light.data()};
  const std::size_t count = ws.panels.size();
  // The leaves stand in the order of the rays and along them.
  std::size_t done = 0, chunk = 0;
  for (std::size_t ray = 0; ray < hits.size(); ++ray) {
    ws.transmitted.assign(nodes, 1.0);
    double* depth = out.depth.data() + ray * nodes;
    std::int32_t described = -1;
    for (std::int32_t p = ws.first_panel[ray]; p != no_panel;
         p = ws.panels.next[static_cast<std::size_t>(p)]) {
      if (static_cast<std::size_t>(p) >= done) {
        chunk = done;
        const std::size_t size = std::min(panels_at_once, count - chunk);
        const PanelRun run = run_of(chunk, size, ws);
        HWY_DYNAMIC_DISPATCH(IntegratePanels)(run, results, covers, size);
        done = chunk + size;
      }
      const std::size_t k = static_cast<std::size_t>(p) - chunk;
      const std::int32_t c = ws.panels.cover[static_cast<std::size_t>(p)];
      if (c != described) {
        described = c;
        medium_.places(hits[ray], ws.nodes.covers[static_cast<std::size_t>(c)], ws.places);
      }
      for (std::size_t slot = 0; slot < ws.places.size(); ++slot) {
        double* sum = out.light.data() + out.begin[ray] + ws.places[slot];
        const float* light = ws.light.data() + slot * nodes * panels_at_once + k;
        for (std::size_t j = 0; j < nodes; ++j) {
          sum[j] += ws.transmitted[j] * double{light[j * panels_at_once]};
        }
      }
      for (std::size_t j = 0; j < nodes; ++j) {
        ws.transmitted[j] *= double{ws.transmission[j * panels_at_once + k]};
        depth[j] += double{ws.depth[j * panels_at_once + k]};
      }
    }
  }
}

void AdaptiveSampler::integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                                RenderCounts& counts) const {
  Workspace& ws = workspace();
  ws.nodes.clear();
  ws.panels.clear(medium_.steering().size());
  ws.first_panel.assign(hits.size(), no_panel);
  ws.active.clear();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].empty()) continue;
    cut_ray(hits[i], static_cast<std::int32_t>(i), ws);
    if (ws.first_panel[i] != no_panel) ws.active.push_back(static_cast<std::int32_t>(i));
  }
  describe_covers(ws);
  std::size_t new_nodes = 0, new_panels = 0;
  while (!ws.active.empty()) {
    medium_.evaluate(hits, new_nodes, ws.nodes);
    steer(new_panels, ws);
    new_nodes = ws.nodes.size();
    new_panels = ws.panels.size();
    ws.still_active.clear();
    for (const std::int32_t ray : ws.active) {
      if (!judge(hits[static_cast<std::size_t>(ray)], ray, ws)) continue;
      halve(ray, ws);
      ws.still_active.push_back(ray);
    }
    std::swap(ws.active, ws.still_active);
  }
  out.prepare(medium_, hits);
  keep_leaves(ws);
  sum_up(hits, ws, out);
  counts.rays += hits.size();
  counts.nodes += ws.nodes.size();
}

}  // namespace

std::unique_ptr<Sampler> make_adaptive_sampler(const Medium& medium) {
  return std::make_unique<AdaptiveSampler>(medium);
}

}  // namespace gamer
#endif
