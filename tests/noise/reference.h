#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

#include "gamer/noise/noise.h"

namespace gamer::reference {

// The base noises in double precision, one point at a time, written from their definitions.

using Vector = std::array<double, 3>;

inline constexpr int gradient_count = 12;

inline constexpr std::uint64_t word = std::uint64_t{1} << 32;
inline constexpr std::uint64_t half_word = 65536;

inline std::uint64_t mix(std::uint64_t w) {
  w = (w ^ w / half_word) * 2146121005u % word;
  w = (w ^ w / 32768) * 2221713035u % word;
  return w ^ w / half_word;
}

/// The words of the coordinates of lattice point (i, j, k) under a seed.
inline std::array<std::uint64_t, 3> point_words(std::int64_t i, std::int64_t j, std::int64_t k,
                                                std::uint32_t seed) {
  const std::uint64_t seed_x = mix((seed + 2654435769u) % word);
  const std::uint64_t seed_y = mix((seed_x + 2654435769u) % word);
  const std::uint64_t seed_z = mix((seed_y + 2654435769u) % word);
  const auto coordinate = [](std::int64_t n, std::uint64_t prime, std::uint64_t addend) {
    return (static_cast<std::uint64_t>(n) * prime + addend) % word;
  };
  return {coordinate(i, 2654435761u, seed_x), coordinate(j, 2246822519u, seed_y),
          coordinate(k, 3266489917u, seed_z)};
}

/// The hash of a lattice point, a number of 16 bits for each component.
inline std::uint64_t point_hash(std::int64_t i, std::int64_t j, std::int64_t k, std::uint32_t seed,
                                int component = 0) {
  const auto [a, b, c] = point_words(i, j, k, seed);
  const std::uint64_t combined = a ^ b ^ c;
  const std::uint64_t sum = (a + b) % word;
  const auto as_signed = [](std::uint64_t n) {
    return static_cast<std::int64_t>(n) -
           (n < half_word / 2 ? 0 : static_cast<std::int64_t>(half_word));
  };
  const std::int64_t product = as_signed(combined % half_word) * as_signed(sum % half_word) +
                               as_signed(combined / half_word) * as_signed(sum / half_word);
  const std::uint64_t m = static_cast<std::uint64_t>(product) % word;
  if (component == 0) return m % half_word;
  const std::uint64_t again = (m ^ combined) * 739982445u % word;
  return component == 1 ? again % half_word ^ again / half_word : again / half_word;
}

/// The index of the gradient at a lattice point.
inline int gradient_index(std::int64_t i, std::int64_t j, std::int64_t k, std::uint32_t seed,
                          int component = 0) {
  return static_cast<int>(point_hash(i, j, k, seed, component) * gradient_count / half_word);
}

/// Perlin's 12 gradients, in the order of his 2002 code.
inline Vector gradient(int index) {
  static constexpr Vector table[gradient_count] = {{1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0},
                                                   {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
                                                   {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}};
  return table[index];
}

inline double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Chooses the gradient of a lattice point.
using GradientChoice = std::function<Vector(const std::array<std::int64_t, 3>&, const Vector&)>;

/// Improved Perlin noise with any choice of gradients (given lattice point and offset from it).
inline double perlin(const Vector& p, const GradientChoice& choose) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    std::array<std::int64_t, 3> lattice{};
    Vector offset{};
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(p[axis]);
      const double f = p[axis] - cell;
      const double s = f * f * f * (f * (f * 6 - 15) + 10);
      const int step = (corner >> axis) & 1;
      lattice[axis] = static_cast<std::int64_t>(cell) + step;
      offset[axis] = f - step;
      weight *= step == 1 ? s : 1 - s;
    }
    sum += weight * dot(choose(lattice, offset), offset);
  }
  return sum;
}

/// Simplex noise with any choice of gradients. The sum is over all lattice points nearby, not only
/// the corners of the simplex, so that no order of coordinates is needed.
inline double simplex(const Vector& p, const GradientChoice& choose) {
  const double skew = (p[0] + p[1] + p[2]) / 3;
  std::array<std::int64_t, 3> base{};
  for (int axis = 0; axis < 3; ++axis) {
    base[axis] = static_cast<std::int64_t>(std::floor(p[axis] + skew));
  }
  double sum = 0;
  for (std::int64_t di = -1; di <= 2; ++di) {
    for (std::int64_t dj = -1; dj <= 2; ++dj) {
      for (std::int64_t dk = -1; dk <= 2; ++dk) {
        const std::array<std::int64_t, 3> lattice = {base[0] + di, base[1] + dj, base[2] + dk};
        const double unskew = static_cast<double>(lattice[0] + lattice[1] + lattice[2]) / 6;
        Vector offset{};
        for (int axis = 0; axis < 3; ++axis) {
          offset[axis] = p[axis] - static_cast<double>(lattice[axis]) + unskew;
        }
        const double t = 0.5 - dot(offset, offset);
        if (t > 0) sum += t * t * t * t * dot(choose(lattice, offset), offset);
      }
    }
  }
  return 76.8857 * sum;
}

/// Gives the number of a lattice point, in [-1, 1].
using NumberChoice = std::function<double(const std::array<std::int64_t, 3>&)>;

/// Value noise with any choice of numbers.
inline double value(const Vector& p, const NumberChoice& choose) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    std::array<std::int64_t, 3> lattice{};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(p[axis]);
      const double f = p[axis] - cell;
      const double s = f * f * f * (f * (f * 6 - 15) + 10);
      const int step = (corner >> axis) & 1;
      lattice[axis] = static_cast<std::int64_t>(cell) + step;
      weight *= step == 1 ? s : 1 - s;
    }
    sum += weight * choose(lattice);
  }
  return sum;
}

/// One component of a cell's number.
inline double cell_number(const std::array<std::int64_t, 3>& cell, std::uint32_t seed,
                          int component) {
  const auto [a, b, c] = point_words(cell[0], cell[1], cell[2], seed);
  std::uint64_t hash = mix(mix(mix(a) ^ b) ^ c);
  for (; component > 0; --component) hash = mix((hash + 2654435769u) % word);
  const double number = static_cast<double>(hash);
  return (number < 0x1p31 ? number : number - 0x1p32) / 0x1p31;
}

inline double evaluate(const std::string& kind, const Vector& p, const GradientChoice& choose) {
  if (kind == "perlin") return perlin(p, choose);
  if (kind == "simplex") return simplex(p, choose);
  throw std::logic_error("no reference of noise '" + kind + "'");
}

/// The representative of a lattice point among the points identified with it, within [0, |P|[ or a
/// period.
inline std::array<std::int64_t, 3> identify(std::array<std::int64_t, 3> point,
                                            const Octave& octave) {
  const auto turns = [](std::int64_t n, std::int64_t size) {
    return (n - (n % size + size) % size) / size;
  };
  const std::int64_t p = octave.translation[0];
  const std::int64_t q = octave.translation[1];
  if (p != 0 || q != 0) {
    const std::int64_t leading = p != 0 ? p : q;
    const std::int64_t sign = leading < 0 ? -1 : 1;
    const std::int64_t count = sign * turns(p != 0 ? point[0] : point[1], sign * leading);
    point[0] -= count * p;
    point[1] -= count * q;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t period = octave.period[axis];
    if (period != 0) point[axis] -= turns(point[axis], period) * period;
  }
  return point;
}

/// A component of octave.weight P(frequency p + offset).
inline double evaluate(const std::string& kind, const Vector& p, const Octave& octave,
                       int component = 0) {
  Vector q;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    q[axis] = double{octave.frequency} * p[axis] + double{octave.offset[axis]};
  }
  if (kind == "cell") {
    std::array<std::int64_t, 3> cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cell[axis] = static_cast<std::int64_t>(std::floor(q[axis]));
    }
    return double{octave.weight} * cell_number(identify(cell, octave), octave.seed, component);
  }
  if (kind == "value") {
    return double{octave.weight} * value(q, [&](const std::array<std::int64_t, 3>& c) {
             const auto [i, j, k] = identify(c, octave);
             const auto hash = static_cast<double>(point_hash(i, j, k, octave.seed, component));
             const double number = (hash + 0.5) / half_word;
             return 2 * (number < 0.5 ? number : number - 1);
           });
  }
  const auto choose = [&](const std::array<std::int64_t, 3>& c, const Vector&) {
    const auto [i, j, k] = identify(c, octave);
    return gradient(gradient_index(i, j, k, octave.seed, component));
  };
  return double{octave.weight} * evaluate(kind, q, choose);
}

inline double evaluate(const std::string& kind, const Vector& p, std::uint32_t seed) {
  Octave octave;
  octave.seed = seed;
  return evaluate(kind, p, octave);
}

/// The gradient that gives the largest value at a point.
inline Vector steepest_gradient(const std::array<std::int64_t, 3>& /*lattice*/,
                                const Vector& offset) {
  Vector best = gradient(0);
  for (int index = 1; index < gradient_count; ++index) {
    if (dot(gradient(index), offset) > dot(best, offset)) best = gradient(index);
  }
  return best;
}

}  // namespace gamer::reference
