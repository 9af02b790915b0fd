#pragma once

#include <cstddef>

namespace gamer {

/// Points of a batch are worked on together: enough to hide the dispatch, few enough for all arrays
/// of a galaxy's evaluation to stay in a small second-level cache. Arrays handed to kernels are
/// padded to a multiple of `batch_padding` floats and aligned to `batch_alignment` bytes; kernels
/// may read and write the padding.
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

/// `size` points as structure of arrays (aligned and padded as above).
struct Points {
  const float* x;
  const float* y;
  const float* z;
  std::size_t size;
};

/// `size` rounded up to whole vectors of any target.
inline constexpr std::size_t padded(std::size_t size) {
  return (size + batch_padding - 1) / batch_padding * batch_padding;
}

struct Range {
  float least, most;
};

/// The least and the greatest of at least one value. None may be a NaN.
Range range_of(const float* values, std::size_t size);

}  // namespace gamer
