#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/noise/fractal.h"

namespace gamer {

/// The factor Phi(x) that breaks a component up. Its mean over the component's envelope is 1. Phi
/// is evaluated at points turned back about the axis by twirl * theta(r). Features are thus wound
/// in the sense of the arms, and follow the arms at twirl = 1.
class Texture {
 public:
  explicit Texture(double twirl) : twirl_(twirl) {}
  virtual ~Texture() = default;

  double twirl() const { return twirl_; }

  /// Makes <Phi factor> = 1 over the weighted `cloud`. An empty `factor` is 1. Throws InputError if
  /// this is impossible.
  virtual void normalise(std::span<const WeightedBatch> cloud,
                         const FractalNoise::Factor& factor) = 0;
  /// All results of normalise(), so that restore() can give them to an equal texture, or to one
  /// that differs in its seed alone.
  virtual std::vector<double> statistics() const = 0;
  virtual void restore(std::span<const double> statistics) = 0;
  /// Whether these results do no more than scale Phi and steer rays. Results of another seed then
  /// serve as well, where Phi is divided by its mean anyway.
  virtual bool statistics_only_scale() const { return false; }

  /// Fills out.size() arrays with Phi. With footprints (galaxy radii; null for none) hidden octaves
  /// count by their expectation. With deviations, out[d] is the expectation if the coherent part of
  /// the hidden octaves is deviations[d] standard deviations. The variance of this part is
  /// `coherence` (null for 1) times that of the model. A point's value does not depend on other
  /// points of the batch. Adds the number of evaluated base noises to `evaluations`.
  void evaluate(const Points& points, const float* footprints, const float* coherence,
                std::span<const double> deviations, std::span<BatchArray> out,
                std::uint64_t& evaluations) const;

  /// The first of two steps of evaluate() with footprints. Fills `out` with the octaves that rays
  /// see, for several sets of footprints at one set of points. Octaves shared by the sets are
  /// evaluated once. All points use one algorithm, so that fully resolved points may differ from
  /// evaluate() by rounding. expect() with deviations needs `wants_coherent`.
  virtual void see(const Points& points, std::span<const float* const> footprints,
                   bool wants_coherent, std::span<SeenNoise> out,
                   std::uint64_t& evaluations) const = 0;
  /// The second step: Phi from the octaves that see() found for one set.
  virtual void expect(std::size_t size, const SeenNoise& seen, const float* coherence,
                      std::span<const double> deviations, std::span<BatchArray> out) const = 0;

  /// Whether rays of this footprint hide a part of the texture.
  virtual bool hides(double footprint) const = 0;
  /// Frequency of the sharpest features, cycles per galaxy radius.
  virtual double frequency() const = 0;
  /// Factor on the number of nodes of a ray of this footprint; `cosine` is |cos| of its angle
  /// with the galaxy's axis. The factor exceeds 1 where features are many footprints wide, since a
  /// feature that single rays miss then shows as a gap. It also exceeds 1 where rays pass many
  /// features.
  virtual double refinement(double /*footprint*/, double /*cosine*/) const { return 1; }
  /// Approximate ratio of the width of octaves' features to the width of Phi's features.
  virtual double sharpness() const = 0;
  /// sqrt(<(Phi factor)^2>), at least 1.
  virtual double rms() const = 0;

 protected:
  /// Phi for rays that resolve all octaves.
  virtual void evaluate_whole(const Points& points, BatchArray& out,
                              std::uint64_t& evaluations) const = 0;

 private:
  double twirl_;
};

/// The texture of FractalNoise.
class FractalTexture : public Texture {
 public:
  /// `thickness` is that of the component, galaxy radii.
  FractalTexture(const FractalParameters& parameters, double twirl, double thickness)
      : Texture(twirl), noise_(parameters, thickness) {}

  const FractalNoise& noise() const { return noise_; }

  void normalise(std::span<const WeightedBatch> cloud,
                 const FractalNoise::Factor& factor) override {
    noise_.normalise(cloud, factor);
  }
  std::vector<double> statistics() const override { return noise_.statistics(); }
  void restore(std::span<const double> statistics) override { noise_.restore(statistics); }
  bool hides(double footprint) const override { return noise_.hides(footprint); }
  double frequency() const override { return noise_.effective_frequency() * sharpness(); }
  double sharpness() const override { return noise_.sharpness(); }
  double rms() const override { return noise_.rms(); }
  void see(const Points& points, std::span<const float* const> footprints, bool wants_coherent,
           std::span<SeenNoise> out, std::uint64_t& evaluations) const override;
  void expect(std::size_t size, const SeenNoise& seen, const float* coherence,
              std::span<const double> deviations, std::span<BatchArray> out) const override;

 private:
  void evaluate_whole(const Points& points, BatchArray& out,
                      std::uint64_t& evaluations) const override;

  FractalNoise noise_;
};

}  // namespace gamer
