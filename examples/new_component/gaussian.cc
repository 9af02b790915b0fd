#include "gaussian.h"

#include <gamer/galaxy/kinds/smooth_shape.h>

#include <cmath>

gamer::ComponentKind gaussian_kind() {
  using namespace gamer;
  ComponentKind kind;
  kind.name = "gaussian";
  kind.description = "ellipsoid of Gaussian density: I_m exp(-(x^2 + y^2 + z^2/q^2)/(2 sigma^2))";
  kind.parameters = {
      Parameter::number("sigma", "galaxy radii", Interval::closed(0.01, 0.2), 0.1,
                        "standard deviation in the plane"),
      Parameter::number("q", "", Interval::closed(0.1, 1), 1.0, "height over width"),
  };
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    const double sigma = input.values.number("sigma"), q = input.values.number("q");
    const auto density = [=](double x, double y, double z) {
      return std::exp(-(x * x + y * y + z * z / (q * q)) / (2 * sigma * sigma));
    };
    return std::make_unique<SmoothShape>(density, sigma * q);
  };
  return kind;
}
