#pragma once

#include <cstddef>

namespace gamer {

/// Curves that rise from f(0) = 0, with parameter a > 0:
///   power      x^a
///   logarithm  ln(1 + a x)
///   asinh      asinh(a x)
/// Relative errors are below 1e-15, for the power below 1e-15 (1 + |a ln x|). A power's base below
/// the smallest normal number counts as 0. Every SIMD target gives equal bits.
enum class ToneCurve { power, logarithm, asinh };

/// v' = factor f(|x|) with the sign of x = (v - offset)/range, clipped to [0, 1] if asked for. NaN
/// stays NaN.
struct ToneKernel {
  ToneCurve curve = ToneCurve::power;
  double parameter = 1;
  double offset = 0;
  double range = 1;
  double factor = 1;
  bool clip = false;
};
void apply_tone(const ToneKernel& kernel, double* values, std::size_t count);

}  // namespace gamer
