#pragma once

#include "gamer/core/parameter.h"
#include "gamer/galaxy/sample_batch.h"

namespace gamer {

/// The warp of a layer: its mid-plane is lifted above z = 0 by
///   l(r, phi) = height u^power sin(phi - angle - twist (r - begin)),
///   u = max(r - begin, 0)/(1 - begin).
/// With begin = 0 and power = 1 the layer is tilted by atan(height). Heights z - l replace z. This
/// shear along z keeps volumes and columns along z. Lengths are in galaxy radii, angles in radians.
struct LayerWarp {
  double height = 0;  ///< at the galaxy's edge; 0 for a flat layer
  double begin = 0;
  double power = 2;  ///< at least 1, so that slopes grow with the radius
  double angle = 0;  ///< azimuth of the line of nodes, beside which l grows with the azimuth
  double twist = 0;  ///< per galaxy radius

  bool operator==(const LayerWarp&) const = default;

  bool is_flat() const { return height == 0; }
  /// l at a place of the plane.
  double lift(double x, double y) const;
  /// The largest l at a radius.
  double most(double r) const;
  /// An upper bound of the slope |grad l| within a radius.
  double steepest(double r) const;
  /// l at the radii and azimuths of a batch, with an absolute error below 6e-7 height (1 + power).
  void lift(const SampleBatch& batch, float* out) const;

  static ParameterTable parameters();
  static LayerWarp read(const ParameterSet& values);
};

}  // namespace gamer
