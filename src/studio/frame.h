#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace gamer {

/// Bytes of a frame: the length of its head (uint32, little endian), the head filled with blanks to
/// a multiple of four bytes, then numbers (float32, little endian).
class FrameEncoder {
 public:
  FrameEncoder(std::string head, std::size_t numbers) {
    static_assert(std::endian::native == std::endian::little);
    head.resize((head.size() + 3) / 4 * 4, ' ');
    bytes_.reserve(sizeof(std::uint32_t) + head.size() + numbers * sizeof(float));
    const auto length = static_cast<std::uint32_t>(head.size());
    bytes_.append(reinterpret_cast<const char*>(&length), sizeof(length));
    bytes_ += head;
  }

  void add(std::span<const double> values) {
    const std::size_t begin = bytes_.size();
    bytes_.resize(begin + values.size() * sizeof(float));
    char* to = bytes_.data() + begin;
    for (const double value : values) {
      const auto single = static_cast<float>(value);
      std::memcpy(to, &single, sizeof(single));
      to += sizeof(single);
    }
  }

  void add(std::string_view bytes) { bytes_ += bytes; }

  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace gamer
