#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "hwy/aligned_allocator.h"

namespace gamer {

/// Memory for vectors of any SIMD target, kept between calls.
class VectorMemory {
 public:
  /// Memory for `size` numbers, aligned for vectors; valid until the next call.
  float* room_for(std::size_t size) {
    numbers_.resize(size + HWY_ALIGNMENT / sizeof(float));
    void* start = numbers_.data();
    std::size_t room = numbers_.size() * sizeof(float);
    return static_cast<float*>(std::align(HWY_ALIGNMENT, size * sizeof(float), start, room));
  }

 private:
  std::vector<float> numbers_;
};

}  // namespace gamer
