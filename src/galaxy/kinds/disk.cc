#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind disk_kind() {
  FractalParameters noise;
  noise.octaves = 7;
  noise.k0 = 0;
  noise.frequency_scale = 1;
  noise.spectral_index = 1;
  noise.exponent = 1;
  noise.inverse = true;
  noise.floor = 0.2;
  return {.name = "disk",
          .description = "smooth starlight of the disk, textured by inverse noise (GAMER Eq. 13)",
          .traits = {.can_be_followed = true},
          .parameters = Layer::parameters(),
          .noise = noise,
          .make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
            return std::make_unique<Layer>(Layer::read_shape(input), input.arms);
          }};
}

}  // namespace gamer
