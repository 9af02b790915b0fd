#include "gamer/parallel/team.h"

#include <barrier>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "gamer/core/error.h"

namespace gamer::team_test {
namespace {

/// A team whose ranks are threads.
class ThreadTeam {
 public:
  explicit ThreadTeam(int size) : size_(size), barrier_(size) {}

  Team member(int rank) {
    return {rank, size_, [this](std::span<std::byte> integers) { add_up(integers); }};
  }

  /// Runs `work` on every rank; returns for each rank "done" or the message of its exception.
  std::vector<std::string> run(const std::function<void(int rank, TeamExecutor& executor)>& work) {
    std::vector<std::string> ends(static_cast<std::size_t>(size_));
    std::vector<std::jthread> threads;
    for (int rank = 0; rank < size_; ++rank) {
      threads.emplace_back([this, rank, &work, &end = ends[static_cast<std::size_t>(rank)]] {
        TeamExecutor executor(member(rank), 1 + rank);
        try {
          work(rank, executor);
          executor.leave();
          end = "done";
        } catch (const std::exception& error) {
          executor.leave(std::current_exception());
          end = error.what();
        }
      });
    }
    threads.clear();
    return ends;
  }

 private:
  void add_up(std::span<std::byte> integers) {
    std::vector<std::uint64_t> own(integers.size() / sizeof(std::uint64_t));
    std::memcpy(own.data(), integers.data(), integers.size());
    {
      const std::lock_guard lock(mutex_);
      sums_.resize(own.size());
      for (std::size_t i = 0; i < own.size(); ++i) sums_[i] += own[i];
    }
    barrier_.arrive_and_wait();
    EXPECT_EQ(sums_.size(), own.size());
    std::memcpy(integers.data(), sums_.data(), integers.size());
    barrier_.arrive_and_wait();
    {
      const std::lock_guard lock(mutex_);
      sums_.clear();
    }
    barrier_.arrive_and_wait();
  }

  int size_;
  std::barrier<> barrier_;
  std::mutex mutex_;
  std::vector<std::uint64_t> sums_;
};

/// Fills rows with values, the first of which is NaN and the last -0.
void fill(RowRange rows, std::span<double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = 0.1 * (3 * rows.first + static_cast<double>(i));
  }
  values.back() = -0.0;
  values.front() = std::numeric_limits<double>::quiet_NaN();
}

TEST(TeamExecutor, EveryRankGetsAllRowsInOrder) {
  for (const int size : {1, 2, 3}) {
    for (const int rows : {0, 1, 5, 700}) {
      ThreadTeam team(size);
      std::mutex mutex;
      int computed = 0;
      const auto ends = team.run([&](int, TeamExecutor& executor) {
        EXPECT_EQ(executor.workers(), size * (size + 1) / 2);
        int next = 0;
        executor.run(
            even_blocks(rows, 2), 3,
            [&](RowRange range, std::span<double> values) {
              fill(range, values);
              const std::lock_guard lock(mutex);
              computed += range.size();
            },
            [&](RowRange range, std::span<const double> values) {
              EXPECT_EQ(range.first, next);
              next = range.last;
              std::vector<double> expected(static_cast<std::size_t>(range.size()) * 3);
              fill(range, expected);
              ASSERT_EQ(values.size(), expected.size());
              EXPECT_EQ(std::memcmp(values.data(), expected.data(), values.size_bytes()), 0);
            });
        EXPECT_EQ(next, rows);
      });
      EXPECT_EQ(ends, std::vector<std::string>(static_cast<std::size_t>(size), "done"));
      EXPECT_EQ(computed, rows);
    }
  }
}

TEST(TeamExecutor, ASingleRankConsumesEachBlockWhenItIsFinished) {
  TeamExecutor executor(Team(), 1);
  int computed = 0, consumed = 0;
  executor.run(
      even_blocks(700, 2), 1, [&](RowRange, std::span<double>) { ++computed; },
      [&](RowRange, std::span<const double>) { EXPECT_EQ(++consumed, computed); });
  EXPECT_EQ(consumed, 350);
  const auto fail = [](RowRange, std::span<double>) { throw std::runtime_error("no light"); };
  EXPECT_THROW(executor.run(even_blocks(4, 2), 1, fail, [](auto, auto) {}), std::runtime_error);
}

TEST(TeamExecutor, AFailureEndsAllRanks) {
  const std::string other = "the render failed on rank 1";
  for (const std::string where : {"before", "compute", "consume", "last consume", "after"}) {
    ThreadTeam team(3);
    const auto fail_if = [&](bool is_here) {
      if (is_here) throw std::domain_error(where);
    };
    const auto ends = team.run([&](int rank, TeamExecutor& executor) {
      fail_if(rank == 1 && where == "before");
      executor.run(
          even_blocks(400, 1), 1,
          [&](RowRange range, std::span<double>) {
            fail_if(rank == 1 && where == "compute" && range.first >= 100);
          },
          [&](RowRange range, std::span<const double>) {
            fail_if(rank == 1 && where == "consume" && range.first == 100);
            fail_if(rank == 1 && where == "last consume" && range.first == 399);
          });
      fail_if(rank == 1 && where == "after");
      executor.sum(1);
    });
    EXPECT_EQ(ends, (std::vector<std::string>{other, where, other}));
  }
}

TEST(TeamExecutor, RanksMustAgree) {
  const std::string different = "ranks 0 and 2 do not render equal images";
  for (const std::string what : {"number", "blocks", "values"}) {
    ThreadTeam team(3);
    const auto ends = team.run([&](int rank, TeamExecutor& executor) {
      executor.agree(what == "number" && rank == 2 ? 7 : 8);
      executor.run(
          even_blocks(what == "blocks" && rank == 2 ? 8 : 9, 1),
          what == "values" && rank == 2 ? 2 : 1, [](RowRange, auto) {}, [](RowRange, auto) {});
    });
    EXPECT_EQ(ends, (std::vector<std::string>(3, different)));
  }
}

TEST(TeamExecutor, SumsNumbers) {
  ThreadTeam team(3);
  team.run([](int rank, TeamExecutor& executor) {
    EXPECT_EQ(executor.sum(static_cast<std::uint64_t>(rank) + 1), 6u);
  });
  EXPECT_THROW(TeamExecutor({2, 2, {}}, 1), std::invalid_argument);
  EXPECT_THROW(TeamExecutor({-1, 2, {}}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace gamer::team_test
