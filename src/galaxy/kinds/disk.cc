#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind disk_kind() {
  return {.name = "disk",
          .description = "smooth starlight of the disk, textured by inverse noise (GAMER Eq. 13)",
          .traits = {.can_be_followed = true},
          .parameters = Layer::parameters(),
          .noise = FractalParameters{.octaves = 7, .inverse = true, .floor = 0.2},
          .make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
            return std::make_unique<Layer>(Layer::read_shape(input), input.arms);
          }};
}

}  // namespace gamer
