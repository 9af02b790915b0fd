#include <memory>

#include "galaxy/veins/vein_texture.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

namespace {

/// A disk whose envelope has no arms; VeinTexture draws them.
class Veins : public Layer {
 public:
  Veins(const LayerShape& shape, double amplitude, std::unique_ptr<Texture> texture)
      : Layer(shape, ArmPattern()) {
    amplitude_ = amplitude;
    texture_ = std::move(texture);
  }
};

ParameterTable vein_layer_parameters() {
  ParameterTable table;
  for (const Parameter& parameter : Layer::parameters()) {
    if (parameter.name != "arm_width" && parameter.name != "twirl") table.push_back(parameter);
  }
  return table;
}

std::unique_ptr<Texture> make_texture(const ComponentInput& input, VeinParameters parameters,
                                      const LayerShape& shape) {
  const GalaxySettings& settings = input.settings;
  parameters.small_kind = settings.noise_kind;
  parameters.seed = hash_text(settings.seed, input.name);
  parameters.apply(input.values);
  if (!input.values.is_given("octaves") && settings.octaves) parameters.octaves = *settings.octaves;
  // The file's seeds choose the noise of this component; the row's seed still varies it.
  if (input.values.has("seed")) parameters.seed = hash_words({parameters.seed, settings.seed});
  parameters.pattern_seed = hash_words({parameters.pattern_seed, settings.seed});
  if (!SpiralCoordinates::fits(input.arms)) {
    throw InputError(input.node.where,
                     input.context + (input.arms.has_arms()
                                          ? "veins need arms that are evenly spread"
                                          : "veins need [arms] with a model and at least one arm"));
  }
  return std::make_unique<VeinTexture>(parameters, SpiralCoordinates(input.arms, shape.shift),
                                       2 * shape.z0);
}

}  // namespace

ComponentKind veins_kind() {
  ComponentKind kind;
  kind.name = "veins";
  kind.description =
      "absorbing layer of veins along the arms and of spurs that leave them (Bizard 2018)";
  kind.traits = {.emits = false, .absorbs = true};
  const VeinParameters defaults;
  kind.parameters = vein_layer_parameters();
  kind.texture_parameters = defaults.table();
  kind.make = [defaults](const ComponentInput& input) -> std::unique_ptr<Component> {
    const LayerShape shape = Layer::read_shape(input, false);
    return std::make_unique<Veins>(
        shape, input.values.number("optical_depth") / (2 * shape.z0 * input.axis_z),
        make_texture(input, defaults, shape));
  };
  return kind;
}

ComponentKind veins_light_kind() {
  ComponentKind kind;
  kind.name = "veins_light";
  kind.description = "light in knots along veins: the H II regions and young stars of the arms";
  VeinParameters defaults;
  defaults.density_low = 0.1;
  defaults.clumpiness = 5;
  kind.parameters = vein_layer_parameters();
  kind.texture_parameters = defaults.table();
  kind.make = [defaults](const ComponentInput& input) -> std::unique_ptr<Component> {
    const LayerShape shape = Layer::read_shape(input, false);
    return std::make_unique<Veins>(shape, 1.0, make_texture(input, defaults, shape));
  };
  return kind;
}

}  // namespace gamer
