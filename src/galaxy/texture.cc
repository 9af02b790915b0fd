#include "gamer/galaxy/texture.h"

namespace gamer {

void FractalTexture::evaluate(const Points& points, const float* footprints,
                              std::span<const double> deviations, std::span<BatchArray> out,
                              std::uint64_t& evaluations) const {
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
  for (std::size_t k = 0; k < out.size(); ++k) {
    noise_.expect(points.size, seen, deviations[k], out[k].data());
  }
}

}  // namespace gamer
