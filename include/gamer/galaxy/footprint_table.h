#pragma once

#include <cstddef>
#include <vector>

namespace gamer {

/// A positive function of the footprint of rays, 1 where it is not given: the measured part of what
/// wide rays see (Galaxy).
class FootprintTable {
 public:
  /// 1 at every footprint.
  FootprintTable() = default;
  /// Values at footprints narrowest ratio^k. Between them its logarithm is cubic in ln footprint,
  /// with the slopes of the neighbours [Catmull & Rom 1974]; beyond them it is constant.
  FootprintTable(double narrowest, double ratio, const std::vector<double>& values);

  bool is_one() const { return table_.empty(); }
  /// out[i] = value at footprint e^log_footprint[i], of whole vectors.
  void at(std::size_t size, const float* log_footprint, float* out) const;

 private:
  std::vector<float> table_;  ///< linear between even steps of ln footprint
  double start_ = 0;
  double step_ = 1;
};

}  // namespace gamer
