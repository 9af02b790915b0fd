#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace gamer {

/// Theta and alpha of GAMER Eqs. 3-6: of v = offset + contrast s,
///   Phi = max(v, 0)^alpha (linear) or max(|v|, floor)^-alpha (inverse),
/// and what is expected of it, E[Phi(v + contrast h g)], where a part of s is not known but for its
/// standard deviation h, g being normal. Copies share their table.
class NoiseShape {
 public:
  struct Parameters {
    double exponent = 1;
    bool inverse = false;
    double offset = 0;
    double contrast = 1;
    double floor = 0.1;
    bool expected = false;  ///< whether v is its own expectation, whatever is hidden
    auto operator<=>(const Parameters&) const = default;
  };
  explicit NoiseShape(const Parameters& parameters);

  /// Linear in the sums that become s: s = slope * sum + shift.
  struct Standard {
    double slope;
    double shift;
  };
  /// values[i] = scale Phi, of sums. Relative error below max(1, alpha) (2e-7 + 2e-8/|v|).
  void apply(const Standard& standard, double scale, std::size_t size, float* values) const;
  /// Takes what is expected where the hidden variance h^2 (in [0, 1]) is not 0. Its relative error
  /// is below 1 % where contrast/floor and the exponent are moderate (inverse, alpha = 1.5,
  /// floor = 0.3: 0.4 %), more for sharper shapes at small h (alpha = 4, floor = 0.1: below 9 % at
  /// h = 0.05); exact at 0.
  void apply_expected(const Standard& standard, double scale, std::size_t size, const float* hidden,
                      float* values) const;

  /// Levels of h in the table: h = level/(levels - 1).
  static constexpr int levels = 33;

 private:
  Parameters parameters_;
  std::shared_ptr<const std::vector<float>> table_;  ///< see make_table()
};

}  // namespace gamer
