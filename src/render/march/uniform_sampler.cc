#include <algorithm>
#include <cmath>

#include "core/denormals.h"
#include "gamer/render/march/sampler.h"

namespace gamer {

namespace {

// Largest number of steps of a piece. Longer rays are integrated in pieces, to bound memory.
constexpr std::size_t piece_size = 4096;

class UniformSampler : public Sampler {
 public:
  UniformSampler(const Medium& medium, double step) : medium_(medium), step_(step) {}

  void integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                 RenderCounts& counts) const override {
    const DenormalsAreZero mode;
    out.prepare(medium_, hits);
    for (std::size_t i = 0; i < hits.size(); ++i) integrate_ray(hits, i, out, counts);
  }

 private:
  /// Adds the nodes of one cover.
  void add(std::size_t ray, const Cover& cover, const RayNodes& nodes,
           std::span<const double> widths, std::vector<double>& transmission, RayLight& out) const {
    const std::size_t steps = medium_.nodes();
    std::vector<std::size_t> places;
    medium_.places(out, ray, cover, places);
    double* const light = out.light.data();
    double* const depth = out.depth.data() + ray * steps;
    const std::size_t variants = transmission.size() / steps;
    const auto dust_slots = static_cast<std::size_t>(cover.dust_slots);
    for (std::size_t n = 0; n < nodes.size() * variants; ++n) {
      const std::size_t v = n / nodes.size(), node = n % nodes.size();
      const double weight = widths[node] * (variants > 1 ? dust_variant_weights[v] : 1.0);
      for (std::size_t j = 0; j < steps; ++j) {
        double opacity = 0;
        for (std::size_t slot = 0; slot < dust_slots; ++slot) {
          opacity += double{medium_.extinction(cover, static_cast<int>(slot), j)} *
                     double{nodes.dust[v * dust_slots + slot][node]};
        }
        const double attenuation = std::exp(-0.5 * widths[node] * opacity);
        double& passed = transmission[v * steps + j];
        for (std::size_t slot = 0; slot < places.size(); ++slot) {
          light[places[slot] + j] +=
              passed * attenuation * double{nodes.light[slot][node]} * weight;
        }
        passed *= attenuation * attenuation;
        depth[j] += weight * opacity;
      }
    }
  }

  void integrate_ray(std::span<const std::span<const Hit>> hits, std::size_t i, RayLight& out,
                     RenderCounts& counts) const {
    const bool varies =
        std::ranges::any_of(hits[i], [&](const Hit& hit) { return medium_.has_variants(hit); });
    const std::size_t variants = varies ? dust_deviations.size() : 1;
    std::vector<double> transmission(variants * medium_.nodes(), 1.0);
    RayNodes nodes;
    std::vector<double> widths;
    Cover cover;
    double origin = 0;
    const auto flush = [&] {
      nodes.segments = {
          {static_cast<std::int32_t>(i), 0, 0, static_cast<std::int32_t>(nodes.size()), origin}};
      medium_.evaluate(hits, std::span(&cover, 1), variants, nodes, counts);
      add(i, cover, nodes, widths, transmission, out);
      counts.nodes += nodes.size();
      nodes.clear();
      widths.clear();
    };
    // Places where the set of galaxies along the ray changes.
    std::vector<double> edges;
    std::vector<Hit> here;
    for (const Hit& hit : hits[i]) {
      edges.push_back(hit.begin);
      edges.push_back(hit.end);
    }
    std::ranges::sort(edges);
    for (std::size_t e = 0; e + 1 < edges.size(); ++e) {
      const double begin = edges[e], end = edges[e + 1];
      if (!(end > begin)) continue;
      here.clear();
      for (const Hit& hit : hits[i]) {
        if (hit.begin < end && begin < hit.end) here.push_back(hit);
      }
      cover = medium_.cover(here);
      double step = HUGE_VAL;
      for (const int galaxy : cover.galaxies) step = std::min(step, step_ * medium_.radius(galaxy));
      if (!(step < HUGE_VAL)) continue;
      const double count = std::ceil((end - begin) / step);
      const double width = (end - begin) / count;
      origin = 0.5 * (begin + end);
      for (double k = 0; k < count; ++k) {
        nodes.s.push_back(static_cast<float>((k + 0.5 - 0.5 * count) * width));
        widths.push_back(width);
        if (nodes.size() == piece_size) flush();
      }
      if (nodes.size() > 0) flush();
    }
    for (std::size_t k = 0; k < transmission.size(); ++k) {
      const double weight = variants > 1 ? dust_variant_weights[k / medium_.nodes()] : 1.0;
      double& through = out.through[i * medium_.nodes() + k % medium_.nodes()];
      through = (k < medium_.nodes() ? 0 : through) + weight * transmission[k];
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
