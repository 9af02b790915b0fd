#pragma once

#include <cmath>
#include <numbers>

#include "gamer/galaxy/kinds/radial_law.h"

namespace gamer {

/// A RadialLaw for kernels, whose logarithms have base 2.
struct RadialConstants {
  RadialConstants() = default;
  RadialConstants(double rh, const RadialShape& shape)
      : is_round(shape.is_round()),
        is_ring(shape.is_ring()),
        is_broken(shape.is_broken()),
        slope(static_cast<float>(-1 / rh / std::numbers::ln2)),
        radius(static_cast<float>(shape.is_ring() ? shape.ring_radius : shape.break_radius)),
        inner_rate(static_cast<float>(1 / shape.ring_width)),
        outer_rate(static_cast<float>(1 / shape.ring_outer_width)),
        sharpness(static_cast<float>(shape.break_sharpness)),
        inverse_axis_ratio(static_cast<float>(1 / shape.axis_ratio)),
        position_angle(static_cast<float>(shape.position_angle)) {
    const double s = shape.break_sharpness;
    const double factor = (1 / rh - 1 / shape.outer_rh) / s / std::numbers::ln2;
    change = static_cast<float>(factor);
    start = static_cast<float>(-factor * std::log1p(std::exp(-s * shape.break_radius)));
  }

  bool is_round = true, is_ring = false, is_broken = false;
  float slope = 0;   ///< -1/(rh ln 2)
  float radius = 0;  ///< of the ring or the break
  float inner_rate = 0, outer_rate = 0;
  float sharpness = 0;
  float change = 0;  ///< (1/rh - 1/rh_o)/(s ln 2)
  float start = 0;   ///< `change` times -ln(1 + e^(-s b))
  float inverse_axis_ratio = 1, position_angle = 0;
};

}  // namespace gamer
