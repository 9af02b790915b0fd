#pragma once

#include <cstddef>
#include <vector>

namespace gamer {

/// A positive function of the footprint of rays, given by a table; 1 without a table.
class FootprintTable {
 public:
  /// 1 at every footprint.
  FootprintTable() = default;
  /// The values are at footprints narrowest ratio^k. The function is linear in ln footprint between
  /// them, and constant beyond the ends.
  FootprintTable(double narrowest, double ratio, const std::vector<double>& values);

  /// The value at the narrowest footprint and below.
  float narrowest() const { return table_.empty() ? 1.0f : table_.front(); }
  /// out[i] = value at footprint e^log_footprint[i], for whole vectors.
  void at(std::size_t size, const float* log_footprint, float* out) const;

 private:
  std::vector<float> table_;  ///< empty, or at least two values
  double start_ = 0;
  double step_ = 1;
};

}  // namespace gamer
