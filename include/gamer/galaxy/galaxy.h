#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/component.h"

namespace gamer {

/// What evaluations cost; times are summed over threads.
struct EvaluationCounts {
  std::uint64_t noise_evaluations = 0;  ///< base noises: points times octaves
  double noise_seconds = 0;             ///< sums of octaves
  double envelope_seconds = 0;          ///< the rest
};

/// A galaxy type with its noise realised for one seed: components in the ball frame (the ball of
/// radius 1 after undoing `axis`; disk plane z = 0). Immutable; evaluated from many threads.
class Galaxy {
 public:
  /// Reads a galaxy file. Throws InputError.
  static std::shared_ptr<const Galaxy> parse(std::string_view text, const std::string& label,
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
  /// radius). Where a component's envelope is below `threshold` threshold_scale() its Phi counts as
  /// 1 and is not computed; Phi fades in up to 4 times that. Of the points' rays `footprints`
  /// (galaxy radii) are given, or null for none: textures that they do not resolve count by what is
  /// expected of them (FractalNoise). With as many arrays as `deviations` times components,
  /// densities[d * components + c] is that of an absorbing component where the coherent part of
  /// what is hidden is deviations[d] standard deviations.
  void evaluate(const Points& points, float threshold, const BatchArray* footprints,
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
  void resolve(const std::string& label, std::size_t most_cloud_points);
  void normalise_textures(std::size_t most_cloud_points);
  /// Normalises component c's texture, or follow_scale_ where it has none, over a cloud of that
  /// size; the relative standard error of the mean. With a `correction_size` also what wide rays
  /// see of it, over a cloud of that size.
  double normalise(std::size_t c, std::size_t cloud_size, std::size_t correction_size);
  /// Phi of the component that c follows at points of c's cloud, as rays of a footprint see it.
  void followed_phi(std::size_t c, const Points& points, double footprint, float* out) const;
  void resolve_fractions();
  /// Tells star fields the largest of their Phi.
  void measure_star_fields();
  /// Fills out.size() arrays with Phi of component c, by as many deviations; 1 where it is not
  /// needed.
  void phi(std::size_t c, const SampleBatch& batch, const BatchArray& need, float threshold,
           const BatchArray* footprints, std::span<const double> deviations,
           std::span<BatchArray> out, EvaluationCounts& counts) const;

  std::string name_;
  std::string description_;
  std::vector<double> axis_ = {1, 1, 1};
  ArmPattern arms_;
  std::vector<std::unique_ptr<Component>> components_;
  std::vector<double> integrals_;  ///< of each component's envelope over the galaxy
  /// Index of the component whose noise also modulates component c, or -1.
  std::vector<int> followed_;
  std::vector<std::size_t> followed_components_;
  /// Normalises a followed noise over a component that has none of its own; else 1.
  std::vector<double> follow_scale_;
  bool needs_phi_ = false;
  bool needs_winding_ = false;
};

}  // namespace gamer
