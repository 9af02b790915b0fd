#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/core/parameter.h"
#include "gamer/noise/noise.h"

namespace gamer {

/// Parameters of a fractal sum and its shape; GAMER section 2.3 names in brackets.
struct FractalParameters {
  const Noise* kind = nullptr;
  int octaves = 8;             ///< omega
  double k0 = 0;               ///< frequency offset, cycles per galaxy radius
  double frequency_scale = 1;  ///< f_s, cycles per galaxy radius
  double spectral_index = 1;   ///< nu
  double exponent = 1;         ///< alpha
  bool inverse = false;        ///< Theta
  double offset = 0;
  double contrast = 1;
  double floor = 0.1;
  std::uint64_t seed = 1;

  /// The declaration of `component.noise`, with these values as defaults.
  ParameterTable table() const;
  /// Replaces what `values` (of table()) says. Throws InputError for combinations without sense.
  void apply(const ParameterSet& values, const std::string& context);
};

/// Points with weights, in batches, over which statistics are taken.
struct WeightedBatch {
  BatchArray x, y, z, weight;
  std::size_t size = 0;
  Points points() const { return {x.data(), y.data(), z.data(), size}; }
};

/// The mean of a quantity over a cloud, the mean of its square, and the standard error of the mean
/// if the points were independent.
struct CloudMean {
  double mean = 0;
  double square_mean = 0;
  double error = 0;
};

/// `values` has one array per batch of `cloud`.
CloudMean mean_over(std::span<const WeightedBatch> cloud, std::span<const BatchArray> values);

/// The fractal noise of GAMER Eqs. 3-6 (DESIGN section 4):
///   S(x) = sum_{k=1..omega} (k0 + f_s k)^-nu P((k0 + f_s k) x + o_k),  s = (S - mu) / sigma,
///   v = offset + contrast s,
///   Phi = max(v, 0)^alpha (linear) or max(|v|, floor)^-alpha (inverse), divided by its mean.
/// Every octave has its own hash seed and offset o_k, so that octaves are independent.
class FractalNoise {
 public:
  explicit FractalNoise(const FractalParameters& parameters);

  /// Takes mu, sigma and the mean of Phi over `cloud` (weighted), so that there <s> = 0, <s^2> = 1
  /// and <Phi factor> = 1. `factors` is empty (all 1), or one array per batch by which Phi will be
  /// multiplied. Before the call, mu = 0, sigma is that of independent octaves and the mean is 1.
  /// Throws InputError where S hardly varies or Phi is zero or infinite over the cloud.
  void normalise(std::span<const WeightedBatch> cloud, std::span<const BatchArray> factors = {});
  /// The standard error of <Phi factor> if the cloud's points were independent.
  double mean_error() const { return mean_error_; }

  /// S, without statistics.
  void sum(const Points& points, float* out) const;
  /// Phi.
  void evaluate(const Points& points, float* out) const;

  double mean() const { return mu_; }
  double sigma() const { return sigma_; }
  /// Root mean square frequency of S, cycles per unit length, weighted by the octaves' variance.
  double effective_frequency() const;
  /// sqrt(<(Phi factor)^2>), at least 1: how far the light is from evenly spread.
  double rms() const { return phi_rms_; }
  /// By how much the features of Phi are narrower than those of S, roughly.
  double sharpness() const;
  const FractalParameters& parameters() const { return parameters_; }

 private:
  void shape(std::size_t size, float* values) const;

  FractalParameters parameters_;
  std::vector<Octave> octaves_;
  double mu_ = 0;
  double independent_sigma_ = 1;
  double sigma_ = 1;
  double phi_mean_ = 1;
  double phi_rms_ = 1;
  double mean_error_ = 0;
};

}  // namespace gamer
