#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind disk_kind() {
  ComponentKind kind;
  kind.name = "disk";
  kind.description = "smooth starlight of the disk, textured by inverse noise (GAMER Eq. 13)";
  kind.traits = {.can_be_followed = true};
  kind.parameters = Layer::parameters();
  FractalParameters noise;
  noise.octaves = 7;
  noise.k0 = 0;
  noise.frequency_scale = 1;
  noise.spectral_index = 1;
  noise.exponent = 1;
  noise.inverse = true;
  noise.floor = 0.2;
  kind.noise = noise;
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    return std::make_unique<Layer>(Layer::read_shape(input), input.arms);
  };
  return kind;
}

}  // namespace gamer
