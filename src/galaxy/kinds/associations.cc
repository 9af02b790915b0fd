#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "galaxy/associations/association_mean.h"
#include "galaxy/associations/association_texture.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

namespace {

// Points of the surface density's grid along each axis.
constexpr int density_points = 257;

// Surface density below which clumps are fainter instead of rarer, as a share of the largest.
constexpr float least_density = 1e-3f;

// Default of z0: 90 pc for a radius of 15 kpc.
constexpr double young_height = 0.006;

/// A disk of clumps whose number follows its envelope.
class Associations : public Layer {
 public:
  /// `twin` is a component with equal parameters, but for the seed, or null.
  Associations(const LayerShape& shape, const ArmPattern& arms,
               const AssociationParameters& parameters, const Component* twin)
      : Layer(shape, arms) {
    amplitude_ = 1;
    integral_ = twin != nullptr ? twin->envelope_integral() : Layer::envelope_integral();
    if (twin != nullptr) {
      texture_ = std::make_unique<AssociationTexture>(
          static_cast<const AssociationTexture&>(*twin->texture()), parameters.seed);
    } else {
      texture_ = std::make_unique<AssociationTexture>(parameters, surface_density(), shape.z0);
    }
  }

  double envelope_integral() const override { return integral_; }
  bool has_texture_mean() const override { return true; }
  std::vector<double> texture_means(std::span<const double> widths, double error,
                                    std::size_t most_points) const override {
    return association_means(static_cast<const AssociationTexture&>(*texture()), *this, widths,
                             error, most_points);
  }

 private:
  /// The envelope in the mid-plane.
  SurfaceDensity surface_density() const {
    SurfaceDensity density{density_points, std::vector<float>(density_points * density_points)};
    BatchArray x{}, y{}, z{}, envelope;
    for (std::size_t first = 0; first < density.values.size(); first += batch_capacity) {
      const std::size_t size = std::min(batch_capacity, density.values.size() - first);
      for (std::size_t i = 0; i < size; ++i) {
        const auto place = [](std::size_t k) {
          return 2 * static_cast<float>(k) / (density_points - 1) - 1;
        };
        x[i] = place((first + i) % density_points);
        y[i] = place((first + i) / density_points);
      }
      envelope_above_plane({x.data(), y.data(), z.data(), size}, envelope.data());
      std::copy_n(envelope.data(), size, density.values.data() + first);
    }
    const float most = *std::ranges::max_element(density.values);
    for (float& value : density.values) value = std::max(value, least_density * most);
    return density;
  }

  double integral_;
};

ParameterTable association_layer_parameters() {
  ParameterTable table;
  for (Parameter parameter : Layer::parameters()) {
    if (parameter.name == "z0") parameter.default_value = young_height;
    if (parameter.name != "twirl") table.push_back(parameter);
  }
  return table;
}

}  // namespace

ComponentKind associations_kind() {
  ComponentKind kind;
  kind.name = "associations";
  kind.description = "young stars as objects: clumps of all luminosities and ages, in complexes";
  const AssociationParameters defaults;
  kind.parameters = association_layer_parameters();
  kind.texture_parameters = defaults.table();
  kind.make = [defaults](const ComponentInput& input) -> std::unique_ptr<Component> {
    const GalaxySettings& settings = input.settings;
    AssociationParameters parameters = defaults;
    parameters.kind = settings.noise_kind;
    parameters.seed = hash_text(settings.seed, input.name);
    parameters.apply(input.values);
    // The file's seed chooses the clumps of this component; the row's seed still varies them.
    if (input.values.has("seed")) parameters.seed = hash_words({parameters.seed, settings.seed});
    return std::make_unique<Associations>(Layer::read_shape(input), input.arms, parameters,
                                          input.twin);
  };
  return kind;
}

}  // namespace gamer
