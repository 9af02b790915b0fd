#pragma once

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

/// The cost of evaluations; times are summed over threads.
struct EvaluationCounts {
  std::uint64_t noise_evaluations = 0;  ///< base noises: points times octaves
  double noise_seconds = 0;             ///< time of the sums of octaves
  double envelope_seconds = 0;          ///< time of the rest of the evaluation
};

/// A galaxy type with its noise for one seed. Its components are in the ball frame (the ball of
/// radius 1 after undoing `axis`; disk plane z = 0). A measured galaxy is immutable, and several
/// threads may evaluate it.
class Galaxy {
 public:
  /// Reads a galaxy file and measures it. Throws InputError if the file, or a file that it names,
  /// is wrong.
  static std::shared_ptr<const Galaxy> parse(std::string_view text, const std::string& label,
                                             const GalaxySettings& settings, Resources& resources);
  /// Reads a parsed galaxy file. GalaxyStatistics must measure the galaxy before it is evaluated. A
  /// galaxy with clumpy dust has a reference. If Accuracy::shares_closure is true, the reference is
  /// GalaxySettings::reference or, without one, a new galaxy of a fixed seed. Otherwise the
  /// reference is a new galaxy of its own seed. Throws InputError as parse() does.
  static std::shared_ptr<Galaxy> read(ConfigNode file, const GalaxySettings& settings,
                                      Resources& resources);
  static ParameterTable table();  ///< of [galaxy]

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  const std::vector<double>& axis() const { return axis_; }
  /// The galaxy of this file on which the closure of hidden dust is measured. Galaxies of other
  /// seeds may take scales of textures from it. Null without textured dust.
  const std::shared_ptr<Galaxy>& reference() const { return reference_; }
  bool is_reference() const { return is_reference_; }
  /// The measurements of GalaxyStatistics.
  const GalaxyCalibration& calibration() const { return calibration_; }
  void set_calibration(GalaxyCalibration calibration) { calibration_ = std::move(calibration); }
  /// Everything that decides the galaxy's textures and their statistics, except the components'
  /// amplitudes. Galaxies of equal shape differ in light, depth of dust and spectra alone.
  const std::string& shape() const { return shape_; }
  const ArmPattern& arms() const { return arms_; }
  /// The active components.
  std::span<const std::unique_ptr<Component>> components() const { return components_; }

  /// Evaluates the density of each component c at point i of the ball frame:
  ///   densities[c][i] = amplitude * envelope * Phi,
  /// the emissivity at 5500 Angstrom or the extinction coefficient at V, per galaxy radius. There
  /// are at most batch_capacity points.
  ///
  /// Phi counts as 1, and is not computed, where the envelope is below the limit `threshold` times
  /// threshold_scale(). In galaxies of face-on optical depth tau > 5 the limit is multiplied by
  /// 5/tau. Phi fades in up to 4 times the limit.
  ///
  /// Octaves that a footprint of `rays` hides count by their expectation; with null rays nothing is
  /// hidden. With `deviations` there is a set of arrays for each deviation. In set d, densities[d *
  /// components + c], the coherent part of the hidden dust is deviations[d] standard deviations.
  void evaluate(const Points& points, float threshold, const RayBatch* rays,
                std::span<const double> deviations, std::span<BatchArray> densities,
                EvaluationCounts& counts) const;

  /// Envelope * Phi of component c alone, at no more than batch_capacity points, for rays that
  /// resolve the whole texture. evaluate() gives `amplitude` times this value. Without
  /// `divides_light`, Phi of components that emit is not divided by its mean.
  void evaluate_component(std::size_t c, const Points& points, float threshold, BatchArray& density,
                          EvaluationCounts& counts, bool divides_light = true) const;

  /// Dust-free light at 5500 Angstrom of component c: the integral of its emissivity over the
  /// galaxy, galaxy radii^3. Components that `solo` hides have the luminosity that they would have
  /// without it.
  double luminosity(std::size_t c) const;

  /// Index of the component whose texture also modulates component c, or -1.
  int followed(std::size_t c) const { return followed_[c]; }
  /// The density at the places of a star field's candidates, with which their thresholds are
  /// compared. It is envelope Phi of component c, or StarClumps::evaluate() for stars in the clumps
  /// of these indices.
  void evaluate_stars(std::size_t c, const Points& points, std::span<const std::uint32_t> clumps,
                      BatchArray& density, EvaluationCounts& counts) const;
  /// The largest value of Phi that is used for component c, which is a star field. For stars in
  /// clumps the result is a factor, which turns StarClumps::evaluate() into the clump's part of Phi
  /// divided by the mean of Phi.
  double largest_phi(std::size_t c) const;
  /// Whether evaluation needs the winding of the arms.
  bool needs_winding() const { return needs_winding_; }
  std::size_t most_cloud_points() const { return most_cloud_points_; }
  /// The allowed error of means of textures: Accuracy::mean_error.
  double mean_error() const { return mean_error_; }
  /// Fills the quantities of points that components share.
  void fill_batch(const Points& points, bool wants_shear, SampleBatch& batch) const;
  /// Adds `sign` times the heights of component c's mid-plane above z = 0, at points that are not
  /// turned.
  void add_lift(std::size_t c, const Points& points, float sign, float* z) const;
  /// Turns points back about the axis by a further `twirl`. The points come from a component whose
  /// own twirl has already turned them back. The arrays x, y, z hold the result.
  Points turn_back(const Points& points, double twirl, BatchArray& x, BatchArray& y,
                   BatchArray& z) const;

 private:
  class Evaluation;
  /// Reads the file without a reference.
  static std::shared_ptr<Galaxy> read_alone(const ConfigNode& root, const GalaxySettings& settings,
                                            Resources& resources);
  void resolve(const SourceLocation& file, const Galaxy* twin);
  /// Index of the component of this name, or -1.
  int position(const std::string& name) const;
  /// Throws InputError where a component cannot follow the one that it names. Star fields that
  /// follow associations take their clumps.
  void join_followers();
  /// Makes integrals_, from the twin where it has an equal envelope.
  void add_integrals(const Galaxy* twin);
  void resolve_fractions();
  /// Hides all components except the one of this name; luminosity() does not change. Throws
  /// InputError if no component that emits light has the name.
  void show_alone(const std::string& name, const SourceLocation& where);
  /// Throws InputError where a component's density exceeds single precision.
  void check_densities() const;
  /// Fills an array for each component with the mean of its own Phi at these footprints; null
  /// footprints hide nothing. The mean of a follower is the mean of both textures together, divided
  /// by the mean of the followed texture.
  void look_up_means(std::size_t size, const BatchArray* log_footprints, bool divides_light,
                     std::span<BatchArray> out) const;
  static void look_up(const DustClosure::ByObliquity& tables, std::size_t size,
                      const BatchArray& log_footprints, const BatchArray& obliquity,
                      BatchArray& out);
  /// Decides which components follow which, and which are evaluated before others or together.
  void order_evaluation();
  /// Fills out.size() arrays, one for each deviation, with Phi of component c divided by its mean.
  /// Values are 1 where Phi is not needed.
  void phi(std::size_t c, const SampleBatch& batch, const BatchArray& need, float threshold,
           const BatchArray& mean, const BatchArray* footprints, const BatchArray* coherence,
           std::span<const double> deviations, std::span<BatchArray> out,
           EvaluationCounts& counts) const;

  std::size_t most_cloud_points_ = 0;  ///< GalaxySettings::most_cloud_points
  double mean_error_ = 0;              ///< Accuracy::mean_error
  std::string name_;
  std::string description_;
  std::string shape_;
  std::string surroundings_;  ///< ComponentSurroundings::text
  std::vector<double> axis_ = {1, 1, 1};
  ArmPattern arms_;
  std::vector<std::unique_ptr<Component>> components_;
  /// Factor of the thresholds of evaluate(). Thick dust is seen at its surface, where envelopes
  /// have fallen by its optical depth.
  float skin_scale_ = 1;
  std::vector<double> integrals_;     ///< integral of each component's envelope over the galaxy
  std::vector<double> luminosities_;  ///< of the components before some were hidden, or empty
  /// Index of the component whose noise also modulates component c, or -1.
  std::vector<int> followed_;
  /// Index of the associations whose layer and clumps component c, a star field, shares, or -1.
  std::vector<int> clump_leader_;
  /// Index of the star field that is evaluated together with component c, its clump_leader_, or -1.
  std::vector<int> clump_stars_;
  /// Place of component c among those whose noise is evaluated before that of others, or -1.
  std::vector<int> early_;
  std::size_t early_count_ = 0;
  GalaxyCalibration calibration_;
  std::shared_ptr<Galaxy> reference_;
  bool is_reference_ = false;
  bool needs_azimuth_ = false;
  bool needs_winding_ = false;
};

}  // namespace gamer
