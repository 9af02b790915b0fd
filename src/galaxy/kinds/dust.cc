#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind dust_kind() {
  FractalParameters noise;
  noise.octaves = 8;
  noise.k0 = 0;
  noise.frequency_scale = 1;
  noise.spectral_index = 1;
  noise.exponent = 4;
  noise.inverse = true;
  noise.floor = 0.3;
  return {
      .name = "dust",
      .description = "absorbing layer, textured by inverse noise (GAMER Eq. 15)",
      .traits = {.emits = false, .absorbs = true},
      .parameters = Layer::parameters(),
      .noise = noise,
      .make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
        // kappa = tau_V/(2 z0) envelope Phi a(lambda)/a(V) (GAMER Eq. 15): tau_V is the face-on
        // optical depth through the middle where envelope and noise are 1.
        const LayerShape shape = Layer::read_shape(input);
        auto dust = std::make_unique<Layer>(shape, input.arms);
        dust->set_amplitude(input.values.number("optical_depth") / (2 * shape.z0 * input.axis_z));
        return dust;
      }};
}

}  // namespace gamer
