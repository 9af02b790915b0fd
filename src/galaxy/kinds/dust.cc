#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

ComponentKind dust_kind() {
  return {
      .name = "dust",
      .description = "absorbing layer, textured by inverse noise (GAMER Eq. 15)",
      .traits = {.emits = false, .absorbs = true},
      .parameters = Layer::parameters(),
      .noise = FractalParameters{.exponent = 4, .inverse = true, .floor = 0.3},
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
