#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace gamer {

/// The shape with Theta and alpha of GAMER Eqs. 3-6. With v = offset + contrast s,
///   Phi = max(v, 0)^alpha (linear) or max(|v|, floor)^-alpha (inverse).
/// The shape also gives the expectation E[Phi(v + contrast h g)], where h is the standard deviation
/// of an unknown part of s and g is normal. Copies share their table.
class NoiseShape {
 public:
  struct Parameters {
    double exponent = 1;
    bool inverse = false;
    double offset = 0;
    double contrast = 1;
    double floor = 0.1;
    bool expected = false;  ///< whether sums are expectations already
    auto operator<=>(const Parameters&) const = default;
  };
  explicit NoiseShape(const Parameters& parameters);

  /// The linear map of sums to s: s = slope * sum + shift.
  struct Standard {
    double slope;
    double shift;
  };
  /// Replaces sums by values[i] = scale Phi. The relative error is below max(1, alpha) (2e-7 +
  /// 2e-8/|v|).
  void apply(const Standard& standard, double scale, std::size_t size, float* values) const;
  /// Replaces sums by expectations for a hidden variance h^2 in [0, 1]. The relative error is below
  /// 1 % for moderate contrast/floor and exponent (inverse, alpha = 1.5, floor = 0.3: 0.4 %).
  /// Errors are larger for sharper shapes at small h (alpha = 4, floor = 0.1: below 9 % at h =
  /// 0.05), and 0 at h = 0.
  void apply_expected(const Standard& standard, double scale, std::size_t size, const float* hidden,
                      float* values) const;

  /// Levels of h in the table: h = level/(levels - 1).
  static constexpr int levels = 33;

 private:
  Parameters parameters_;
  std::shared_ptr<const std::vector<float>> table_;  ///< see make_table()
};

}  // namespace gamer
