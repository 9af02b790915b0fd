#include "gamer/parallel/ranks.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "parallel/checks.h"

namespace gamer::ranks_test {
namespace {

TEST(RanksAlone, IsRankZeroOfOne) {
  const Ranks ranks(nullptr, nullptr);
  EXPECT_EQ(ranks.rank(), 0);
  EXPECT_EQ(ranks.size(), 1);
  EXPECT_EQ(ranks.broadcast("a text"), "a text");
  EXPECT_EQ(ranks.gather("a text"), std::vector<std::string>{"a text"});
  EXPECT_EQ(ranks.common_bits(0b1010), 0b1010);
}

TEST(RanksAlone, ExecutorComputesInThreads) {
  const Ranks ranks(nullptr, nullptr);
  for (const int threads : {1, 3}) {
    const auto executor = ranks.executor(threads);
    EXPECT_EQ(executor->workers(), threads);
    RowCheck check(even_blocks(17, 4), 5);
    executor->run(check.blocks(), 5, check.compute(), check.consume());
    check.expect_all_consumed();
  }
}

TEST(RanksAlone, ComputesTogetherWithNobody) {
  const Ranks ranks;
  EXPECT_EQ(ranks.rank(), 0);
  EXPECT_EQ(ranks.size(), 1);
  RowCheck check(even_blocks(17, 4), 5);
  const std::vector<double> all = ranks.compute_together(check.blocks(), 5, 2, check.compute());
  ASSERT_EQ(all.size(), 17u * 5);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i], RowCheck::value(static_cast<int>(i / 5), i % 5));
  }
}

TEST(RanksAlone, EndReportsAndReturnsTheCode) {
  std::vector<std::string> reports;
  const auto report = [&](const std::string& message) { reports.push_back(message); };
  EXPECT_EQ(Ranks(nullptr, nullptr).end(2, "wrong", report), 2);
  EXPECT_EQ(Ranks(nullptr, nullptr).end(0, "", report), 0);
  EXPECT_EQ(reports, std::vector<std::string>{"wrong"});
}

}  // namespace
}  // namespace gamer::ranks_test
