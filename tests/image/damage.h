#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gamer/core/error.h"

namespace gamer {

/// Makes damaged copies of a file, each of which follows from its seed on any machine.
class Damage {
 public:
  explicit Damage(unsigned seed) : random_(seed) {}

  /// A FITS file with bytes as in of_bytes(), with cards changed, removed or repeated, or blocks
  /// swapped.
  std::string of_fits(std::string bytes) {
    constexpr std::size_t record_size = 80, block_size = 2880;
    switch (below(7)) {
      case 0: {
        const std::size_t a = below(bytes.size() / block_size),
                          b = below(bytes.size() / block_size);
        const std::string moved = bytes.substr(a * block_size, block_size);
        bytes.replace(a * block_size, block_size, bytes.substr(b * block_size, block_size));
        bytes.replace(b * block_size, block_size, moved);
        return bytes;
      }
      case 1: return bytes.erase(below(bytes.size() / block_size) * block_size, block_size);
      case 2: {
        const std::size_t from = card(bytes), to = card(bytes);
        return bytes.replace(to, record_size, bytes.substr(from, record_size));
      }
      case 3:
      case 4: {
        std::string value(values_[below(values_.size())]);
        value.resize(record_size - 10, ' ');
        return bytes.replace(card(bytes) + 10, value.size(), value);
      }
      default: return of_bytes(std::move(bytes));
    }
  }

  /// Any file, cut off or with bits flipped or bytes replaced.
  std::string of_bytes(std::string bytes) {
    const std::size_t count = 1 + below(8);
    switch (below(3)) {
      case 0: bytes.resize(below(bytes.size())); break;
      case 1:
        for (std::size_t i = 0; i < count; ++i) {
          char& byte = bytes[below(bytes.size())];
          byte = static_cast<char>(byte ^ (1 << below(8)));
        }
        break;
      default: {
        const std::size_t first = below(bytes.size());
        for (std::size_t i = first; i < bytes.size() && i < first + count; ++i) {
          bytes[i] = static_cast<char>(below(256));
        }
      }
    }
    return bytes;
  }

  /// A text with bytes as in of_bytes(), or with words and lines changed, removed or repeated.
  std::string of_text(std::string text) {
    const std::size_t at = below(text.size());
    const auto bounds = [&](std::string_view separators) {
      const std::size_t first = text.find_last_of(separators, at) + 1;
      const std::size_t last = std::min(text.find_first_of(separators, first), text.size());
      return std::pair(first, last - first);
    };
    switch (below(4)) {
      case 0: {
        const auto [first, count] = bounds(" \n");
        return text.replace(first, count, values_[below(values_.size())]);
      }
      case 1: {
        const auto [first, count] = bounds("\n");
        return text.erase(first, count);
      }
      case 2: {
        const auto [first, count] = bounds("\n");
        return text.insert(below(text.size()), text.substr(first, count));
      }
      default: return of_bytes(std::move(text));
    }
  }

  std::size_t below(std::size_t count) { return count == 0 ? 0 : random_() % count; }

 private:
  /// The place of one of the cards with a value; 0 where there is none.
  std::size_t card(const std::string& bytes) {
    constexpr std::size_t record_size = 80;
    std::vector<std::size_t> cards;
    for (std::size_t i = 0; i + record_size <= bytes.size(); i += record_size) {
      if (bytes[i] >= 'A' && bytes[i] <= 'Z' && bytes.compare(i + 8, 2, "= ") == 0) {
        cards.push_back(i);
      }
    }
    return cards.empty() ? 0 : cards[below(cards.size())];
  }

  static constexpr std::array<std::string_view, 20> values_ = {"-1",         "0",
                                                               "1",          "2",
                                                               "3",          "7",
                                                               "99",         "100",
                                                               "140",        "999",
                                                               "1000",       "2147483647",
                                                               "4294967296", "9223372036854775807",
                                                               "1.5",        "-1E+300",
                                                               "'text'",     "T",
                                                               "nan",        ""};
  std::mt19937 random_;
};

/// The number of damaged files of each kind.
inline constexpr unsigned damaged_files = 500;

/// Writes damaged copies, made by damage(damage, seed), to `path` and reads each. It must be read,
/// or end in an InputError that names it.
template <class Make, class Read>
void expect_errors_that_name(const std::filesystem::path& path, const Make& make,
                             const Read& read) {
  unsigned errors = 0;
  for (unsigned seed = 0; seed < damaged_files; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Damage damage(seed);
    std::ofstream(path, std::ios::binary) << make(damage, seed);
    try {
      read();
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(path.filename().string()), std::string::npos) << text;
      ++errors;
    }
  }
  // Enough damages hit the file.
  EXPECT_GT(errors, damaged_files / 10);
}

}  // namespace gamer
