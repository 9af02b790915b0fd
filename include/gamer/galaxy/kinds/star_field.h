#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "gamer/core/random.h"
#include "gamer/galaxy/kinds/layer.h"
#include "gamer/galaxy/star_clumps.h"
#include "gamer/galaxy/star_colours.h"
#include "gamer/galaxy/stellar_population.h"

namespace gamer {

/// A layer of stars. Their number density is
///   n = number envelope Phi / int envelope dV,
/// and a StellarPopulation gives their luminosities and colours. The component's light is the sum
/// of its stars, and its spectrum is their mean. A star is a function of (seed, class of
/// luminosity, cell of space). No star is stored, but its place, luminosity and temperature never
/// change.
///
/// For each class the cube [-1, 1]^3 is halved along all axes until an upper bound of the density
/// in a cell gives few stars. The smallest cells get a Poisson number of uniformly placed
/// candidates, whose mean is the bound times the cell's volume. A candidate is a star where
/// envelope Phi exceeds a uniform random share of the bound (thinning: Lewis & Shedler 1979). Stars
/// thus follow the density within cells too, and cells leave no trace. The stars of a field that
/// follows associations lie in their clumps (StarClumps), which take the place of cells.
class StarField : public Layer {
 public:
  /// With `has_colours` stars differ in colour even if the component is given an SED (StarColours).
  /// `twin` is a star field with equal parameters, but for the seed, or null.
  StarField(const LayerShape& shape, const ArmPattern& arms, StellarPopulation population,
            double number, bool has_colours, std::uint64_t seed, const StarField* twin = nullptr);

  double envelope_integral() const override { return envelope_integral_; }
  bool depends_on_seed() const override { return true; }
  const StarField* star_field() const override { return this; }
  bool gather_in_clumps(const Component& associations) override;
  bool has_texture_mean() const override { return is_in_clumps_; }
  std::vector<double> texture_means(std::span<const double> widths, double error,
                                    std::size_t most_points) const override;
  /// Whether the stars lie in the clumps of associations whose layer equals this one.
  bool shares_layer() const { return shares_layer_; }
  /// The clumps in which all stars lie, or null. They are made on the first call.
  const StarClumps* clumps() const;

  const StellarPopulation& population() const { return population_; }
  /// Number of stars in the galaxy.
  double number() const { return number_; }
  /// Whether all stars have the spectrum sed().
  bool has_one_sed() const { return has_given_sed() && !has_colours_; }
  /// The spectrum of stars with the temperatures of `blackbodies`, one blackbody or a mixture. It
  /// is the blackbodies' own unless the component is given an SED.
  std::shared_ptr<const Sed> spectrum(std::shared_ptr<const Sed> blackbodies) const {
    return has_given_sed() ? colours_.spectrum(sed_, std::move(blackbodies)) : blackbodies;
  }
  /// Stars per (galaxy radii of the ball frame)^3 where envelope Phi is 1.
  double density() const { return number_ / envelope_integral_; }
  /// The light of one unit of luminosity, in the emissivity's unit times galaxy radii^3, where the
  /// component's light is `light` (Galaxy::luminosity()).
  double unit_luminosity(double light) const {
    return light / (number_ * population_.mean_luminosity());
  }

  struct Cell {
    double centre[3];
    double half;  ///< half of its side
    int level;
    std::uint64_t key;
  };
  struct Candidate {
    double position[3];
    /// The candidate is a star where envelope Phi exceeds this value. In clumps
    /// StarClumps::evaluate() must exceed it.
    double threshold;
    std::uint64_t key;
    std::uint32_t clump = 0;  ///< index of the candidate's clump
  };
  struct Star {
    double luminosity;
    double temperature;
  };

  /// Calls take(candidate) for all candidates of class k, cell by cell in a fixed order. Cells for
  /// which keep(cell) is false are skipped with their contents. Phi above `largest_phi`
  /// (Galaxy::largest_phi()) counts as `largest_phi`. In clumps, boxes take the place of cells.
  template <class Keep, class Take>
  void walk(std::size_t k, double largest_phi, const Keep& keep, const Take& take) const {
    if (const StarClumps* const places = clumps()) {
      const auto keep_box = [&](const StarClumps::Box& box) {
        return keep(Cell{{box.centre[0], box.centre[1], box.centre[2]}, box.half, 0, 0});
      };
      const auto take_star = [&](const StarClumps::Candidate& star) {
        take(Candidate{{star.position[0], star.position[1], star.position[2]},
                       star.threshold,
                       star.key,
                       star.clump});
      };
      return places->walk(hash_words({key(), k}),
                          density() * population_.at(k).number * largest_phi, keep_box, take_star);
    }
    descend({{0, 0, 0}, 1, 0, hash_words({key(), k})},
            density() * population_.at(k).number * largest_phi, largest_phi, keep, take);
  }
  /// Luminosity of a candidate of class k, if it is a star.
  double luminosity(std::size_t k, const Candidate& candidate) const;
  /// An upper bound of luminosity(), cheaper to compute.
  double luminosity_bound(std::size_t k, const Candidate& candidate) const;
  double temperature(double luminosity, const Candidate& candidate) const;

  /// An upper bound of the envelope in the cell.
  double bound(const Cell& cell) const;

 private:
  static constexpr int deepest = 48;
  // Largest expected number of candidates in a cell. A larger number leaves larger cells with
  // looser bounds. Another value moves all stars.
  static constexpr double most_candidates = 16;

  bool has_given_sed() const { return sed_ != mean_sed_; }
  std::uint64_t key() const;
  template <class Keep, class Take>
  void descend(const Cell& cell, double density, double largest_phi, const Keep& keep,
               const Take& take) const;
  template <class Take>
  void fill(const Cell& cell, double expected, double bound, const Take& take) const;
  /// The share of the stars of the candidate's class that are fainter than it.
  static double luminosity_share(const Candidate& candidate);
  /// A Poisson variate by inversion.
  static int poisson(double mean, double u);

  StellarPopulation population_;
  double number_;
  std::uint64_t seed_;
  bool has_colours_;
  std::shared_ptr<const Sed> mean_sed_;  ///< of the blackbodies
  StarColours colours_;
  double envelope_integral_;
  bool is_in_clumps_ = false;
  bool shares_layer_ = false;
  mutable std::once_flag has_clumps_;
  mutable std::unique_ptr<const StarClumps> clumps_;
};

template <class Keep, class Take>
void StarField::descend(const Cell& cell, double density, double largest_phi, const Keep& keep,
                        const Take& take) const {
  const double largest = bound(cell);
  if (!(largest > 0) || !keep(cell)) return;
  const double side = 2 * cell.half;
  const double expected = density * largest * side * side * side;
  if (expected <= most_candidates || cell.level == deepest) {
    fill(cell, expected, largest * largest_phi, take);
    return;
  }
  const double half = 0.5 * cell.half;
  for (std::uint64_t octant = 0; octant < 8; ++octant) {
    Cell part{{}, half, cell.level + 1, mix64(cell.key + (octant + 1) * golden_gamma)};
    for (int axis = 0; axis < 3; ++axis) {
      part.centre[axis] = cell.centre[axis] + ((octant >> axis) & 1 ? half : -half);
    }
    descend(part, density, largest_phi, keep, take);
  }
}

template <class Take>
void StarField::fill(const Cell& cell, double expected, double bound, const Take& take) const {
  constexpr std::uint64_t count_word = 9;  // a word that the octants do not use
  const int count = poisson(expected, to_unit(mix64(cell.key + count_word * golden_gamma)));
  const auto spread = [&](std::uint64_t bits) {
    return cell.half * (static_cast<double>(bits) * 0x1p-31 - 1);
  };
  for (int i = 0; i < count; ++i) {
    Candidate candidate;
    candidate.key =
        mix64(cell.key + (count_word + 1 + static_cast<std::uint64_t>(i)) * golden_gamma);
    const std::uint64_t a = mix64(candidate.key + golden_gamma);
    const std::uint64_t b = mix64(candidate.key + 2 * golden_gamma);
    candidate.position[0] = cell.centre[0] + spread(a >> 32);
    candidate.position[1] = cell.centre[1] + spread(a & 0xffffffffu);
    candidate.position[2] = cell.centre[2] + spread(b >> 32);
    candidate.threshold = bound * static_cast<double>(b & 0xffffffffu) * 0x1p-32;
    take(candidate);
  }
}

}  // namespace gamer
