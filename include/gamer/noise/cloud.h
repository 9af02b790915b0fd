#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

/// Points with weights, in batches, for statistics.
struct WeightedBatch {
  BatchArray x, y, z, weight;
  std::size_t size = 0;
  Points points() const { return {x.data(), y.data(), z.data(), size}; }
};

/// Batches of points; `fill` makes the batch of any number in [0, batches), from several threads at
/// a time.
struct Cloud {
  std::size_t batches = 0;
  std::function<void(std::size_t b, WeightedBatch& out)> fill;

  std::vector<WeightedBatch> all() const;
};

/// The mean of a quantity over a cloud, the mean of its square, and the standard error of the mean
/// if the points were independent.
struct CloudMean {
  double mean = 0;
  double square_mean = 0;
  double error = 0;
};

/// Weighted sums over points, of a quantity x.
class CloudMoments {
 public:
  static constexpr std::size_t count = 6;

  void add(const WeightedBatch& batch, const float* x);
  /// Adds sums over other points.
  void add(std::span<const double> sums);

  std::span<const double> sums() const { return sums_; }
  /// Means of x and x^2.
  double x() const { return sums_[1] / sums_[0]; }
  double xx() const { return sums_[2] / sums_[0]; }
  CloudMean mean() const;  ///< of x

 private:
  double sums_[count] = {};
};

/// The least power of 2 that is no less than a number of points, at most `most`. Powers of 2 let
/// means share clouds.
std::size_t shared_cloud_size(double points, std::size_t most);

/// The mean of the values that `values` gives for the batches b of `cloud`, in threads of
/// parallel_for().
CloudMean mean_over(std::span<const WeightedBatch> cloud,
                    const std::function<void(std::size_t b, BatchArray& out)>& values);

}  // namespace gamer
