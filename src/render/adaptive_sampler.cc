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

/// What one plane of a run of panels is made from and becomes; arrays are padded.
struct PanelPlane {
  const float* emission;  ///< of all nodes
  const float* opacity;
  const std::int32_t* node[panel_nodes];  ///< of each panel
  const float* spacing;                   ///< a quarter of the panel's length
  float* light;                           ///< int j exp(-tau) ds from the panel's near end
  float* light_error;
  float* depth;  ///< int kappa ds
  float* depth_error;
  float* transmission;  ///< exp(-depth)
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Boole's rule over five equally spaced nodes, with optical depths up to each node from the
/// quartic through all five; the error estimate is the difference to two Simpson rules, that is
/// h/45 times the fourth difference.
void IntegratePanels(const PanelPlane& p, std::size_t size) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto h = hn::LoadU(d, p.spacing + i);
    const auto n0 = hn::LoadU(di, p.node[0] + i);
    const auto n1 = hn::LoadU(di, p.node[1] + i);
    const auto n2 = hn::LoadU(di, p.node[2] + i);
    const auto n3 = hn::LoadU(di, p.node[3] + i);
    const auto n4 = hn::LoadU(di, p.node[4] + i);
    const auto k0 = hn::GatherIndex(d, p.opacity, n0);
    const auto k1 = hn::GatherIndex(d, p.opacity, n1);
    const auto k2 = hn::GatherIndex(d, p.opacity, n2);
    const auto k3 = hn::GatherIndex(d, p.opacity, n3);
    const auto k4 = hn::GatherIndex(d, p.opacity, n4);
    const auto f0 = hn::GatherIndex(d, p.emission, n0);
    auto f1 = hn::GatherIndex(d, p.emission, n1);
    auto f2 = hn::GatherIndex(d, p.emission, n2);
    auto f3 = hn::GatherIndex(d, p.emission, n3);
    auto f4 = hn::GatherIndex(d, p.emission, n4);
    const auto zero = hn::Zero(d);
    const auto fourth_difference = [&](auto a0, auto a1, auto a2, auto a3, auto a4) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, 4.0f), hn::Add(a1, a3),
                        hn::NegMulAdd(hn::Set(d, 6.0f), a2, hn::Neg(hn::Add(a0, a4))));
    };
    const auto boole = [&](auto a0, auto a1, auto a2, auto a3, auto a4) HWY_ATTR {
      const auto sum = hn::MulAdd(
          hn::Set(d, 14.0f / 45), hn::Add(a0, a4),
          hn::MulAdd(hn::Set(d, 64.0f / 45), hn::Add(a1, a3), hn::Mul(hn::Set(d, 24.0f / 45), a2)));
      return hn::Mul(h, sum);
    };
    const auto error_scale = hn::Mul(h, hn::Set(d, 1.0f / 45));
    const auto dusty = hn::Max(hn::Max(hn::Max(k0, k1), hn::Max(k2, k3)), k4);
    auto depth = zero;
    auto depth_error = zero;
    auto transmission = hn::Set(d, 1.0f);
    if (!hn::AllFalse(d, hn::Gt(dusty, zero))) {
      const auto row = [&](float a, float b, float c, float e, float f, float divisor) HWY_ATTR {
        const auto sum =
            hn::MulAdd(hn::Set(d, a / divisor), k0,
                       hn::MulAdd(hn::Set(d, b / divisor), k1,
                                  hn::MulAdd(hn::Set(d, c / divisor), k2,
                                             hn::MulAdd(hn::Set(d, e / divisor), k3,
                                                        hn::Mul(hn::Set(d, f / divisor), k4)))));
        return hn::Max(hn::Mul(h, sum), zero);
      };
      const auto faded = [&](auto value, auto tau)
                             HWY_ATTR { return hn::Mul(value, Exp(d, hn::Neg(tau))); };
      f1 = faded(f1, row(251, 646, -264, 106, -19, 720));
      f2 = faded(f2, row(29, 124, 24, 4, -1, 90));
      f3 = faded(f3, row(27, 102, 72, 42, -3, 80));
      depth = boole(k0, k1, k2, k3, k4);
      transmission = Exp(d, hn::Neg(depth));
      f4 = hn::Mul(f4, transmission);
      depth_error = hn::Mul(error_scale, hn::Abs(fourth_difference(k0, k1, k2, k3, k4)));
    }
    hn::StoreU(boole(f0, f1, f2, f3, f4), d, p.light + i);
    hn::StoreU(hn::Mul(error_scale, hn::Abs(fourth_difference(f0, f1, f2, f3, f4))), d,
               p.light_error + i);
    hn::StoreU(depth, d, p.depth + i);
    hn::StoreU(depth_error, d, p.depth_error + i);
    hn::StoreU(transmission, d, p.transmission + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(IntegratePanels);

namespace {

// Halvings of a first panel at most: beyond, single precision has nothing left to refine.
constexpr int deepest_level = 20;

// Planes that steer the refinement when there are more.
constexpr std::size_t steering_planes = 3;

constexpr std::int32_t no_panel = -1;

/// The panels of a set of rays, as arrays; every array is padded to whole vectors.
struct Panels {
  std::vector<std::int32_t> node[panel_nodes];
  std::vector<float> spacing;
  std::vector<double> begin, end;
  std::vector<std::int32_t> next;  ///< the panel behind it on its ray
  std::vector<std::uint8_t> level;
  /// Per plane.
  std::vector<std::vector<float>> light, light_error, depth, depth_error, transmission;

  std::size_t size() const { return begin.size(); }

  void clear(std::size_t planes) {
    for (auto& n : node) n.clear();
    spacing.clear();
    begin.clear();
    end.clear();
    next.clear();
    level.clear();
    for (auto* results : {&light, &light_error, &depth, &depth_error, &transmission}) {
      results->resize(planes);
    }
  }

  std::int32_t add(double from, double to, std::uint8_t depth_of_refinement) {
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
};

Workspace& workspace() {
  thread_local Workspace instance;
  return instance;
}

class AdaptiveSampler : public Sampler {
 public:
  explicit AdaptiveSampler(const Medium& medium) : medium_(medium) {
    const auto planes = static_cast<std::size_t>(medium.planes());
    // Planes spread evenly over the list stand for the others: spectra are sums of the same few
    // components, so that their errors lie between those of the ends.
    const std::size_t count = std::min(planes, steering_planes);
    for (std::size_t k = 0; k < count; ++k) {
      steering_.push_back(count == 1 ? 0 : k * (planes - 1) / (count - 1));
    }
    for (std::size_t w = 0; w < planes; ++w) all_planes_.push_back(w);
  }

  void integrate(std::span<const std::span<const Hit>> hits, std::span<double> intensities,
                 RenderCounts& counts) const override;

 private:
  void cut_ray(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const;
  void integrate_panels(std::size_t first, std::span<const std::size_t> planes,
                        Workspace& ws) const;
  /// Marks the panels of a ray that must be halved; false when none.
  bool judge(std::span<const Hit> hits, std::int32_t ray, Workspace& ws) const;
  void halve(std::int32_t ray, Workspace& ws) const;
  /// Drops the panels that were halved.
  void keep_leaves(Workspace& ws) const;

  const Medium& medium_;
  std::vector<std::size_t> steering_;
  std::vector<std::size_t> all_planes_;
};

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
    bool inside = false;
    for (const Hit& hit : hits) inside = inside || (hit.begin < middle && middle < hit.end);
    if (!inside) continue;
    double count = 1;
    for (const auto& stretch : ws.marks.stretches) {
      if (stretch.begin < middle && middle < stretch.end) {
        count = std::max(count, std::ceil(length / stretch.step));
      }
    }
    for (double k = 0; k < count; ++k) {
      const double from = begin + length * k / count;
      const double to = k + 1 < count ? begin + length * (k + 1) / count : end;
      const std::int32_t panel = ws.panels.add(from, to, 0);
      const auto p = static_cast<std::size_t>(panel);
      if (last_panel == no_panel) {
        ws.first_panel[static_cast<std::size_t>(ray)] = panel;
      } else {
        ws.panels.next[static_cast<std::size_t>(last_panel)] = panel;
      }
      const bool joined = last_panel != no_panel && last_end == from;
      ws.panels.node[0][p] = joined ? last_node : ws.nodes.add(ray, from);
      for (int n = 1; n < panel_nodes; ++n) {
        ws.panels.node[n][p] = ws.nodes.add(ray, from + (to - from) * n / (panel_nodes - 1));
      }
      last_node = ws.panels.node[panel_nodes - 1][p];
      last_panel = panel;
      last_end = to;
    }
  }
}

void AdaptiveSampler::integrate_panels(std::size_t first, std::span<const std::size_t> planes,
                                       Workspace& ws) const {
  Panels& panels = ws.panels;
  const std::size_t size = panels.size() - first;
  if (size == 0) return;
  // Whole vectors: the padding repeats node 0.
  const std::size_t room = first + padded(size);
  for (auto& n : panels.node) n.resize(room, 0);
  panels.spacing.resize(room, 0.0f);
  for (const std::size_t w : planes) {
    for (auto* results : {&panels.light, &panels.light_error, &panels.depth, &panels.depth_error,
                          &panels.transmission}) {
      (*results)[w].resize(room);
    }
    PanelPlane plane{};
    plane.emission = ws.nodes.emission[w].data();
    plane.opacity = ws.nodes.opacity[w].data();
    for (int n = 0; n < panel_nodes; ++n) plane.node[n] = panels.node[n].data() + first;
    plane.spacing = panels.spacing.data() + first;
    plane.light = panels.light[w].data() + first;
    plane.light_error = panels.light_error[w].data() + first;
    plane.depth = panels.depth[w].data() + first;
    plane.depth_error = panels.depth_error[w].data() + first;
    plane.transmission = panels.transmission[w].data() + first;
    HWY_DYNAMIC_DISPATCH(IntegratePanels)(plane, size);
  }
  for (auto& n : panels.node) n.resize(panels.size());
  panels.spacing.resize(panels.size());
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
  for (const std::size_t w : steering_) {
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
      typical = std::max(typical, medium_.typical_brightness(hit.galaxy)[w]);
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
    std::int32_t child[2];
    for (int side = 0; side < 2; ++side) {
      const double from = side == 0 ? begin : middle;
      const double to = side == 0 ? middle : end;
      child[side] = panels.add(from, to, level);
      const auto c = static_cast<std::size_t>(child[side]);
      panels.node[0][c] = old[2 * side];
      panels.node[1][c] = ws.nodes.add(ray, from + 0.25 * (to - from));
      panels.node[2][c] = old[2 * side + 1];
      panels.node[3][c] = ws.nodes.add(ray, from + 0.75 * (to - from));
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
  kept.clear(all_planes_.size());
  for (std::int32_t& first : ws.first_panel) {
    std::int32_t before = no_panel;
    for (std::int32_t old = first; old != no_panel;) {
      const auto o = static_cast<std::size_t>(old);
      const std::int32_t panel = kept.add(ws.panels.begin[o], ws.panels.end[o], ws.panels.level[o]);
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

void AdaptiveSampler::integrate(std::span<const std::span<const Hit>> hits,
                                std::span<double> intensities, RenderCounts& counts) const {
  const auto planes = static_cast<std::size_t>(medium_.planes());
  Workspace& ws = workspace();
  ws.nodes.clear();
  ws.panels.clear(planes);
  ws.first_panel.assign(hits.size(), no_panel);
  ws.active.clear();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].empty()) continue;
    cut_ray(hits[i], static_cast<std::int32_t>(i), ws);
    if (ws.first_panel[i] != no_panel) ws.active.push_back(static_cast<std::int32_t>(i));
  }
  std::size_t new_nodes = 0, new_panels = 0;
  while (!ws.active.empty()) {
    medium_.evaluate(hits, new_nodes, ws.nodes);
    integrate_panels(new_panels, steering_, ws);
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
  if (steering_.size() < planes) {
    keep_leaves(ws);
    integrate_panels(0, all_planes_, ws);
  }
  std::fill(intensities.begin(), intensities.end(), 0.0);
  for (std::size_t w = 0; w < planes; ++w) {
    const float* light = ws.panels.light[w].data();
    const float* transmission = ws.panels.transmission[w].data();
    for (std::size_t i = 0; i < hits.size(); ++i) {
      double intensity = 0, transmitted = 1;
      for (std::int32_t p = ws.first_panel[i]; p != no_panel;
           p = ws.panels.next[static_cast<std::size_t>(p)]) {
        intensity += transmitted * double{light[p]};
        transmitted *= double{transmission[p]};
      }
      intensities[i * planes + w] = intensity;
    }
  }
  counts.rays += hits.size();
  counts.nodes += ws.nodes.size();
}

}  // namespace

std::unique_ptr<Sampler> make_adaptive_sampler(const Medium& medium) {
  return std::make_unique<AdaptiveSampler>(medium);
}

}  // namespace gamer
#endif
