#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/noise/fractal.h"

namespace gamer {

/// What breaks a component up: Phi(x), with <Phi> = 1 over the component's own envelope. It is
/// evaluated at points turned back about the axis by twirl * theta(r), so that its features
/// are wound in the sense of the arms (at twirl = 1 along them).
class Texture {
 public:
  explicit Texture(double twirl) : twirl_(twirl) {}
  virtual ~Texture() = default;

  double twirl() const { return twirl_; }

  /// Makes <Phi factor> = 1 over `cloud` (weighted); `factor` may be empty. Throws InputError where
  /// that cannot be.
  virtual void normalise(std::span<const WeightedBatch> cloud,
                         const FractalNoise::Factor& factor) = 0;
  /// All that normalise() took, for the same texture elsewhere.
  virtual std::vector<double> statistics() const = 0;
  virtual void restore(std::span<const double> statistics) = 0;

  /// Fills out.size() arrays with Phi. With footprints (galaxy radii; null for none) it is what is
  /// expected of Phi given what such rays see; out[d] where the coherent part of the rest is
  /// deviations[d] standard deviations, its variance being `coherence` (null for 1) times the
  /// model's, or with one array and no deviations over all that is hidden. A point's value does not
  /// depend on the others of the batch. Counts the base noises that were evaluated.
  void evaluate(const Points& points, const float* footprints, const float* coherence,
                std::span<const double> deviations, std::span<BatchArray> out,
                std::uint64_t& evaluations) const;

  /// evaluate() with footprints in two steps. What rays see of the same points by as many sets of
  /// footprints, of which `out` is for expect() alone: what is common to them is evaluated once. Of
  /// all points alike: those of which all is seen may differ by rounding from what they are
  /// elsewhere. For deviations the coherent part is wanted.
  virtual void see(const Points& points, std::span<const float* const> footprints,
                   bool wants_coherent, std::span<SeenNoise> out,
                   std::uint64_t& evaluations) const = 0;
  /// Phi of one of them.
  virtual void expect(std::size_t size, const SeenNoise& seen, const float* coherence,
                      std::span<const double> deviations, std::span<BatchArray> out) const = 0;

  /// Whether rays of that footprint see less than all.
  virtual bool hides(double footprint) const = 0;
  /// Frequency of the sharpest features, cycles per galaxy radius.
  virtual double frequency() const = 0;
  /// By how much the features of Phi are narrower than those of its octaves, roughly.
  virtual double sharpness() const = 0;
  /// sqrt(<(Phi factor)^2>), at least 1.
  virtual double rms() const = 0;

 protected:
  /// Phi, where all is seen.
  virtual void evaluate_whole(const Points& points, BatchArray& out,
                              std::uint64_t& evaluations) const = 0;

 private:
  double twirl_;
};

/// The texture of FractalNoise.
class FractalTexture : public Texture {
 public:
  /// `thickness` (galaxy radii) of the component.
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
