#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "gamer/core/random.h"
#include "gamer/galaxy/component.h"

namespace gamer {

/// The largest ratio of an envelope along random rays and their neighbours to
/// Component::column_brightness(). `envelope(place)` is a share of the peak, and `height` that of
/// the layer. Rays where the envelope is below `least` do not count.
template <class Envelope>
double largest_over_brightness(const Component& component, double height, double least,
                               const Envelope& envelope) {
  std::uint64_t count = 0;
  const auto random = [&] { return to_unit(mix64(++count * golden_gamma)); };
  const auto direction = [&] {
    const double z = 2 * random() - 1, phi = 2 * 3.14159265358979 * random();
    const double r = std::sqrt(1 - z * z);
    return glm::dvec3(r * std::cos(phi), r * std::sin(phi), z);
  };
  const auto across = [&](const glm::dvec3& along) {
    return glm::normalize(glm::cross(along, direction()));
  };
  constexpr int rays = 3000, neighbours = 12, steps = 60;
  double worst = 0;
  for (int ray = 0; ray < rays; ++ray) {
    const glm::dvec3 d = direction(), nearest = 1.1 * random() * across(d);
    const double reach = std::pow(10, -3 + 2.7 * random());
    const double brightness = component.column_brightness(&nearest.x, &d.x, reach);
    double largest = 0;
    for (int k = 0; k < neighbours; ++k) {
      const glm::dvec3 o = nearest + reach * random() * across(d);
      const double plane = -o.z / d.z;
      for (int i = 0; i <= steps; ++i) {
        const double part = 2.0 * i / steps - 1;
        largest = std::max(
            {largest, envelope(o + (plane + 3 * part * height / d.z) * d), envelope(o + part * d)});
      }
    }
    if (largest > least) worst = std::max(worst, largest / brightness);
  }
  return worst;
}

}  // namespace gamer
