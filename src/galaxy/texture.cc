#include "gamer/galaxy/texture.h"

#include <vector>

namespace gamer {

void Texture::evaluate(const Points& points, const float* footprints, const float* coherence,
                       std::span<const double> deviations, std::span<BatchArray> out,
                       std::uint64_t& evaluations) const {
  if (points.size == 0) return;
  if (footprints != nullptr) {
    const auto [least, most] = range_of(footprints, points.size);
    if (hides(double{most})) {
      evaluate_alike(points, footprints, coherence, deviations, out, evaluations);
      if (hides(double{least})) return;
      std::vector<BatchArray> plain(out.size());
      evaluate_alike(points, nullptr, nullptr, {}, plain, evaluations);
      for (std::size_t k = 0; k < out.size(); ++k) {
        for (std::size_t i = 0; i < points.size; ++i) {
          if (!hides(double{footprints[i]})) out[k][i] = plain[k][i];
        }
      }
      return;
    }
  }
  evaluate_alike(points, nullptr, nullptr, {}, out, evaluations);
}

void FractalTexture::evaluate_alike(const Points& points, const float* footprints,
                                    const float* coherence, std::span<const double> deviations,
                                    std::span<BatchArray> out, std::uint64_t& evaluations) const {
  if (footprints == nullptr) {
    noise_.evaluate(points, out[0].data());
    for (BatchArray& other : out.subspan(1)) other = out[0];
    evaluations += points.size * static_cast<std::size_t>(noise_.parameters().octaves);
    return;
  }
  SeenNoise seen;
  noise_.see(points, footprints, seen, evaluations);
  if (out.size() == 1) {
    noise_.expect(points.size, seen, out[0].data());
    return;
  }
  for (std::size_t i = 0; i < points.size && coherence != nullptr; ++i) {
    seen.coherent[i] *= coherence[i];
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    noise_.expect(points.size, seen, deviations[k], out[k].data());
  }
}

}  // namespace gamer
