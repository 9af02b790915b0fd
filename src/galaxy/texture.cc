#include "gamer/galaxy/texture.h"

namespace gamer {

void Texture::evaluate(const Points& points, const float* footprints, const float* coherence,
                       std::span<const double> deviations, std::span<BatchArray> out,
                       std::uint64_t& evaluations) const {
  if (points.size == 0) return;
  if (footprints != nullptr) {
    const auto [least, most] = range_of(footprints, points.size);
    if (hides(double{most})) {
      SeenNoise seen;
      see(points, std::span(&footprints, 1), out.size() > 1, std::span(&seen, 1), evaluations);
      expect(points.size, seen, coherence, deviations, out);
      if (hides(double{least})) return;
      BatchArray whole;
      evaluate_whole(points, whole, evaluations);
      for (BatchArray& values : out) {
        for (std::size_t i = 0; i < points.size; ++i) {
          if (!hides(double{footprints[i]})) values[i] = whole[i];
        }
      }
      return;
    }
  }
  evaluate_whole(points, out[0], evaluations);
  for (BatchArray& other : out.subspan(1)) other = out[0];
}

void FractalTexture::evaluate_whole(const Points& points, BatchArray& out,
                                    std::uint64_t& evaluations) const {
  noise_.evaluate(points, out.data());
  evaluations += points.size * static_cast<std::size_t>(noise_.parameters().octaves);
}

void FractalTexture::see(const Points& points, std::span<const float* const> footprints,
                         bool /*wants_coherent*/, std::span<SeenNoise> out,
                         std::uint64_t& evaluations) const {
  noise_.see(points, footprints, out, evaluations);
}

void FractalTexture::expect(std::size_t size, const SeenNoise& seen, const float* coherence,
                            std::span<const double> deviations, std::span<BatchArray> out) const {
  if (out.size() == 1) {
    noise_.expect(size, seen, out[0].data());
    return;
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    noise_.expect(size, seen, coherence, deviations[k], out[k].data());
  }
}

}  // namespace gamer
