#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/noise/cloud.h"
#include "gamer/noise/fractal_parameters.h"
#include "gamer/noise/noise.h"
#include "gamer/noise/shape.h"

namespace gamer {

/// The contribution of one octave for rays of given footprints (FractalNoise::see()).
struct SeenOctave {
  const float* values;  ///< values for weight 1; not read if no ray resolves the octave
  float weight;
  float weighted_mean;
  float mean;            ///< mean of a ridge without its weights
  float share;           ///< share of the variance of S
  float coherent_share;  ///< share that is constant through the layer
  /// The smoothstep's argument is fade_shift - fade_slope footprint.
  float fade_slope;
  float fade_shift;
};

/// The combination of octaves as a wide ray sees it.
struct SeenNoise {
  BatchArray sum;       ///< octaves by their resolved share, otherwise by their means
  BatchArray hidden;    ///< variance of hidden octaves, in units of the variance of S
  BatchArray coherent;  ///< variance of the hidden part that is constant through the layer
};

/// The fractal noise of GAMER Eqs. 3-6 (docs/noise.md):
///   S(x) = sum_{k=1..omega} (k0 + f_s k)^-nu P((k0 + f_s k) x + o_k),  s = (S - mu) / sigma,
///   Phi(offset + contrast s) of NoiseShape, divided by its mean.
/// Other combinations S of octaves are possible. Multiplicative and ridged combinations are
/// densities already: Phi is S divided by its mean. With a warp, S is taken at x + w v(x). The
/// vector v has three independent sums of simplex noise, each of variance 1:
///   sum_{j=1..n} 2^-j P(2^(j - 1) f_w x + o_j) / norm.
///
/// A ray of footprint w (its width, in units of x) resolves a share of octave k: 1 where frequency
/// times w is below 0.15, 0 from 0.9 on, smooth between. This approximates the mean over a square
/// of side w. Hidden octaves count by their expectation: E[Phi] over a normal distribution where
/// they are summed, 1 where they are factors, and their mean where they are ridges. A warp that
/// shrinks lengths raises frequencies.
class FractalNoise {
 public:
  /// `thickness` is that of the layer that the noise fills, in units of x.
  explicit FractalNoise(const FractalParameters& parameters, double thickness = 0);
  /// Takes `octaves` in place of those of `parameters`: at most most_octaves, coarse ones first.
  /// They have frequencies, weights and identifications of their own. Points, footprints and
  /// clouds are in the coordinates of these octaves.
  FractalNoise(const FractalParameters& parameters, std::span<const Octave> octaves,
               double thickness = 0);

  /// The factor by which Phi will be multiplied at points.
  using Factor = std::function<void(const Points& points, float* out)>;
  /// Takes mu, sigma and the mean of Phi over `cloud` (weighted), so that <s> = 0, <s^2> = 1 and
  /// <Phi factor> = 1 over the cloud. `factor` may be empty. Before the call, mu = 0, sigma is that
  /// of independent octaves and the mean is 1. Throws InputError where S hardly varies or Phi is
  /// zero or infinite over the cloud.
  void normalise(std::span<const WeightedBatch> cloud, const Factor& factor = {});
  /// Replaces the mean of Phi by <Phi factor> over more points.
  void correct_mean(const CloudMean& mean);
  /// The standard error of <Phi factor> if the cloud's points were independent.
  double mean_error() const { return mean_error_; }
  /// All results of normalise(), for an equal noise elsewhere.
  std::vector<double> statistics() const {
    std::vector<double> all = {mu_, sigma_, log_variance_, phi_mean_, phi_rms_, mean_error_};
    all.insert(all.end(), octave_mean_.begin(), octave_mean_.end());
    all.insert(all.end(), octave_variance_.begin(), octave_variance_.end());
    return all;
  }
  void restore(std::span<const double> statistics) {
    auto next = statistics.begin();
    for (double* own : {&mu_, &sigma_, &log_variance_, &phi_mean_, &phi_rms_, &mean_error_}) {
      *own = *next++;
    }
    for (double& mean : octave_mean_) mean = *next++;
    for (double& variance : octave_variance_) variance = *next++;
    sharpness_ = measured_sharpness();
  }

  /// The combination S of octaves, not normalised.
  void sum(const Points& points, float* out) const;
  /// The density Phi.
  void evaluate(const Points& points, float* out) const;
  /// The octaves that rays see at the same points, for several sets of footprints. Base noises are
  /// evaluated once for all sets; `evaluations` counts their values.
  void see(const Points& points, std::span<const float* const> footprints, std::span<SeenNoise> out,
           std::uint64_t& evaluations) const;
  /// The expectation of Phi over all hidden octaves.
  void expect(std::size_t size, const SeenNoise& seen, float* out) const;
  /// The expectation of Phi where the coherent part of the hidden octaves is `deviation` standard
  /// deviations from its mean. The variance of this part is `coherence` (null for 1) times that of
  /// `seen`.
  void expect(std::size_t size, const SeenNoise& seen, const float* coherence, double deviation,
              float* out) const;
  /// Whether rays of this footprint hide a part of an octave.
  bool hides(double footprint) const;

  double mean() const { return mu_; }
  double sigma() const { return sigma_; }
  /// Root mean square frequency of S, cycles per unit length, weighted by the octaves' variance.
  double effective_frequency() const { return effective_frequency_; }
  /// sqrt(<(Phi factor)^2>), at least 1; it is 1 where the light is evenly spread.
  double rms() const { return phi_rms_; }
  /// Approximate ratio of the width of S's features to the width of Phi's features.
  double sharpness() const { return sharpness_; }
  const FractalParameters& parameters() const { return parameters_; }

 private:
  /// Whether Phi is S times a factor.
  bool is_density() const;
  NoiseShape::Standard standard() const;
  void add_octave(const Octave& octave, double frequency, double weight, double thickness);
  void make_warp();
  void assume_independence();
  double measured_sharpness() const;
  /// The displaced points, which `storage` holds if there is a warp.
  Points displace(const Points& points, std::array<BatchArray, 3>& storage) const;
  /// The combination S at displaced points.
  void combine(const Points& points, float* out) const;
  SeenOctave seen_octave(std::size_t k, const float* values) const;
  /// Number of octaves up to the last octave that a ray of this footprint resolves in part.
  std::size_t octaves_in_sight(float footprint) const;
  /// Takes the mean and variance of octave k over a cloud. Its values of weight 1 (magnitudes for
  /// billow noise) in batch b are at b omega + k.
  void take_octave(std::size_t k, std::span<const WeightedBatch> cloud,
                   std::span<const BatchArray> values);
  /// Takes mean and variance of every octave from a cloud.
  void take_octaves(std::span<const WeightedBatch> cloud);

  FractalParameters parameters_;
  NoiseShape shape_;
  std::vector<Octave> octaves_;
  std::vector<double> coherence_;  ///< [octave] coherent share of its variance through the layer
  /// Mean and variance of each octave, or of its logarithm if octaves are factors.
  std::vector<double> octave_mean_, octave_variance_;
  std::vector<Octave> warp_octaves_;
  double independent_variance_ = 0;  ///< in units of the base noise's variance
  double stretch_ = 1;               ///< root mean square stretch of frequencies by the warp
  double finest_ = 0;                ///< finest frequency, stretched
  double effective_frequency_ = 0, sharpness_ = 1;
  double mu_ = 0;
  double independent_sigma_ = 1;
  double sigma_ = 1;
  double log_variance_ = 0;  ///< ln(1 + sigma^2/mu^2)
  double phi_mean_ = 1;
  double phi_rms_ = 1;
  double mean_error_ = 0;
};

}  // namespace gamer
