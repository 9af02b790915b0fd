#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "gamer/galaxy/calibration/footprint_table.h"

namespace gamer {

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

/// The closure of a component's hidden dust. With it, dust that rays do not resolve lets through as
/// much light as all of its texture would.
struct DustClosure {
  /// Paths per height of the rays on which the closure is measured.
  static constexpr std::array<double, 3> obliquities = {1, 2.5, 8};
  /// A table for each obliquity. Between them values are linear in ln obliquity.
  using ByObliquity = std::array<FootprintTable, obliquities.size()>;

  /// Variance of the coherent part of the hidden dust, relative to that of its texture's model.
  ByObliquity coherence;
  /// Mean density of the variants with this variance, relative to the texture's expectation at
  /// that footprint.
  ByObliquity amount;
};

/// What is measured of a galaxy before it is rendered, besides what its textures keep.
struct GalaxyCalibration {
  GalaxyCalibration() = default;
  /// The calibration of a galaxy without textures.
  explicit GalaxyCalibration(std::size_t components)
      : means(components),
        log_narrowest(components, 0.0f),
        largest_phi(components, 1.0),
        dust(std::make_shared<const std::vector<DustClosure>>(components)) {}

  /// For each component, the mean of its Phi at a footprint, times the Phi of the component that it
  /// follows. Phi is divided by it, so that <Phi> = 1 for this seed at every footprint.
  std::vector<FootprintTable> means;
  /// For each component, ln of the widest footprint that hides nothing of it.
  std::vector<float> log_narrowest;
  /// For each component that is a field of stars, the largest Phi that counts.
  std::vector<double> largest_phi;
  /// The closure of each component that absorbs. Galaxies of one reference share it.
  std::shared_ptr<const std::vector<DustClosure>> dust;
  /// The footprints for which a reference's closure has been measured.
  FootprintRange closure_range{HUGE_VAL, 0, false};
};

}  // namespace gamer
