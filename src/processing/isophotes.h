#pragma once

#include <optional>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/plane.h"

namespace gamer {

/// An ellipse of one brightness.
struct Isophote {
  double radius = 0;  ///< semi-major axis, pixels
  double axis_ratio = 1;
  double angle = 0;        ///< of the major axis, rad from +x towards +y, [0, pi[
  bool is_fitted = false;  ///< false where the shape is given or taken from the neighbour
  double brightness = 0;   ///< mean on the ellipse, per pixel
  double error =
      0;  ///< of brightness: standard deviation there over the root of the length in 1.5 pixels
  double flux = 0;  ///< sum of the pixels inside, with exact fractions
};

struct IsophoteOptions {
  double x = 0, y = 0;                           ///< centre, from 0
  double inner = 1, outer = 2;                   ///< semi-major axes, pixels
  double step = 0.1;                             ///< each axis is 1 + step times the one before
  std::optional<double> axis_ratio, angle;       ///< shapes that are not fitted
  double start_axis_ratio = 1, start_angle = 0;  ///< shape with which the fit begins
  int threads = 1;
};

/// Isophotes of growing semi-major axis a about one centre (Jedrzejewski 1987, MNRAS 226, 747). The
/// brightness on an ellipse,
///   I(E) = I0 + ... + A2 sin 2E + B2 cos 2E,
/// E the eccentric anomaly, has no second harmonic where the ellipse is an isophote. The shape is g
/// exp(2 i angle), g = (1 - q)/(1 + q), q the axis ratio. To first order its correction is -4 q (B2
/// + i A2)/(a I' (1 + q)^2) in the ellipse's own frame, I' the gradient along the major axis. The
/// correction is repeated until it is below 1e-4. The fit begins at the geometric middle of the
/// range and goes outwards, then inwards, each from the shape of its neighbour. Where the gradient
/// is not significant, or there is no convergence in 50 steps, the neighbour's shape stays. The
/// brightness is the mean over a quarter of a step to both sides. The list ends where an ellipse
/// leaves the image or its brightness is below its error.
std::vector<Isophote> isophotes(const Image& image, const IsophoteOptions& options);

/// The brightness of another image on given isophotes, with error and flux.
std::vector<Isophote> on_isophotes(const Image& image, const IsophoteOptions& options,
                                   std::vector<Isophote> shapes);

}  // namespace gamer
