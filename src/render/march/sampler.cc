#include "gamer/render/march/sampler.h"

namespace gamer {

std::unique_ptr<Sampler> make_sampler(const Medium& medium, const RenderParameters& parameters) {
  if (parameters.sampling.sampler == SamplerKind::uniform) {
    return make_uniform_sampler(medium, parameters.sampling.step);
  }
  return make_adaptive_sampler(medium);
}

}  // namespace gamer
