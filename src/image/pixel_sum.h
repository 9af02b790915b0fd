#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace gamer {

/// The FITS checksum of pixels: the ones' complement sum of their big-endian 32-bit words. It does
/// not depend on the order of the pixels.
class PixelSum {
 public:
  void add(const float* values, std::size_t count) {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += std::bit_cast<std::uint32_t>(values[i]);
    add(sum);
  }
  void add(const double* values, std::size_t count) {
    std::uint64_t high = 0, low = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto bits = std::bit_cast<std::uint64_t>(values[i]);
      high += bits >> 32;
      low += bits & word;
    }
    add(high);
    add(low);
  }
  void add(const PixelSum& other) { add(other.sum_); }
  std::uint32_t value() const { return static_cast<std::uint32_t>(sum_); }

 private:
  static constexpr std::uint64_t word = 0xFFFFFFFF;
  void add(std::uint64_t sum) {
    sum_ += (sum & word) + (sum >> 32);
    while (sum_ >> 32 != 0) sum_ = (sum_ & word) + (sum_ >> 32);
  }
  std::uint64_t sum_ = 0;
};

}  // namespace gamer
