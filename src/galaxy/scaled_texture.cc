#include "galaxy/scaled_texture.h"

#include <cmath>

#include "gamer/core/error.h"

namespace gamer {

void ScaledTexture::normalise(std::span<const WeightedBatch> cloud,
                              const FractalNoise::Factor& factor) {
  scale_ = 1;
  const CloudMean all = mean_over(cloud, [&](std::size_t b, BatchArray& out) {
    std::uint64_t evaluations = 0;
    evaluate_whole(cloud[b].points(), out, evaluations);
    if (!factor) return;
    BatchArray other;
    factor(cloud[b].points(), other.data());
    for (std::size_t i = 0; i < cloud[b].size; ++i) out[i] *= other[i];
  });
  if (!(all.mean > 0) || !std::isfinite(all.square_mean)) {
    if (no_mean_ != nullptr) throw InputError(no_mean_);
    rms_ = 1;
    return;
  }
  scale_ = 1 / all.mean;
  rms_ = std::sqrt(all.square_mean) / all.mean;
}

}  // namespace gamer
