#include "parallel/given_blocks.h"

#include <gtest/gtest.h>

namespace gamer::given_blocks_test {
namespace {

TEST(GivenBlocks, ARankSendsBackWhatItWasGivenAndOnce) {
  GivenBlocks given(3);
  given.give(1, {0, 4});
  given.give(1, {4, 8});
  given.give(2, {8, 12});
  // The rows differ, are fewer, are more, are none, or belong to another rank.
  for (const RowRange rows : {RowRange{12, 16}, {0, 3}, {0, 8}, {4, 4}, {-4, 0}, {8, 12}}) {
    EXPECT_FALSE(given.take_back(1, rows)) << rows.first << " " << rows.last;
  }
  EXPECT_TRUE(given.take_back(1, {4, 8}));
  EXPECT_FALSE(given.take_back(1, {4, 8}));
  EXPECT_TRUE(given.has_any(1));
  EXPECT_TRUE(given.take_back(1, {0, 4}));
  EXPECT_FALSE(given.has_any(1));
  EXPECT_TRUE(given.has_any(2));
  EXPECT_FALSE(given.has_any(0));
}

}  // namespace
}  // namespace gamer::given_blocks_test
