#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

/// Computes known values, and checks that each block arrives once with these values.
class RowCheck {
 public:
  RowCheck(std::vector<RowRange> blocks, std::size_t width)
      : blocks_(std::move(blocks)), width_(width), seen_(blocks_.size(), 0) {}

  const std::vector<RowRange>& blocks() const { return blocks_; }
  int rows() const {
    int sum = 0;
    for (const RowRange& block : blocks_) sum += block.size();
    return sum;
  }

  static double value(int row, std::size_t column) {
    return std::sin(1.0 + row) + static_cast<double>(column);
  }

  Executor::Compute compute() {
    return [this](RowRange range, std::span<double> values) {
      computed_ += range.size();
      ASSERT_EQ(values.size(), static_cast<std::size_t>(range.size()) * width_);
      for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = value(range.first + static_cast<int>(i / width_), i % width_);
      }
    };
  }

  Executor::Consume consume() {
    return [this](RowRange range, std::span<const double> values) {
      const auto found = std::find(blocks_.begin(), blocks_.end(), range);
      ASSERT_NE(found, blocks_.end());
      ++seen_[static_cast<std::size_t>(found - blocks_.begin())];
      ASSERT_EQ(values.size(), static_cast<std::size_t>(range.size()) * width_);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const int row = range.first + static_cast<int>(i / width_);
        if (values[i] != value(row, i % width_)) ++wrong_;
      }
    };
  }

  void expect_all_consumed() const {
    EXPECT_EQ(wrong_, 0);
    EXPECT_EQ(std::count(seen_.begin(), seen_.end(), 1), std::ssize(blocks_));
  }

  /// Rows computed by this rank.
  int computed() const { return computed_; }

 private:
  std::vector<RowRange> blocks_;
  std::size_t width_;
  std::vector<int> seen_;
  int wrong_ = 0;
  std::atomic<int> computed_ = 0;
};

}  // namespace gamer
