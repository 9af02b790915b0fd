#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/calibration/galaxy_calibration.h"
#include "gamer/galaxy/component.h"

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
  /// is known. A galaxy with clumpy dust has a reference. Where Accuracy::shares_closure, it is
  /// that of the settings, which must be of the same file and settings, or a new one of a fixed
  /// seed. Otherwise it is a new one of the galaxy's own seed. Throws InputError.
  static std::shared_ptr<Galaxy> read(std::string_view text, const std::string& label,
                                      const GalaxySettings& settings, Resources& resources);
  static ParameterTable table();  ///< of [galaxy]

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  const std::vector<double>& axis() const { return axis_; }
  /// The galaxy of the same file, but of a fixed seed, on which the closure of hidden dust is
  /// measured for all seeds; null where there is no dust with a texture.
  const std::shared_ptr<Galaxy>& reference() const { return reference_; }
  bool is_reference() const { return is_reference_; }
  /// What GalaxyStatistics measured.
  const GalaxyCalibration& calibration() const { return calibration_; }
  void set_calibration(GalaxyCalibration calibration) { calibration_ = std::move(calibration); }
  const ArmPattern& arms() const { return arms_; }
  /// The active components.
  std::span<const std::unique_ptr<Component>> components() const { return components_; }

  /// Evaluates the density of each component c at point i of the ball frame:
  ///   densities[c][i] = amplitude * envelope * Phi,
  /// the emissivity at 5500 Angstrom or the extinction coefficient at V, per galaxy radius. There
  /// are at most batch_capacity points.
  ///
  /// Phi counts as 1, and is not computed, where the envelope is below `threshold` times
  /// threshold_scale(), divided by the optical depth of thick dust. Phi fades in up to 4 times
  /// that.
  ///
  /// Octaves that a footprint of `rays` hides count by their expectation; null rays see all. With
  /// `deviations` there are that many sets of arrays. In set d, densities[d * components + c], the
  /// coherent part of the hidden dust is deviations[d] standard deviations.
  void evaluate(const Points& points, float threshold, const RayBatch* rays,
                std::span<const double> deviations, std::span<BatchArray> densities,
                EvaluationCounts& counts) const;

  /// Envelope * Phi of component c alone, at no more than batch_capacity points, for rays that see
  /// all of its texture. evaluate() gives `amplitude` times that.
  void evaluate_component(std::size_t c, const Points& points, float threshold, BatchArray& density,
                          EvaluationCounts& counts) const;

  /// Dust-free light at 5500 Angstrom of component c: the integral of its emissivity over the
  /// galaxy, galaxy radii^3.
  double luminosity(std::size_t c) const;

  /// Index of the component whose texture also modulates component c, or -1.
  int followed(std::size_t c) const { return followed_[c]; }
  /// Whether places need the winding of the arms.
  bool needs_winding() const { return needs_winding_; }
  std::size_t most_cloud_points() const { return most_cloud_points_; }
  /// The error that means of textures may have: Accuracy::mean_error.
  double mean_error() const { return mean_error_; }
  /// Fills what components share about points.
  void fill_batch(const Points& points, bool wants_shear, SampleBatch& batch) const;
  /// Turns points that were turned back by a component's twirl back by `twirl` more, in x, y, z.
  Points turn_back(const Points& points, double twirl, BatchArray& x, BatchArray& y,
                   BatchArray& z) const;

 private:
  /// Reads the file without a reference.
  static std::shared_ptr<Galaxy> read_alone(std::string_view text, const std::string& label,
                                            const GalaxySettings& settings, Resources& resources);
  void resolve(const std::string& label);
  void resolve_fractions();
  /// Throws InputError where a component's density exceeds single precision.
  void check_densities() const;
  /// Fills an array for each component with the mean of its own Phi at these footprints. Null
  /// footprints see all. The mean of a follower is that of both textures together over that of the
  /// followed one.
  void look_up_means(std::size_t size, const BatchArray* log_footprints,
                     std::span<BatchArray> out) const;
  static void look_up(const DustClosure::ByObliquity& tables, std::size_t size,
                      const BatchArray& log_footprints, const BatchArray& obliquity,
                      BatchArray& out);
  /// Fills out.size() arrays with Phi of component c over its mean, by as many deviations; 1 where
  /// it is not needed.
  void phi(std::size_t c, const SampleBatch& batch, const BatchArray& need, float threshold,
           const BatchArray& mean, const BatchArray* footprints, const BatchArray* coherence,
           std::span<const double> deviations, std::span<BatchArray> out,
           EvaluationCounts& counts) const;

  std::size_t most_cloud_points_ = 0;  ///< GalaxySettings::most_cloud_points
  double mean_error_ = 0;              ///< Accuracy::mean_error
  std::string name_;
  std::string description_;
  std::vector<double> axis_ = {1, 1, 1};
  ArmPattern arms_;
  std::vector<std::unique_ptr<Component>> components_;
  /// Factor of the thresholds of evaluate(). The image of thick dust is made in its skin, where
  /// envelopes have fallen by its optical depth.
  float skin_scale_ = 1;
  std::vector<double> integrals_;  ///< of each component's envelope over the galaxy
  /// Index of the component whose noise also modulates component c, or -1.
  std::vector<int> followed_;
  std::vector<std::size_t> followed_components_;
  GalaxyCalibration calibration_;
  std::shared_ptr<Galaxy> reference_;
  bool is_reference_ = false;
  bool needs_azimuth_ = false;
  bool needs_winding_ = false;
};

}  // namespace gamer
