// The kernels of all kinds of noise against the double precision reference, on every SIMD target.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "noise/evaluate.h"

namespace gamer {
namespace {

/// The error that a kernel's comment states: constant + per_cell * largest |coordinate|.
struct Accuracy {
  double constant;
  double per_cell;
};

Accuracy stated_accuracy(const Noise& noise) {
  static const std::map<std::string, Accuracy> stated = {{"perlin", {2e-6, 0}},
                                                         {"simplex", {1e-6, 8e-7}}};
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

/// Positions on a grid around the origin, so on faces, edges and corners of the lattices' cells.
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

TEST(NoiseKernels, SumIsTheWeightedSumOfOctaves) {
  // Frequencies, offsets and positions whose products and sums are exact in single precision.
  std::vector<Octave> octaves(3);
  octaves[0] = {1, 1, {0, 0, 0}, 11};
  octaves[1] = {3, -0.5f, {0.25f, -7.5f, 3}, 12};
  octaves[2] = {5, 0.125f, {2.5f, 0.75f, -1}, 13};
  std::vector<Vector> positions = positions_in_cube(3000, 1, 2);
  for (Vector& p : positions) {
    for (double& c : p) c = std::floor(c * 1024) / 1024;
  }
  for (const Noise* noise : noise_kinds()) {
    SCOPED_TRACE(noise->name());
    const Accuracy accuracy = stated_accuracy(*noise);
    for_each_simd_target([&] {
      const std::vector<float> found = evaluate(*noise, positions, octaves);
      double worst = 0;
      for (std::size_t i = 0; i < positions.size(); ++i) {
        double exact = 0;
        for (const Octave& octave : octaves) {
          Vector p = positions[i];
          for (int axis = 0; axis < 3; ++axis) {
            p[axis] = octave.frequency * p[axis] + octave.offset[axis];
          }
          exact += octave.weight * reference::evaluate(std::string(noise->name()), p, octave.seed);
        }
        worst = std::max(worst, std::abs(found[i] - exact));
      }
      EXPECT_LT(worst, accuracy.constant + accuracy.per_cell * 10);
    });
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
}  // namespace gamer
