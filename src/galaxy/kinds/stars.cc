#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind stars_kind() {
  return {.name = "stars",
          .description = "bright young clumps: a disk of high, sparse noise (GAMER section 2.4)",
          .traits = {.can_follow = true},
          .parameters = Layer::parameters(),
          .noise = FractalParameters{.octaves = 7, .k0 = 20, .frequency_scale = 3, .exponent = 8},
          .make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
            return std::make_unique<Layer>(Layer::read_shape(input), input.arms);
          }};
}

}  // namespace gamer
