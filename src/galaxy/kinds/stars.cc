#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind stars_kind() {
  FractalParameters noise;
  noise.octaves = 7;
  noise.k0 = 20;
  noise.frequency_scale = 3;
  noise.spectral_index = 1;
  noise.exponent = 8;
  noise.inverse = false;
  return {.name = "stars",
          .description = "bright young clumps: a disk of high, sparse noise (GAMER section 2.4)",
          .traits = {.can_follow = true},
          .parameters = Layer::parameters(),
          .noise = noise,
          .make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
            return std::make_unique<Layer>(Layer::read_shape(input), input.arms);
          }};
}

}  // namespace gamer
