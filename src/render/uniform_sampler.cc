#include <algorithm>
#include <cmath>

#include "gamer/render/sampler.h"

namespace gamer {

namespace {

// Rays longer than this many steps are worked on in pieces, to bound memory.
constexpr std::size_t piece_size = 4096;

class UniformSampler : public Sampler {
 public:
  UniformSampler(const Medium& medium, double step) : medium_(medium), step_(step) {}

  void integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                 RenderCounts& counts) const override {
    out.prepare(medium_, hits);
    for (std::size_t i = 0; i < hits.size(); ++i) integrate_ray(hits, i, out, counts);
  }

 private:
  /// Adds the nodes of one cover.
  void add(std::span<const Hit> hits, const RayNodes& nodes, std::span<const double> widths,
           std::vector<double>& transmission, double* light, double* depth) const {
    const std::size_t steps = medium_.nodes();
    const Cover& cover = nodes.covers.front();
    std::vector<std::size_t> places;
    medium_.places(hits, cover, places);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      for (std::size_t j = 0; j < steps; ++j) {
        double opacity = 0;
        for (int slot = 0; slot < cover.dust_slots; ++slot) {
          opacity += double{medium_.extinction(cover, slot, j)} *
                     double{nodes.dust[static_cast<std::size_t>(slot)][n]};
        }
        const double attenuation = std::exp(-0.5 * widths[n] * opacity);
        for (std::size_t slot = 0; slot < places.size(); ++slot) {
          light[places[slot] + j] +=
              transmission[j] * attenuation * double{nodes.light[slot][n]} * widths[n];
        }
        transmission[j] *= attenuation * attenuation;
        depth[j] += widths[n] * opacity;
      }
    }
  }

  void integrate_ray(std::span<const std::span<const Hit>> hits, std::size_t i, RayLight& out,
                     RenderCounts& counts) const {
    std::vector<double> transmission(medium_.nodes(), 1.0);
    RayNodes nodes;
    std::vector<double> widths;
    const auto flush = [&] {
      medium_.evaluate(hits, 0, nodes);
      add(hits[i], nodes, widths, transmission, out.light.data() + out.begin[i],
          out.depth.data() + i * medium_.nodes());
      counts.nodes += nodes.size();
      nodes.clear_nodes();
      widths.clear();
    };
    // Where the set of galaxies along the ray changes.
    std::vector<double> edges;
    for (const Hit& hit : hits[i]) {
      edges.push_back(hit.begin);
      edges.push_back(hit.end);
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t e = 0; e + 1 < edges.size(); ++e) {
      const double begin = edges[e], end = edges[e + 1];
      if (!(end > begin)) continue;
      nodes.covers = {medium_.cover(hits[i], 0.5 * (begin + end))};
      double step = HUGE_VAL;
      for (const int galaxy : nodes.covers.front().galaxies) {
        step = std::min(step, step_ * medium_.radius(galaxy));
      }
      if (!(step < HUGE_VAL)) continue;
      const double count = std::ceil((end - begin) / step);
      const double width = (end - begin) / count;
      for (double k = 0; k < count; ++k) {
        nodes.add(static_cast<std::int32_t>(i), 0, begin + (k + 0.5) * width);
        widths.push_back(width);
        if (nodes.size() == piece_size) flush();
      }
      if (nodes.size() > 0) flush();
    }
    counts.rays += 1;
  }

  const Medium& medium_;
  double step_;
};

}  // namespace

std::unique_ptr<Sampler> make_uniform_sampler(const Medium& medium, double step) {
  return std::make_unique<UniformSampler>(medium, step);
}

}  // namespace gamer
