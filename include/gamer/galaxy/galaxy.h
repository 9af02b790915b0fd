#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/galaxy/arm_pattern.h"
#include "gamer/galaxy/calibration/footprint_table.h"
#include "gamer/galaxy/component.h"

namespace gamer {

/// What evaluations cost; times are summed over threads.
struct EvaluationCounts {
  std::uint64_t noise_evaluations = 0;  ///< base noises: points times octaves
  double noise_seconds = 0;             ///< sums of octaves
  double envelope_seconds = 0;          ///< the rest
};

/// What looks at a galaxy: the footprints of rays in galaxy radii, by default all, and whether
/// something sees its whole texture besides, such as the light of drawn stars.
struct FootprintRange {
  double narrowest = 0;
  double widest = HUGE_VAL;
  bool sees_whole = false;

  bool covers(const FootprintRange& other) const {
    return narrowest <= other.narrowest && other.widest <= widest;
  }
  /// The least range that holds both.
  FootprintRange operator|(const FootprintRange& other) const {
    return {std::min(narrowest, other.narrowest), std::max(widest, other.widest),
            sees_whole || other.sees_whole};
  }
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
  /// The footprints for which the closure has been measured on this reference.
  const FootprintRange& closure_range() const { return closure_range_; }
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

 private:
  /// Paths per height of the rays on which the closure of dust is measured.
  static constexpr std::array<double, 3> obliquities = {1, 2.5, 8};
  /// A table for each obliquity. Between them values are linear in ln obliquity.
  using ByObliquity = std::array<FootprintTable, obliquities.size()>;
  /// The closure of hidden dust. With it, dust that rays do not resolve lets through as much light
  /// as all of its texture would.
  struct Dust {
    /// Variance of the coherent part of the hidden dust, relative to that of its texture's model.
    ByObliquity coherence;
    /// Mean density of the variants with this variance, relative to the texture's expectation at
    /// that footprint.
    ByObliquity amount;
  };

  friend class GalaxyStatistics;

  /// Reads the file without a reference.
  static std::shared_ptr<Galaxy> read_alone(std::string_view text, const std::string& label,
                                            const GalaxySettings& settings, Resources& resources);
  void resolve(const std::string& label);
  void resolve_fractions();
  /// Throws InputError where a component's density exceeds single precision.
  void check_densities() const;
  /// Fills what components share about points.
  void place(const Points& points, bool wants_shear, SampleBatch& batch) const;
  /// Turns points that were turned back by a component's twirl back by `twirl` more, in x, y, z.
  Points turn_back(const Points& points, double twirl, BatchArray& x, BatchArray& y,
                   BatchArray& z) const;
  /// Fills an array for each component with the mean of its own Phi at these footprints. Null
  /// footprints see all. The mean of a follower is that of both textures together over that of the
  /// followed one.
  void look_up_means(std::size_t size, const BatchArray* log_footprints,
                     std::span<BatchArray> out) const;
  static void look_up(const ByObliquity& tables, std::size_t size, const BatchArray& log_footprints,
                      const BatchArray& obliquity, BatchArray& out);
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
  /// For each component, the mean of its Phi at a footprint, times the Phi of the component that it
  /// follows. Phi is divided by it, so that <Phi> = 1 for this seed at every footprint.
  std::vector<FootprintTable> means_;
  /// For each component, ln of the widest footprint that hides nothing of it.
  std::vector<float> log_narrow_;
  /// The closure of each component that absorbs. Galaxies of one reference share it.
  std::shared_ptr<const std::vector<Dust>> dust_;
  std::shared_ptr<Galaxy> reference_;
  bool is_reference_ = false;
  /// The footprints for which a reference's closure has been measured.
  FootprintRange closure_range_{HUGE_VAL, 0, false};
  bool needs_phi_ = false;
  bool needs_winding_ = false;
};

}  // namespace gamer
