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

/// How one octave counts for rays of some footprints (FractalNoise::see()).
struct SeenOctave {
  const float* values;  ///< of weight 1; not read where no ray sees any
  float weight;
  float weighted_mean;
  float mean;            ///< of a ridge before its weights
  float share;           ///< of the variance of S
  float coherent_share;  ///< the same, of what is coherent through the layer
  /// The smoothstep's argument is fade_shift - fade_slope footprint.
  float fade_slope;
  float fade_shift;
};

/// What a wide ray sees of the combination of octaves.
struct SeenNoise {
  BatchArray sum;       ///< octaves by how much of them is seen, the rest by their means
  BatchArray hidden;    ///< variance of what is not seen, in units of that of S
  BatchArray coherent;  ///< of its part that is the same through the layer
};

/// The fractal noise of GAMER Eqs. 3-6 (docs/noise.md):
///   S(x) = sum_{k=1..omega} (k0 + f_s k)^-nu P((k0 + f_s k) x + o_k),  s = (S - mu) / sigma,
///   Phi(offset + contrast s) of NoiseShape, divided by its mean,
/// or of another combination S of octaves. Multiplicative and ridged ones are densities already:
/// Phi is S divided by its mean. With a warp, S is taken at x + w v(x), v being a vector of three
/// independent sums of simplex noise, each of variance 1:
///   sum_{j=1..n} 2^-j P(2^(j - 1) f_w x + o_j) / norm.
///
/// A ray of a footprint w (its width, in units of x) sees octave k by 1 where its frequency times w
/// is below 0.15, by 0 from 0.9 on, smoothly between: about the mean over a square of side w. What
/// it does not see counts by its expected value: E[Phi] over a normal distribution of the octaves'
/// rest where they are summed, 1 for a factor, the mean for a ridge. A warp by which lengths shrink
/// makes frequencies higher.
class FractalNoise {
 public:
  /// `thickness` (units of x) of the layer that the noise fills.
  explicit FractalNoise(const FractalParameters& parameters, double thickness = 0);
  /// Takes the octaves that are given in place of those of `parameters`: at most most_octaves,
  /// coarse ones first. They have frequencies, weights and identifications of their own. Points,
  /// footprints and a cloud are in coordinates of the caller's choice.
  FractalNoise(const FractalParameters& parameters, std::span<const Octave> octaves,
               double thickness = 0);

  /// What Phi will be multiplied by at points.
  using Factor = std::function<void(const Points& points, float* out)>;
  /// Takes mu, sigma and the mean of Phi over `cloud` (weighted), so that there <s> = 0, <s^2> = 1
  /// and <Phi factor> = 1. `factor` may be empty. Before the call, mu = 0, sigma is that of
  /// independent octaves and the mean is 1. Throws InputError where S hardly varies or Phi is zero
  /// or infinite over the cloud.
  void normalise(std::span<const WeightedBatch> cloud, const Factor& factor = {});
  /// Takes <Phi factor> over more points for the mean of Phi.
  void correct_mean(const CloudMean& mean);
  /// The standard error of <Phi factor> if the cloud's points were independent.
  double mean_error() const { return mean_error_; }
  /// All that normalise() took, for the same noise elsewhere.
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
  /// What rays see of the same points by as many sets of footprints; base noises are evaluated once
  /// for all, and counted.
  void see(const Points& points, std::span<const float* const> footprints, std::span<SeenNoise> out,
           std::uint64_t& evaluations) const;
  /// The expectation of Phi over all hidden octaves.
  void expect(std::size_t size, const SeenNoise& seen, float* out) const;
  /// The expectation of Phi where the coherent part of the hidden octaves is known: `deviation`
  /// standard deviations. Its variance is `coherence` (null for 1) times that of `seen`.
  void expect(std::size_t size, const SeenNoise& seen, const float* coherence, double deviation,
              float* out) const;
  /// Whether rays of that footprint see less than all octaves.
  bool hides(double footprint) const;

  double mean() const { return mu_; }
  double sigma() const { return sigma_; }
  /// Root mean square frequency of S, cycles per unit length, weighted by the octaves' variance.
  double effective_frequency() const { return effective_frequency_; }
  /// sqrt(<(Phi factor)^2>), at least 1; it is 1 where the light is evenly spread.
  double rms() const { return phi_rms_; }
  /// About how many times narrower the features of Phi are than those of S.
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
  /// The points displaced, in `storage` where there is a warp.
  Points displace(const Points& points, std::array<BatchArray, 3>& storage) const;
  /// The combination S at displaced points.
  void combine(const Points& points, float* out) const;
  SeenOctave seen_octave(std::size_t k, const float* values) const;
  /// Number of octaves up to the last of which a ray of this footprint sees something.
  std::size_t octaves_in_sight(float footprint) const;
  /// Takes the mean and variance of octave k over a cloud, from its values of weight 1 (their
  /// magnitudes where billow) in batch b at b omega + k.
  void take_octave(std::size_t k, std::span<const WeightedBatch> cloud,
                   std::span<const BatchArray> values);
  /// Takes mean and variance of every octave from a cloud.
  void take_octaves(std::span<const WeightedBatch> cloud);

  FractalParameters parameters_;
  NoiseShape shape_;
  std::vector<Octave> octaves_;
  std::vector<double> coherence_;  ///< of each octave: share of its variance, through the layer
  /// Mean and variance of each octave; those of its logarithm where octaves are factors.
  std::vector<double> octave_mean_, octave_variance_;
  std::vector<Octave> warp_octaves_;
  double independent_variance_ = 0;  ///< in units of the base noise's
  double stretch_ = 1;               ///< of frequencies by the warp, root mean square
  double finest_ = 0;                ///< frequency, stretched
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
