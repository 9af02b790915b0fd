#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"
#include "gamer/galaxy/footprint_table.h"

namespace gamer {

/// What evaluations cost; times are summed over threads.
struct EvaluationCounts {
  std::uint64_t noise_evaluations = 0;  ///< base noises: points times octaves
  double noise_seconds = 0;             ///< sums of octaves
  double envelope_seconds = 0;          ///< the rest
};

/// A galaxy type with its noise realised for one seed: components in the ball frame (the ball of
/// radius 1 after undoing `axis`; disk plane z = 0). Immutable once it is measured, and evaluated
/// from many threads.
class Galaxy {
 public:
  /// Reads a galaxy file and measures it. Throws InputError.
  static std::shared_ptr<const Galaxy> parse(std::string_view text, const std::string& label,
                                             const GalaxySettings& settings, Resources& resources);
  /// Reads a galaxy file. GalaxyStatistics measures what it needs before it is evaluated; all else
  /// is known. Throws InputError.
  static std::shared_ptr<Galaxy> read(std::string_view text, const std::string& label,
                                      const GalaxySettings& settings, Resources& resources);
  static ParameterTable table();  ///< of [galaxy]

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  const std::vector<double>& axis() const { return axis_; }
  const ArmPattern& arms() const { return arms_; }
  /// The active components.
  std::span<const std::unique_ptr<Component>> components() const { return components_; }

  /// Evaluates at most batch_capacity points of the ball frame: densities[c][i] = amplitude *
  /// envelope * Phi of component c (emissivity at 5500 Angstrom, or opacity at V, per galaxy
  /// radius). Where a component's envelope is below `threshold` threshold_scale() over the optical
  /// depth of thick dust, its Phi counts as 1 and is not computed; Phi fades in up to 4 times that.
  /// Textures that `rays` (null for rays that see all) do not resolve count by what is expected of
  /// them. With as many arrays as `deviations` times components, densities[d * components + c] is
  /// that of an absorbing component where the coherent part of what is hidden is deviations[d]
  /// standard deviations.
  void evaluate(const Points& points, float threshold, const RayBatch* rays,
                std::span<const double> deviations, std::span<BatchArray> densities,
                EvaluationCounts& counts) const;

  /// Envelope * Phi of component c alone (evaluate() is `amplitude` times it), at no more than
  /// batch_capacity points, for rays that see all of its texture.
  void evaluate_component(std::size_t c, const Points& points, float threshold, BatchArray& density,
                          EvaluationCounts& counts) const;

  /// Dust-free light at 5500 Angstrom of component c: the integral of its emissivity over the
  /// galaxy, galaxy radii^3.
  double luminosity(std::size_t c) const;

 private:
  /// Path per height, of rays at which what dust lets through is measured.
  static constexpr std::array<double, 3> obliquities = {1, 2.5, 8};
  /// Between obliquities linear in their logarithm.
  using ByObliquity = std::array<FootprintTable, obliquities.size()>;
  /// How dust that rays do not resolve lets through as much light as all of its texture would.
  struct Dust {
    /// Variance of the coherent part of what is hidden, relative to what its texture says.
    ByObliquity coherence;
    /// How much dust the variants then have; they are divided by it.
    ByObliquity amount;
    /// ln of the widest footprint that sees all, for which there may be no variants.
    float log_narrow = 0;
  };

  friend class GalaxyStatistics;

  void resolve(const std::string& label);
  void resolve_fractions();
  /// Throws InputError where component c's exceeds single precision.
  void check_density(std::size_t c) const;
  /// Fills what components share about points.
  void place(const Points& points, bool wants_shear, SampleBatch& batch) const;
  /// Points that were turned back by a component's twirl, turned back by `twirl` more: in x, y, z.
  Points turn_back(const Points& points, double twirl, BatchArray& x, BatchArray& y,
                   BatchArray& z) const;
  static void look_up(const ByObliquity& tables, std::size_t size, const BatchArray& log_footprints,
                      const BatchArray& obliquity, BatchArray& out);
  /// Fills out.size() arrays with Phi of component c, by as many deviations; 1 where it is not
  /// needed.
  void phi(std::size_t c, const SampleBatch& batch, const BatchArray& need, float threshold,
           const BatchArray* footprints, const BatchArray* coherence,
           std::span<const double> deviations, std::span<BatchArray> out,
           EvaluationCounts& counts) const;

  std::size_t most_cloud_points_ = 0;  ///< GalaxySettings::most_cloud_points
  std::string name_;
  std::string description_;
  std::vector<double> axis_ = {1, 1, 1};
  ArmPattern arms_;
  std::vector<std::unique_ptr<Component>> components_;
  /// By what thresholds of evaluate() are multiplied: the image of thick dust is made in its skin,
  /// where envelopes have fallen by its optical depth.
  float skin_scale_ = 1;
  std::vector<double> integrals_;  ///< of each component's envelope over the galaxy
  /// Index of the component whose noise also modulates component c, or -1.
  std::vector<int> followed_;
  std::vector<std::size_t> followed_components_;
  /// Normalises a followed noise over a component that has none of its own; else 1.
  std::vector<double> follow_scale_;
  /// Of each component that emits, its followed one's Phi included: the mean over the component of
  /// what is expected of Phi, by which it is divided. Expectations are exact only about, and where
  /// what is seen is few clumps, the mean over them is not that of the others.
  std::vector<FootprintTable> seen_means_;
  std::vector<Dust> dust_;  ///< of each component that absorbs
  bool needs_phi_ = false;
  bool needs_winding_ = false;
};

}  // namespace gamer
