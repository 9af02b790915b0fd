#include "gamer/core/digest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "gamer/core/random.h"

namespace gamer {

std::string digest(std::string_view text) {
  std::uint64_t first = hash_words({1, text.size()}), second = hash_words({2, text.size()});
  while (!text.empty()) {
    std::uint64_t word = 0;
    const std::size_t bytes = std::min(text.size(), sizeof word);
    std::memcpy(&word, text.data(), bytes);
    text.remove_prefix(bytes);
    // For a given `word`, each step maps `first` and `second` one to one, so that no step loses
    // information. Different texts have equal digests only if both numbers agree by chance.
    first = mix64(first ^ word) + golden_gamma;
    second = mix64(second + word) ^ golden_gamma;
  }
  return fmt::format("{:016x}{:016x}", mix64(first), mix64(second));
}

}  // namespace gamer
