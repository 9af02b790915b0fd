#pragma once

#include <array>
#include <cstddef>
#include <iterator>
#include <span>
#include <vector>

#include "gamer/core/batch.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

class StarField;

/// Measures the statistics of a galaxy's textures, over points spread over its components: the
/// means by which <Phi> = 1 (also of what components follow), what wide rays see relative to that,
/// by how much dust that they do not resolve must vary to let as much light through as all of it
/// would, and the largest Phi of star fields.
///
/// This is done in rounds, each in parts. What a part gives does not depend on the others of its
/// round, nor on which process measures it; it may depend on those of earlier rounds, which must
/// have been taken. A galaxy is measured when it has taken all parts of all rounds.
class GalaxyStatistics {
 public:
  /// Of a galaxy that was read (Galaxy::read()) and must outlive this.
  explicit GalaxyStatistics(Galaxy& galaxy);

  enum class Round {
    first,   ///< means over a few points, by component
    larger,  ///< over as many as the error needs, by slices of a component's cloud
    seen     ///< by component that emits, and by obliquity of dust
  };
  static constexpr Round rounds[] = {Round::first, Round::larger, Round::seen};

  /// Of a round whose predecessors are finished.
  std::size_t parts(Round round) const { return of(round).size(); }
  /// Index of the component that a part is of.
  std::size_t component(Round round, std::size_t part) const { return of(round)[part].component; }
  /// A part has at most so many numbers.
  std::size_t most_numbers() const { return most_numbers_; }

  /// Fills the beginning of `numbers`, of most_numbers() or more. In threads of parallel_for();
  /// not to be called from several. Throws InputError where a texture is constant, zero or infinite
  /// over its component, or a density exceeds single precision.
  void measure(Round round, std::size_t part, std::span<double> numbers);
  /// Gives the galaxy the numbers of a part; in the order of the parts.
  void take(Round round, std::size_t part, std::span<const double> numbers);
  /// When all parts of a round are taken.
  void finish(Round round);
  /// All of it, here.
  void measure_all();

 private:
  struct Part {
    std::size_t component;
    std::size_t index;  ///< of a slice, or of an obliquity of dust
  };
  /// The second cloud of a component, if it needs one.
  struct Larger {
    std::size_t points = 0, slices = 0;
    Cloud cloud;  ///< made where a slice of it is measured
    CloudMoments moments;
  };

  const Component& component_at(std::size_t c) const { return *galaxy_.components_[c]; }
  const std::vector<Part>& of(Round round) const { return parts_[static_cast<std::size_t>(round)]; }
  /// Takes the statistics of component c's texture over its first cloud, or Galaxy::follow_scale_
  /// where it has none, once; before it those of what it follows.
  void normalise(std::size_t c);
  /// How many points would have an error of `wanted`, of the galaxy's light, where `first` have one
  /// of `error` of the component's; 0 where that will do.
  std::size_t points_needed(std::size_t c, std::size_t first, double error, double wanted) const;
  /// Of Phi, over a slice of the larger cloud.
  CloudMoments measure_slice(std::size_t c, std::size_t slice);
  /// Takes the means over the larger clouds. Throws InputError where one is zero or infinite.
  void correct_means();
  /// Of the galaxy's light; 1 for dust.
  double share(std::size_t c) const;
  struct SeenMean {
    double mean, error;
  };
  /// What is expected of Phi of component c, which emits, by seen_widths(); none where they all see
  /// it all.
  std::vector<double> measure_seen(std::size_t c) const;
  /// The same by such widths, over about so many points.
  std::vector<SeenMean> measure_seen(std::size_t c, std::size_t cloud_size,
                                     std::span<const double> widths) const;
  struct DustRays;
  /// So many rays through component c, each `path` times as long in it as one face on.
  DustRays trace_dust(std::size_t c, double path, std::size_t rays,
                      std::span<const double> widths) const;
  /// Of dust, by dust_widths(): the variance of the coherent part of what is hidden, relative to
  /// what its texture says, and how much dust the variants then have.
  void measure_dust(std::size_t c, std::size_t obliquity, std::size_t rays,
                    std::vector<double>& coherences, std::vector<double>& amounts) const;
  /// The largest Phi of component c, which is a star field.
  double largest_phi(std::size_t c, const StarField& field) const;

  /// Whether rays of that footprint see less than all of component c and what it follows.
  bool hides(std::size_t c, double footprint) const;
  /// ln of the widest footprint of which rays see all of component c and what it follows.
  double log_narrowest(std::size_t c) const;
  /// Footprints up to the widest of which rays see less, each `ratio` times the one before.
  std::vector<double> widths(std::size_t c, double widest, double ratio) const;
  std::vector<double> seen_widths(std::size_t c) const;
  std::vector<double> dust_widths(std::size_t c) const;
  /// Phi of component c at points of its cloud, that of a followed one included, as rays of each
  /// width see it.
  void cloud_phi(std::size_t c, const Points& points, std::span<const double> widths,
                 std::span<BatchArray> out) const;
  /// The same of all of it.
  void whole_phi(std::size_t c, const Points& points, float* out) const;
  /// Multiplies arrays by Phi of the component that c follows, if any, at points that were turned
  /// back by c's twirl, as rays of as many widths see it.
  void multiply_followed(std::size_t c, const Points& points, const BatchArray& shear,
                         std::span<const double> widths, std::span<BatchArray> out) const;
  /// Phi of the component that c follows at points of c's cloud.
  void followed_phi(std::size_t c, const Points& points, float* out) const;
  const Component& followed_by(std::size_t c) const {
    return component_at(static_cast<std::size_t>(galaxy_.followed_[c]));
  }
  /// Points that were turned back by the twirl of component c, by that of the one it follows.
  Points turn_to_followed(std::size_t c, const Points& points, BatchArray& x, BatchArray& y,
                          BatchArray& z) const;
  /// r dtheta/dr at points of a cloud.
  void take_shear(const Points& points, BatchArray& out) const;

  Galaxy& galaxy_;
  double light_ = 0;                                        ///< of the galaxy
  std::array<std::vector<Part>, std::size(rounds)> parts_;  ///< by round
  std::size_t most_numbers_ = 0;
  /// Relative error of each component's mean over its first cloud; below 0 before.
  std::vector<double> first_error_;
  std::vector<Larger> larger_;  ///< of each component
};

}  // namespace gamer
