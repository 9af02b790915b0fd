#pragma once

#include <cstddef>

namespace gamer {

/// Number of points of a batch. The number is large enough to hide the cost of dispatch, and small
/// enough for a galaxy's arrays to stay in a small second-level cache. Kernels' arrays are padded
/// to a multiple of `batch_padding` floats and aligned to `batch_alignment` bytes; kernels may read
/// and write the padding.
inline constexpr std::size_t batch_capacity = 512;
inline constexpr std::size_t batch_padding = 16;
inline constexpr std::size_t batch_alignment = 64;

/// An aligned, padded array of one quantity over a batch.
struct alignas(batch_alignment) BatchArray {
  float values[batch_capacity];

  float* data() { return values; }
  const float* data() const { return values; }
  float& operator[](std::size_t i) { return values[i]; }
  float operator[](std::size_t i) const { return values[i]; }
};

/// `size` points as a structure of arrays, aligned and padded as above.
struct Points {
  const float* x;
  const float* y;
  const float* z;
  std::size_t size;
};

/// `size` rounded up to whole vectors of any SIMD target.
inline constexpr std::size_t padded(std::size_t size) {
  return (size + batch_padding - 1) / batch_padding * batch_padding;
}

struct Range {
  float least, most;
};

/// The least and the greatest value; size >= 1. No value may be NaN.
Range range_of(const float* values, std::size_t size);

}  // namespace gamer
