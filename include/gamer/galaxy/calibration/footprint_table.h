#pragma once

#include <cstddef>
#include <vector>

namespace gamer {

/// A positive function of the footprint of rays, 1 where it is not given.
class FootprintTable {
 public:
  /// 1 at every footprint.
  FootprintTable() = default;
  /// Values at footprints narrowest ratio^k. Between them it is linear in ln footprint, so that it
  /// depends on the two neighbours alone; beyond them it is constant.
  FootprintTable(double narrowest, double ratio, const std::vector<double>& values);

  /// The value at the narrowest footprint and below.
  float narrowest() const { return table_.empty() ? 1.0f : table_.front(); }
  /// out[i] = value at footprint e^log_footprint[i], of whole vectors.
  void at(std::size_t size, const float* log_footprint, float* out) const;

 private:
  std::vector<float> table_;  ///< none, or two values or more
  double start_ = 0;
  double step_ = 1;
};

}  // namespace gamer
