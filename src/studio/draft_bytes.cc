#include "studio/draft_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "gamer/core/error.h"

namespace gamer {
namespace {

// Bits of the mantissa that are left out.
constexpr unsigned dropped = 4;
constexpr int largest_code = 0x7bff >> dropped;
// Differences are mostly small, so that more effort gains little.
constexpr int effort = 1;

int code_of(std::uint16_t half) {
  const unsigned even = (half >> dropped) & 1u;
  return std::min(static_cast<int>((half + (1u << (dropped - 1)) - 1 + even) >> dropped),
                  largest_code);
}

std::uint16_t folded(int difference) {
  return static_cast<std::uint16_t>(difference < 0 ? -2 * difference - 1 : 2 * difference);
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string result(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()),
                               static_cast<uLong>(bytes.size()), effort);
  if (status != Z_OK) throw RunError("a draft cannot be compressed");
  result.resize(size);
  return result;
}

/// Collects the differences along x of codes of voxels, as high and low bytes.
class Differences {
 public:
  Differences(std::size_t row, std::size_t numbers) : row_(row) {
    high_.reserve(2 * numbers);
    low_.reserve(numbers);
  }

  /// Adds one number of each voxel, `step` apart, minus the number `base`, which may be null.
  void add(const std::uint16_t* number, const std::uint16_t* base, std::size_t voxels,
           std::size_t step, std::size_t base_step) {
    int before = 0;
    for (std::size_t i = 0; i < voxels; ++i) {
      if (i % row_ == 0) before = 0;
      const int code =
          code_of(number[i * step]) - (base != nullptr ? code_of(base[i * base_step]) : 0);
      const std::uint16_t difference = folded(code - before);
      before = code;
      high_.push_back(static_cast<char>(difference >> 8));
      low_.push_back(static_cast<char>(difference & 0xff));
    }
  }

  std::string take() { return std::move(high_) + low_; }

 private:
  std::size_t row_;
  std::string high_, low_;
};

}  // namespace

std::string packed_slices(const Draft& draft, int first, int count) {
  const auto row = static_cast<std::size_t>(draft.axes[0].nodes);
  const std::size_t slice = row * static_cast<std::size_t>(draft.axes[1].nodes);
  const std::size_t begin = slice * static_cast<std::size_t>(first);
  const std::size_t voxels = slice * static_cast<std::size_t>(count);
  const std::uint16_t* values = draft.voxels.data() + begin * Draft::numbers;
  constexpr std::size_t dust = Draft::numbers - 1;
  Differences differences(row, voxels * (Draft::numbers + Draft::other_variants));
  for (std::size_t number = 0; number < Draft::numbers; ++number) {
    const bool is_alone = number == 0 || number == dust;
    differences.add(values + number, is_alone ? nullptr : values, voxels, Draft::numbers,
                    Draft::numbers);
  }
  for (std::size_t i = 0; i < Draft::other_variants && !draft.variants.empty(); ++i) {
    differences.add(draft.variants.data() + begin * Draft::other_variants + i, values + dust,
                    voxels, Draft::other_variants, Draft::numbers);
  }
  return compressed(differences.take());
}

}  // namespace gamer
