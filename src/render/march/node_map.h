#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gamer/galaxy/component.h"

namespace gamer {

/// Smooth maps that place nodes on intervals of rays, called segments. A segment's node density is
///   rho(s) = sum_f rate_f / sqrt(1 + ((s - centre_f)/width_f)^2)
/// over its focuses, and its nodes stand at equal distances of
///   u(s) = int rho ds = sum_f rate_f width_f asinh((s - centre_f)/width_f) + const,
/// so that int f ds = int f/rho du is the trapezoidal rule over the nodes. The rule has spectral
/// accuracy for smooth functions that vanish at both ends (Trefethen & Weideman 2014). s is counted
/// from the segment's own origin, in single precision.
class NodeMap {
 public:
  void clear();
  /// Adds a segment over [begin, end]. Each focus gets only the rate that focuses of higher rate do
  /// not already give; focuses with little rate left are left out.
  void add(double begin, double end, std::span<const Focus> focuses);
  std::size_t size() const { return begin_.size(); }
  /// Computes lengths; call it when all segments are added.
  void measure();
  /// u(end) - u(begin), the number of nodes at unit distance.
  double length(std::size_t segment) const { return double{length_[segment]}; }

  /// The output of place(). Segment segments[i] gets nodes at u = (k + shift) step[i], k in [0,
  /// count[i]), from index first[i] on. A node has s and weight = ds/du step. Each node is found
  /// from the one before it, hence step <= largest_step.
  struct Places {
    std::span<const std::int32_t> segments;
    std::span<const std::int32_t> first;
    std::span<const std::int32_t> count;
    std::span<const float> step;
    float shift;
    float* s;
    float* weight;
  };
  static constexpr double largest_step = 2;
  void place(const Places& places) const;
  /// Fills `bounds` with the places s that cut a segment into `pieces` pieces of equal length in u.
  void cut(std::size_t segment, int pieces, std::vector<float>& bounds);

 private:
  std::vector<float> begin_, end_, length_;
  std::vector<std::int32_t> focus_first_, focus_count_;
  std::int32_t most_focuses_ = 0;  ///< of a segment
  /// Values of all focuses; `product` is rate times width.
  std::vector<float> centre_, inverse_width_, rate_, product_;
  std::vector<Focus> sorted_;
  std::vector<float> steps_, weights_;  ///< used by cut()
};

}  // namespace gamer
