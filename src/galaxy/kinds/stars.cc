#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

namespace {

class Stars : public Layer {
 public:
  using Layer::Layer;
  std::string_view kind() const override { return "stars"; }
};

}  // namespace

ComponentKind stars_kind() {
  using component_parameters::operator+;
  ComponentKind kind;
  kind.name = "stars";
  kind.description = "bright young clumps: a disk of high, sparse noise (GAMER section 2.4)";
  kind.parameters =
      component_parameters::common() + component_parameters::light() + Layer::parameters() +
      ParameterTable{{"follows",
                      ParameterType::text,
                      "",
                      Interval::any(),
                      {},
                      "name of the disk component whose noise also modulates this one"}};
  FractalParameters noise;
  noise.octaves = 7;
  noise.k0 = 20;
  noise.frequency_scale = 3;
  noise.spectral_index = 1;
  noise.exponent = 8;
  noise.inverse = false;
  kind.noise = noise;
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    return std::make_unique<Stars>(Layer::read_shape(input.values), input.arms);
  };
  return kind;
}

}  // namespace gamer
