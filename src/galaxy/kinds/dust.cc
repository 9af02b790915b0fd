#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

namespace {

/// kappa = tau_V/(2 z0) envelope Phi a(lambda)/a(V) (GAMER Eq. 15): tau_V is the face-on optical
/// depth through the middle where envelope and noise are 1.
class Dust : public Layer {
 public:
  Dust(const LayerShape& shape, const ArmPattern& arms, double optical_depth, double axis_z)
      : Layer(shape, arms) {
    amplitude_ = optical_depth / (2 * shape.z0 * axis_z);
  }
  std::string_view kind() const override { return "dust"; }
};

}  // namespace

ComponentKind dust_kind() {
  using component_parameters::operator+;
  ComponentKind kind;
  kind.name = "dust";
  kind.description = "absorbing layer, textured by inverse noise (GAMER Eq. 15)";
  kind.parameters =
      component_parameters::common() + Layer::parameters() + component_parameters::dust();
  FractalParameters noise;
  noise.octaves = 8;
  noise.k0 = 0;
  noise.frequency_scale = 1;
  noise.spectral_index = 1;
  noise.exponent = 4;
  noise.inverse = true;
  noise.floor = 0.3;
  kind.noise = noise;
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    return std::make_unique<Dust>(Layer::read_shape(input.values), input.arms,
                                  input.values.number("optical_depth"), input.axis_z);
  };
  return kind;
}

}  // namespace gamer
