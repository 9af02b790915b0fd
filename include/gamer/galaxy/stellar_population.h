#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gamer/core/parameter.h"
#include "gamer/core/resources.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// A population of stars: the distribution of their luminosities, and their colours.
///
/// L is the luminosity at 5500 Angstrom (f_lambda), in the user's units, such as the Sun's
/// luminosity.
///   dN/dL ~ L^-slope on [low, high], or dN/dlnL of a table, a power law between its rows.
///   T = temperature L^temperature_slope 10^(scatter g), or the table's (a power law between its
///   rows) in place of the first two factors; T is kept within [1000, 100000] K.
/// g is the sum of three uniform numbers, scaled to mean 0 and variance 1: almost normal, never
/// beyond 3. A star shines as a blackbody. Spectra are mixtures of the two neighbours in a grid of
/// temperatures 2 % apart, so that a population's spectrum is a sum over the grid.
///
/// Classes are intervals of luminosity with a ratio of at most 2.
class StellarPopulation {
 public:
  /// Stars of luminosities [low, high], dN/dlnL ~ L^index.
  struct Class {
    double low, high;
    double index;
    double number;  ///< share of all stars
    double light;   ///< share of all light

    static constexpr std::size_t step_count = 32;
    /// The luminosity, rounded up, below which a share (i + 1)/step_count of the class' stars lies.
    std::array<double, step_count> steps;
  };

  /// Values of parameters(). A file of luminosities has rows of two or three columns: luminosity
  /// (ascending), dN/dlnL in any unit, and temperature, K; '#' begins comments. Throws InputError
  /// if values or rows are wrong.
  StellarPopulation(const ParameterSet& values, const std::string& context, Resources& resources);
  /// Whether parameters() give the luminosity function as a formula and not as a file.
  static bool is_formula(const ParameterSet& values);
  /// Declarations of `luminosity_function` ... `temperature_scatter`.
  static ParameterTable parameters();

  std::size_t size() const { return classes_.size(); }
  const Class& at(std::size_t k) const { return classes_[k]; }
  double mean_luminosity() const { return mean_luminosity_; }
  /// Share of the stars that are brighter.
  double number_above(double luminosity) const;
  /// The luminosity below which a share u of the stars of class k lies.
  double luminosity(std::size_t k, double u) const;
  /// An upper bound of luminosity(), from a table of each class.
  double luminosity_bound(std::size_t k, double u) const {
    return classes_[k].steps[static_cast<std::size_t>(u * Class::step_count)];
  }
  /// Temperature of a star of this luminosity, K. u1 to u3 are uniform in [0, 1[.
  double temperature(double luminosity, double u1, double u2, double u3) const;

  /// Whether the luminosity function's file gives temperatures.
  bool has_temperatures() const { return !log_temperatures_.empty(); }
  /// Temperatures of the grid (K) that the population needs.
  const std::vector<double>& grid() const { return grid_; }
  /// The place of a temperature on the grid: T is a mixture of (1 - share) of grid()[first] and
  /// `share` of the next.
  struct GridPlace {
    std::size_t first;
    double share;
  };
  GridPlace place(double temperature) const;

  /// The mean of share(luminosity), weighted with the light. If `spectrum` is not null, it gets the
  /// contribution of each grid temperature to this mean.
  double light(const std::function<double(double luminosity)>& share,
               std::vector<double>* spectrum = nullptr) const;
  /// The spectrum of light with these parts of the grid's temperatures; if all parts are 0, the
  /// spectrum of all light.
  std::shared_ptr<const Sed> sed(const std::vector<double>& spectrum) const;
  std::shared_ptr<const Sed> sed() const;

 private:
  /// One luminosity that represents a part of a class.
  struct Node {
    double luminosity;
    double light;
  };
  void read_table(const ParameterSet& values, const std::string& context, Resources& resources);
  void add_segment(double low, double high, double index, double number_at_low);
  double mean_temperature(double luminosity) const;
  void make_grid();

  std::vector<Class> classes_;
  std::vector<Node> nodes_;
  double mean_luminosity_ = 1;
  double temperature_ = 5800;
  double temperature_slope_ = 0;
  double scatter_ = 0;
  std::vector<double> log_luminosities_, log_temperatures_;  ///< values of a table
  std::vector<double> grid_;
};

}  // namespace gamer
