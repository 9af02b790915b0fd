#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include "gamer/core/random.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

using Vector = std::array<double, 3>;

/// densities[c][i] of component c at position i.
inline std::vector<std::vector<float>> evaluate(const Galaxy& galaxy,
                                                std::span<const Vector> positions,
                                                float threshold = 0,
                                                std::size_t batch_size = batch_capacity) {
  const std::size_t components = galaxy.components().size();
  std::vector<std::vector<float>> result(components);
  std::vector<BatchArray> densities(components);
  for (std::size_t first = 0; first < positions.size(); first += batch_size) {
    BatchArray x{}, y{}, z{};
    const std::size_t size = std::min(batch_size, positions.size() - first);
    for (std::size_t i = 0; i < size; ++i) {
      x[i] = static_cast<float>(positions[first + i][0]);
      y[i] = static_cast<float>(positions[first + i][1]);
      z[i] = static_cast<float>(positions[first + i][2]);
    }
    EvaluationCounts counts;
    galaxy.evaluate({x.data(), y.data(), z.data(), size}, threshold, nullptr, {}, densities,
                    counts);
    for (std::size_t c = 0; c < components; ++c) {
      result[c].insert(result[c].end(), densities[c].data(), densities[c].data() + size);
    }
  }
  return result;
}

/// Cells of a layer in r, phi and z.
struct LayerCells {
  double z0;
  int radial, azimuthal, vertical;
};

/// Monte Carlo integrals over the ball of the last component's density of each galaxy. There is one
/// hashed point in each cell. Cells are equal in r^(1/1.3), phi and the share of sech^2(z/z0).
inline std::vector<double> integrate(std::span<const std::shared_ptr<const Galaxy>> galaxies,
                                     const LayerCells& cells) {
  constexpr double power = 1.3;
  std::vector<double> result(galaxies.size());
  std::uint64_t count = 0;
  const auto jitter = [&] { return to_unit(mix64(++count * golden_gamma)); };
  std::vector<Vector> positions;
  std::vector<double> volumes;
  for (int i = 0; i < cells.radial; ++i) {
    positions.clear();
    volumes.clear();
    for (int j = 0; j < cells.azimuthal; ++j) {
      for (int k = 0; k < cells.vertical; ++k) {
        const double u = (i + jitter()) / cells.radial;
        const double phi = 2 * std::numbers::pi * (j + jitter()) / cells.azimuthal;
        const double v = 2 * (k + jitter()) / cells.vertical - 1;
        const double r = std::pow(u, power);
        positions.push_back({r * std::cos(phi), r * std::sin(phi), cells.z0 * std::atanh(v)});
        // dr = power u^(power - 1) du, dz = z0 dv/(1 - v^2).
        volumes.push_back(r * power * r / u * 2 * cells.z0 / (1 - v * v));
      }
    }
    for (std::size_t g = 0; g < galaxies.size(); ++g) {
      const std::vector<float> densities = evaluate(*galaxies[g], positions).back();
      for (std::size_t n = 0; n < volumes.size(); ++n) result[g] += densities[n] * volumes[n];
    }
  }
  const double points = double{1} * cells.radial * cells.azimuthal * cells.vertical;
  for (double& value : result) value *= 2 * std::numbers::pi / points;
  return result;
}

}  // namespace gamer
