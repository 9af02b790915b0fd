#pragma once

#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// The closure of dust at several footprints (DustClosure).
struct DustClosureValues {
  std::vector<double> coherences;  ///< empty if rays meet no dust
  std::vector<double> amounts;
};

/// Ratio of successive footprints at which the closure is measured, and the largest of these
/// footprints.
inline constexpr double closure_footprint_ratio = std::numbers::sqrt3;
inline constexpr double largest_closure_footprint = 1.0 / 9;

/// Whether the closure of a galaxy is measured on fewer rays, since the galaxy has small clouds of
/// points (Galaxy::most_cloud_points()). The light behind the dust then counts as if it were
/// distributed like the dust, and the closure does not depend on other components.
bool is_coarse_closure(const Galaxy& galaxy);

/// The light behind component c, which absorbs, where the rays of measure_dust_closure() meet the
/// plane: [batch].
std::vector<BatchArray> light_behind_dust(const Galaxy& galaxy, std::size_t c);

/// Measures the closure of component c, which absorbs, for rays of one of DustClosure::obliquities
/// and the given widths. `light` is light_behind_dust() of this component. The measurement traces
/// rays through the whole texture and through the texture that each width sees. The variance of the
/// coherent part is chosen so that both transmit equal light. The galaxy's means of textures must
/// have been measured.
DustClosureValues measure_dust_closure(const Galaxy& galaxy, std::size_t c, std::size_t obliquity,
                                       std::span<const double> widths);

}  // namespace gamer
