#pragma once

#include <cstdint>

#include "gamer/image/plane.h"
#include "processing/statistics.h"

namespace gamer {

/// Differences of plane b from plane a. Two NaN, or two infinities of one sign, are equal.
struct Comparison {
  std::int64_t count = 0;       ///< pixels that are finite in both
  std::int64_t differing = 0;   ///< unequal pixels among these
  std::int64_t mismatched = 0;  ///< finite in one plane only, or not finite and different
  double max_difference = 0;    ///< largest |b - a|
  Statistics::Pixel max_at;     ///< first pixel with it, from 0
  double rms_difference = 0;    ///< sqrt(mean (b - a)^2)
  double max_reference = 0;     ///< largest |a|
  double rms_reference = 0;     ///< sqrt(mean a^2)

  double relative_max() const;  ///< max_difference/max_reference; 0 where both are 0
  double relative_rms() const;  ///< rms_difference/rms_reference; 0 where both are 0
  /// Whether no pixel is mismatched and max_difference <= absolute + relative * max_reference.
  bool within(double relative, double absolute) const;
};

/// Compares in one pass. Throws std::invalid_argument for unequal sizes, and what the planes throw.
Comparison compare(const Plane& a, const Plane& b, int threads);

}  // namespace gamer
