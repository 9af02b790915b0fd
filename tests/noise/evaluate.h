#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "gamer/core/random.h"
#include "gamer/noise/noise.h"
#include "noise/reference.h"

namespace gamer {

using Vector = reference::Vector;

/// Calls `work(points, first)` for batches that cover `positions`.
template <typename Work>
void for_each_batch(std::span<const Vector> positions, Work&& work) {
  for (std::size_t first = 0; first < positions.size(); first += batch_capacity) {
    BatchArray x{}, y{}, z{};
    const std::size_t size = std::min(batch_capacity, positions.size() - first);
    for (std::size_t i = 0; i < size; ++i) {
      x[i] = static_cast<float>(positions[first + i][0]);
      y[i] = static_cast<float>(positions[first + i][1]);
      z[i] = static_cast<float>(positions[first + i][2]);
    }
    work(Points{x.data(), y.data(), z.data(), size}, first);
  }
}

/// The sum of octaves at any number of positions.
inline std::vector<float> evaluate(const Noise& noise, std::span<const Vector> positions,
                                   std::span<const Octave> octaves) {
  std::vector<float> result(positions.size());
  for_each_batch(positions, [&](const Points& points, std::size_t first) {
    BatchArray out;
    noise.sum(points, octaves, out.data());
    std::copy_n(out.data(), points.size, result.data() + first);
  });
  return result;
}

/// Each component of the sum of octaves of a noise with a vector value.
inline std::vector<std::vector<float>> evaluate_vector(const Noise& noise,
                                                       std::span<const Vector> positions,
                                                       std::span<const Octave> octaves,
                                                       std::size_t components) {
  std::vector<std::vector<float>> result(components, std::vector<float>(positions.size()));
  for_each_batch(positions, [&](const Points& points, std::size_t first) {
    std::vector<BatchArray> out(components);
    std::vector<float*> arrays;
    for (BatchArray& array : out) arrays.push_back(array.data());
    noise.sum_vector(points, octaves, arrays);
    for (std::size_t c = 0; c < components; ++c) {
      std::copy_n(out[c].data(), points.size, result[c].data() + first);
    }
  });
  return result;
}

/// A combination of octaves.
inline std::vector<float> combine(const Noise& noise, const Combination& combination,
                                  std::span<const Vector> positions,
                                  std::span<const Octave> octaves) {
  std::vector<float> result(positions.size());
  for_each_batch(positions, [&](const Points& points, std::size_t first) {
    BatchArray out;
    noise.combine(combination, points, octaves, out.data());
    std::copy_n(out.data(), points.size, result.data() + first);
  });
  return result;
}

/// The base noise with one seed.
inline std::vector<float> evaluate(const Noise& noise, std::span<const Vector> positions,
                                   std::uint32_t seed) {
  Octave octave;
  octave.seed = seed;
  return evaluate(noise, positions, {&octave, 1});
}

/// Hashed numbers in [0, 1).
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}
  double unit() { return to_unit(hash_words({seed_, ++count_})); }
  double between(double low, double high) { return low + (high - low) * unit(); }
  std::uint32_t word() { return static_cast<std::uint32_t>(hash_words({seed_, ++count_})); }
  /// A position in the cube [-half, half[^3, exact in single precision; half is a power of two.
  Vector position(double half) {
    constexpr int bits = 24;
    Vector p;
    for (double& c : p) c = half * (std::ldexp(word() >> (32 - bits), 1 - bits) - 1);
    return p;
  }

 private:
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
};

inline std::vector<Vector> positions_in_cube(std::size_t count, double half, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vector> positions(count);
  for (Vector& p : positions) p = random.position(half);
  return positions;
}

/// The correlation of numbers whose mean is 0.
inline double correlation(const std::vector<float>& a, const std::vector<float>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += double{a[i]} * b[i];
    aa += double{a[i]} * a[i];
    bb += double{b[i]} * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

}  // namespace gamer
