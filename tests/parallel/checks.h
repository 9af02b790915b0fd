#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

/// Computes known values and checks that each row arrives once with them, in the blocks asked for.
class RowCheck {
 public:
  RowCheck(int rows, int block, std::size_t width)
      : rows_(rows), block_(block), width_(width), seen_(static_cast<std::size_t>(rows), 0) {}

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
      EXPECT_EQ(range.first % block_, 0);
      EXPECT_EQ(range.last, range.first + std::min(block_, rows_ - range.first));
      ASSERT_EQ(values.size(), static_cast<std::size_t>(range.size()) * width_);
      for (int row = range.first; row < range.last; ++row)
        ++seen_.at(static_cast<std::size_t>(row));
      for (std::size_t i = 0; i < values.size(); ++i) {
        const int row = range.first + static_cast<int>(i / width_);
        if (values[i] != value(row, i % width_)) ++wrong_;
      }
    };
  }

  void expect_all_consumed() const {
    EXPECT_EQ(wrong_, 0);
    EXPECT_EQ(std::count(seen_.begin(), seen_.end(), 1), rows_);
  }

  /// Rows computed by this rank.
  int computed() const { return computed_; }

 private:
  int rows_;
  int block_;
  std::size_t width_;
  std::vector<int> seen_;
  int wrong_ = 0;
  std::atomic<int> computed_ = 0;
};

}  // namespace gamer
