// Kernels of all kinds of noise against a reference in double precision, on every SIMD target.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "noise/evaluate.h"

namespace gamer::kernel_test {
namespace {

/// The error that a kernel's comment states: constant + per_cell times the largest |coordinate|.
struct Accuracy {
  double constant;
  double per_cell;
};

Accuracy stated_accuracy(const Noise& noise) {
  static const std::map<std::string, Accuracy> stated = {
      {"perlin", {2e-6, 0}}, {"value", {2e-6, 0}}, {"cell", {2e-7, 0}}, {"simplex", {1e-6, 8e-7}}};
  return stated.at(std::string(noise.name()));
}

double worst_error(const Noise& noise, const std::vector<Vector>& positions, std::uint32_t seed) {
  const std::vector<float> found = evaluate(noise, positions, seed);
  double worst = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double exact = reference::evaluate(std::string(noise.name()), positions[i], seed);
    worst = std::max(worst, std::abs(found[i] - exact));
  }
  return worst;
}

/// Positions on a grid around the origin, on faces, edges and corners of lattice cells.
std::vector<Vector> grid(double half, double spacing) {
  std::vector<Vector> positions;
  for (double x = -half; x <= half; x += spacing) {
    for (double y = -half; y <= half; y += spacing) {
      for (double z = -half; z <= half; z += spacing) positions.push_back({x, y, z});
    }
  }
  return positions;
}

TEST(NoiseKernels, EveryTargetEqualsTheReference) {
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const Accuracy accuracy = stated_accuracy(*noise);
    for (const double half : {1.0, 16.0, 1024.0, 32768.0}) {
      const std::vector<Vector> positions = positions_in_cube(5000, half, 1);
      for_each_simd_target([&] {
        for (const std::uint32_t seed : {0u, 1u, 0x80000000u, 0xdeadbeefu}) {
          EXPECT_LT(worst_error(*noise, positions, seed),
                    accuracy.constant + accuracy.per_cell * half)
              << "within " << half << ", seed " << seed;
        }
      });
    }
  }
}

TEST(NoiseKernels, EveryTargetEqualsTheReferenceOnFacesOfCells) {
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const Accuracy accuracy = stated_accuracy(*noise);
    for_each_simd_target([&] {
      EXPECT_LT(worst_error(*noise, grid(2, 0.25), 7), accuracy.constant + accuracy.per_cell * 2);
    });
  }
}

/// Octaves and positions whose products and sums are exact in single precision, with coordinates
/// below 13.
std::vector<Octave> some_octaves() {
  std::vector<Octave> octaves(3);
  octaves[0] = {1, 1, {0, 0, 0}, 11};
  octaves[1] = {3, -0.5f, {0.25f, -7.5f, 3}, 12};
  octaves[2] = {5, 0.125f, {2.5f, 0.75f, -1}, 13};
  return octaves;
}

std::vector<Vector> exact_positions(std::size_t count, double half) {
  std::vector<Vector> positions = positions_in_cube(count, half, 2);
  for (Vector& p : positions) {
    for (double& c : p) c = std::floor(c * 1024) / 1024;
  }
  return positions;
}

TEST(NoiseKernels, SumIsTheWeightedSumOfOctaves) {
  const std::vector<Octave> octaves = some_octaves();
  const std::vector<Vector> positions = exact_positions(3000, 1);
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const Accuracy accuracy = stated_accuracy(*noise);
    for_each_simd_target([&] {
      const std::vector<float> found = evaluate(*noise, positions, octaves);
      double worst = 0;
      for (std::size_t i = 0; i < positions.size(); ++i) {
        double exact = 0;
        for (const Octave& octave : octaves) {
          exact += reference::evaluate(std::string(noise->name()), positions[i], octave);
        }
        worst = std::max(worst, std::abs(found[i] - exact));
      }
      EXPECT_LT(worst, accuracy.constant + accuracy.per_cell * 13);
    });
  }
}

TEST(NoiseKernels, ComponentsOfAVectorEqualTheReference) {
  const std::vector<Octave> octaves = some_octaves();
  const std::vector<Vector> positions = exact_positions(3000, 1);
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const Accuracy accuracy = stated_accuracy(*noise);
    for_each_simd_target([&] {
      const std::vector<float> scalar = evaluate(*noise, positions, octaves);
      for (std::size_t components = 1; components <= Noise::most_components; ++components) {
        const auto found = evaluate_vector(*noise, positions, octaves, components);
        EXPECT_EQ(found[0], scalar);
        double worst = 0;
        for (std::size_t c = 0; c < components; ++c) {
          for (std::size_t i = 0; i < positions.size(); ++i) {
            double exact = 0;
            for (const Octave& octave : octaves) {
              exact += reference::evaluate(std::string(noise->name()), positions[i], octave,
                                           static_cast<int>(c));
            }
            worst = std::max(worst, std::abs(double{found[c][i]} - exact));
          }
        }
        EXPECT_LT(worst, accuracy.constant + accuracy.per_cell * 13);
      }
    });
  }
}

/// Octaves, more than kernels take at once.
std::vector<Octave> many_octaves() {
  std::vector<Octave> octaves(19);
  for (std::size_t k = 0; k < octaves.size(); ++k) {
    octaves[k].frequency = static_cast<float>(k % 5 + 1);
    octaves[k].weight = k % 3 == 0 ? 2.5f : 0.75f;
    octaves[k].seed = static_cast<std::uint32_t>(100 + k);
  }
  return octaves;
}

double combined(const Combination& combination, const std::vector<double>& values,
                const std::vector<Octave>& octaves) {
  double sum = 0, product = 1, ridges = 0, last = 1 / double{combination.ridge_gain};
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double weight = octaves[k].weight;
    sum += weight * std::abs(values[k]);
    product *= std::clamp(1 + weight * values[k], 0.0, 2.0);
    last = std::pow(double{combination.ridge_offset} - std::abs(values[k]), 2) *
           std::clamp(double{combination.ridge_gain} * last, 0.0, 1.0);
    ridges += weight * last;
  }
  switch (combination.kind) {
    case Combination::Kind::billow: return sum;
    case Combination::Kind::multiplicative: return product;
    case Combination::Kind::ridged: return ridges;
    default: throw std::logic_error("no reference of this combination");
  }
}

TEST(NoiseKernels, CombinationsAreThoseOfTheirFormulas) {
  const std::vector<Octave> octaves = many_octaves();
  const std::vector<Vector> positions = exact_positions(500, 2);
  using enum Combination::Kind;
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const Accuracy accuracy = stated_accuracy(*noise);
    std::vector<std::vector<double>> values(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
      for (Octave octave : octaves) {
        octave.weight = 1;
        values[i].push_back(reference::evaluate(std::string(noise->name()), positions[i], octave));
      }
    }
    for (const Combination& combination :
         {Combination{billow}, Combination{multiplicative}, Combination{ridged, 1, 2},
          Combination{ridged, 0.75f, 3}}) {
      SCOPED_TRACE(static_cast<int>(combination.kind));
      for_each_simd_target([&] {
        const std::vector<float> found = combine(*noise, combination, positions, octaves);
        double worst = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
          const double exact = combined(combination, values[i], octaves);
          worst = std::max(worst, std::abs(double{found[i]} - exact) / (1 + std::abs(exact)));
        }
        EXPECT_LT(worst, octaves.size() * (accuracy.constant + accuracy.per_cell * 10));
      });
    }
    EXPECT_EQ(combine(*noise, {}, positions, octaves), evaluate(*noise, positions, octaves));
  }
}

TEST(NoiseKernels, ValueDoesNotDependOnTheBatch) {
  const std::vector<Vector> positions = positions_in_cube(777, 8, 3);
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    for_each_simd_target([&] {
      const std::vector<float> together = evaluate(*noise, positions, 5);
      for (std::size_t i = 0; i < positions.size(); i += 61) {
        EXPECT_EQ(evaluate(*noise, {&positions[i], 1}, 5).front(), together[i]);
      }
    });
  }
}

}  // namespace
}  // namespace gamer::kernel_test
