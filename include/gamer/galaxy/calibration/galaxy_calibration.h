#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "gamer/galaxy/calibration/footprint_table.h"

namespace gamer {

/// The range of footprints of rays that see a galaxy, galaxy radii. The default is all footprints.
struct FootprintRange {
  double narrowest = 0;
  double widest = HUGE_VAL;
  /// Whether something resolves the whole texture, as the light of drawn stars does. Means of faint
  /// components are then more exact.
  bool sees_whole = false;
  /// Whether the mean of Phi over components that emit is needed. This mean is superfluous where
  /// all rays of the galaxy together fix its light (PlacedGalaxy::light_factors). Where this mean
  /// is not needed, scales of textures are those of the galaxy's reference.
  bool needs_light_means = true;

  bool covers(const FootprintRange& other) const {
    return narrowest <= other.narrowest && other.widest <= widest &&
           (needs_light_means || !other.needs_light_means);
  }
  /// The smallest range that holds both ranges.
  FootprintRange operator|(const FootprintRange& other) const {
    return {std::min(narrowest, other.narrowest), std::max(widest, other.widest),
            sees_whole || other.sees_whole, needs_light_means || other.needs_light_means};
  }
};

/// The closure of a component's hidden dust. With the closure, unresolved dust transmits the light
/// that the resolved texture would transmit.
struct DustClosure {
  /// Paths per height of the rays on which the closure is measured.
  static constexpr std::array<double, 3> obliquities = {1, 2.5, 8};
  /// A table for each obliquity. Between them values are linear in ln obliquity.
  using ByObliquity = std::array<FootprintTable, obliquities.size()>;

  /// Variance of the coherent part of the hidden dust, relative to that of its texture's model.
  ByObliquity coherence;
  /// Mean density of the variants with this variance, relative to the texture's expectation at the
  /// footprint.
  ByObliquity amount;
};

/// Measurements of a galaxy before it is rendered, besides those stored in its textures.
struct GalaxyCalibration {
  GalaxyCalibration() = default;
  /// The calibration of a galaxy without textures.
  explicit GalaxyCalibration(std::size_t components)
      : means(components),
        log_narrowest(components, 0.0f),
        largest_phi(components, 1.0),
        dust(std::make_shared<const std::vector<DustClosure>>(components)) {}

  /// For each component, the mean of its Phi (times the Phi of the component that it follows), by
  /// footprint. Phi is divided by this mean, so that <Phi> = 1 for this seed at every footprint.
  std::vector<FootprintTable> means;
  /// For each component, ln of the widest footprint that resolves its whole texture.
  std::vector<float> log_narrowest;
  /// For each star field, the largest value of Phi that is used.
  std::vector<double> largest_phi;
  /// The closure of each component that absorbs. Galaxies of one reference share it.
  std::shared_ptr<const std::vector<DustClosure>> dust;
  /// The footprints for which a reference's closure has been measured.
  FootprintRange closure_range{HUGE_VAL, 0, false, false};
};

}  // namespace gamer
