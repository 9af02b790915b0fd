#include "gamer/core/batch.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/each_simd_target.h"
#include "gamer/core/random.h"

namespace gamer::batch_test {
namespace {

TEST(Range, OfAnySize) {
  for_each_simd_target([] {
    for (std::size_t size = 1; size <= batch_capacity; ++size) {
      BatchArray values;
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        // Numbers behind the values do not count.
        values[i] = i < size ? static_cast<float>(to_unit(hash_words({size, i})) - 0.5)
                             : (i % 2 == 0 ? 7.0f : -7.0f);
      }
      const auto [least, most] = std::minmax_element(values.data(), values.data() + size);
      const Range range = range_of(values.data(), size);
      EXPECT_EQ(range.least, *least);
      EXPECT_EQ(range.most, *most);
    }
  });
}

}  // namespace
}  // namespace gamer::batch_test
