#pragma once

#include <array>
#include <cstddef>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

class StarField;

/// The measurement of the statistics of a galaxy's textures.
///
/// A galaxy's seed decides the mean of Phi over each component at each footprint, and the largest
/// Phi of star fields. Both are measured for every galaxy. The closure of hidden dust is measured
/// on the galaxy's reference (Galaxy::reference()). At coarse tolerances all galaxies of a file
/// share one reference (Accuracy::shares_closure). A galaxy of fixed flux also takes the scales of
/// veins and associations from its reference.
///
/// The work is done in rounds, and each round in parts. A part uses only results of earlier rounds,
/// so that any process may measure it. A galaxy is complete when it has taken all parts of all
/// rounds and adopted its reference's closure.
///
/// Tables hold values for a range of footprints. A value does not depend on the range. Beyond the
/// ends tables are constant.
class GalaxyStatistics {
 public:
  /// `galaxy` comes from Galaxy::read() or is a reference, and must outlive this object.
  explicit GalaxyStatistics(Galaxy& galaxy, FootprintRange footprints = {});

  enum class Round {
    textures,  ///< mean and deviation of sums of octaves, by component
    means,     ///< means of Phi over a few points, by component
    larger,    ///< means over the number of points that the error needs, by slices of a cloud
    closure    ///< closure of a reference's dust, by obliquity; largest Phi of star fields
  };
  static constexpr Round rounds[] = {Round::textures, Round::means, Round::larger, Round::closure};

  /// Number of parts of a round. All earlier rounds must be finished.
  std::size_t parts(Round round) const { return of(round).size(); }
  /// Index of the component to which a part belongs.
  std::size_t component(Round round, std::size_t part) const { return of(round)[part].component; }
  /// A text of all that decides the results of a part. Parts of equal name have equal results, in
  /// any galaxy.
  std::string name(Round round, std::size_t part) const;
  /// Largest number of results of a part.
  std::size_t most_numbers() const { return most_numbers_; }

  /// Measures a part and fills the beginning of `numbers`, whose size is at least most_numbers().
  /// Uses the threads of parallel_for(); one thread at a time may call this function. Throws
  /// InputError where a texture is constant, zero or infinite over its component.
  void measure(Round round, std::size_t part, std::span<double> numbers);
  /// Gives the numbers of a part to the galaxy. Parts are taken in order.
  void take(Round round, std::size_t part, std::span<const double> numbers);
  /// Ends a round after all its parts were taken. Throws InputError where a texture is zero or
  /// infinite.
  void finish(Round round);
  /// Takes the closure that was measured on the galaxy's reference, if the galaxy has a reference.
  void adopt();
  /// Measures everything in this process, including the reference.
  void measure_all();

 private:
  struct Part {
    std::size_t component;
    std::size_t index;  ///< index in larger_, or in DustClosure::obliquities
    std::size_t slice;  ///< slice of the larger cloud
  };
  /// The mean of a component's Phi at a footprint.
  struct Mean {
    Mean(std::size_t of_component, double at_footprint)
        : component(of_component), footprint(at_footprint) {}

    std::size_t component;
    double footprint;
    double value = 1, error = 0;
  };
  /// A cloud of a component for means that need more points than the first cloud has.
  struct LargerCloud {
    std::size_t component, points;
    std::size_t slices = 0;
    std::vector<std::size_t> means = {};     ///< indices in means_
    std::vector<CloudMoments> moments = {};  ///< for each mean
  };

  const Component& component_at(std::size_t c) const { return *galaxy_.components()[c]; }
  bool is_reference() const { return galaxy_.is_reference(); }
  /// Whether few points suffice for this component: dust of a galaxy of fixed flux, at a high
  /// tolerance.
  bool is_rough(std::size_t c) const;
  bool is_textured(std::size_t c) const {
    return component_at(c).texture() != nullptr || galaxy_.followed(c) >= 0;
  }
  const std::vector<Part>& of(Round round) const { return parts_[static_cast<std::size_t>(round)]; }
  std::vector<Part>& of(Round round) { return parts_[static_cast<std::size_t>(round)]; }
  /// Whether the texture of component c takes its statistics from the galaxy's reference, which is
  /// measured first. Both textures have equal statistics where they have one seed. In a galaxy of
  /// fixed flux a scale of another seed suffices. There the galaxy's own rays fix each component's
  /// light, and dust is divided by its own mean.
  bool adopts_texture(std::size_t c) const;
  /// Throws std::logic_error where the reference is not measured.
  void adopt_texture(std::size_t c);
  /// Takes the statistics of component c's texture over its first cloud, once. The component that
  /// it follows must come first.
  void normalise(std::size_t c);
  /// light_behind_dust() of component c.
  const std::vector<BatchArray>& light_behind(std::size_t c);
  /// A text of all that decides light_behind_dust() of component c.
  std::string light_behind_text(std::size_t c) const;
  /// Makes means_ and the parts of the rounds after the first.
  void plan_means();
  void plan_slices();
  /// The number of points that gives a mean the wanted error, if the first cloud's relative error
  /// is `error`; 0 if the first cloud suffices. The number is a power of 2 or the
  /// largest allowed, so that means share clouds.
  std::size_t points_needed(const Mean& mean, double error) const;
  std::size_t first_points(std::size_t c) const;
  /// The relative error that the mean of component c's Phi at this footprint may have.
  double wanted_error(std::size_t c, double footprint) const;
  /// wanted_error() for Component::texture_means(), rounded down to a power of 2. The error does
  /// not depend on the footprint, since components with such means emit light. A small change of
  /// light fractions mostly leaves the rounded error as it is, so that nothing is measured again.
  double error_of_texture_mean(std::size_t c) const;
  /// Component c's share of the galaxy's light, for the error of its means; 1 for dust.
  double share(std::size_t c) const;
  /// Writes the means of component c over its first cloud to `numbers`: value and error of each.
  void measure_means(std::size_t c, std::span<double> numbers) const;
  /// Moments of component c's Phi at each footprint, over batches [first, last) of a cloud.
  std::vector<CloudMoments> moments_of(std::size_t c, const Cloud& cloud, std::size_t first,
                                       std::size_t last, std::span<const double> widths) const;
  std::vector<CloudMoments> measure_slice(const LargerCloud& larger, std::size_t slice) const;
  std::vector<double> footprints_of(const LargerCloud& larger) const;
  void make_tables();
  /// The largest Phi of component c, a star field, before Phi is divided by its mean.
  double largest_phi(std::size_t c, const StarField& field) const;

  /// Whether rays of this footprint hide a part of the texture of component c, or of the component
  /// that it follows.
  bool hides(std::size_t c, double footprint) const;
  /// ln of the widest footprint that hides nothing of component c and of the component that it
  /// follows.
  double log_narrowest(std::size_t c) const;
  /// Footprints that hide something, up to `widest`, each `ratio` times the previous footprint.
  std::vector<double> widths(std::size_t c, double widest, double ratio) const;
  /// Footprints at which means are tabulated: 0 (everything is resolved), then footprints that hide
  /// something.
  std::vector<double> mean_widths(std::size_t c) const;
  std::vector<double> dust_widths(std::size_t c) const;
  /// The part of `widths` that is measured, from the last width below footprints_ to the first
  /// above.
  std::span<const double> measured(const std::vector<double>& widths) const;
  /// Values for all widths from those of the measured widths. Other widths get the nearest value.
  std::vector<double> for_all(const std::vector<double>& widths,
                              const std::vector<double>& values) const;

  Galaxy& galaxy_;
  FootprintRange footprints_;
  double light_ = 0;                                        ///< light of the galaxy
  std::array<std::vector<Part>, std::size(rounds)> parts_;  ///< by round
  std::size_t most_numbers_ = 0;
  std::vector<bool> is_normalised_;  ///< for each component
  std::vector<Mean> means_;          ///< for each component in turn, by footprint
  std::vector<LargerCloud> larger_;
  GalaxyCalibration calibration_;
  std::vector<DustClosure> dust_;  ///< the closure, for each component of a reference
  /// light_behind_dust() of each component, shared by galaxies of one light_behind_text().
  std::vector<std::shared_ptr<const std::vector<BatchArray>>> light_behind_;
};

}  // namespace gamer
