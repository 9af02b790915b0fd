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

  void integrate(std::span<const std::span<const Hit>> hits, std::span<double> intensities,
                 RenderCounts& counts) const override {
    for (std::size_t i = 0; i < hits.size(); ++i) integrate_ray(hits, i, intensities, counts);
  }

 private:
  void integrate_ray(std::span<const std::span<const Hit>> hits, std::size_t i,
                     std::span<double> intensities, RenderCounts& counts) const {
    const auto planes = static_cast<std::size_t>(medium_.planes());
    std::vector<double> intensity(planes, 0.0), transmission(planes, 1.0);
    RayNodes nodes;
    std::vector<double> widths;
    const auto flush = [&] {
      medium_.evaluate(hits, 0, nodes);
      for (std::size_t n = 0; n < nodes.size(); ++n) {
        for (std::size_t w = 0; w < planes; ++w) {
          const double half = 0.5 * widths[n] * nodes.opacity[w][n];
          const double attenuation = std::exp(-half);
          intensity[w] += transmission[w] * attenuation * nodes.emission[w][n] * widths[n];
          transmission[w] *= attenuation * attenuation;
        }
      }
      counts.nodes += nodes.size();
      nodes.clear();
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
      double step = HUGE_VAL;
      for (const Hit& hit : hits[i]) {
        if (hit.begin < end && hit.end > begin) {
          step = std::min(step, step_ * medium_.radius(hit.galaxy));
        }
      }
      if (!(step < HUGE_VAL) || !(end > begin)) continue;
      const double count = std::ceil((end - begin) / step);
      const double width = (end - begin) / count;
      for (double k = 0; k < count; ++k) {
        nodes.add(static_cast<std::int32_t>(i), begin + (k + 0.5) * width);
        widths.push_back(width);
        if (nodes.size() == piece_size) flush();
      }
    }
    if (nodes.size() > 0) flush();
    counts.rays += 1;
    std::copy(intensity.begin(), intensity.end(),
              intensities.begin() + static_cast<std::ptrdiff_t>(i * planes));
  }

  const Medium& medium_;
  double step_;
};

}  // namespace

std::unique_ptr<Sampler> make_uniform_sampler(const Medium& medium, double step) {
  return std::make_unique<UniformSampler>(medium, step);
}

}  // namespace gamer
