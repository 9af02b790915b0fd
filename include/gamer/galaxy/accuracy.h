#pragma once

#include <algorithm>
#include <cmath>

namespace gamer {

/// Every knob that trades accuracy for time, and the error that it controls. The defaults of
/// from_tolerance() together keep the rms relative error over the pixels above 1 % of an image's
/// peak below the tolerance (tests/render/tolerance_test.cc measures it).
struct Accuracy {
  /// Share of a ray's intensity that the error estimates of its panels may reach, added in
  /// quadrature. Controls the quadrature's error.
  double panel_error = 0.12e-3;
  /// A texture counts as its mean where its component's envelope, relative to its largest value
  /// and times sqrt(<Phi^2>), is below this. Controls the texture lost at a disk's faint edges.
  double texture_threshold = 0.8e-5;
  /// Length of the first panels relative to the structure that they must not step over. Controls
  /// the features that no sample finds: too rare to show in the error estimates.
  double first_step = 1.2;
  /// Rays fainter than this share of the face-on centre of the brightest galaxy on them need not
  /// meet panel_error relatively, only in units of that share.
  double faint_share = 0.01;

  /// Densities are single precision: smaller tolerances count as this one.
  static constexpr double finest_tolerance = 1e-6;

  /// The features missed fall with a high power of the first step, hence the small one here.
  static Accuracy from_tolerance(double tolerance) {
    Accuracy accuracy;
    tolerance = std::max(tolerance, finest_tolerance);
    accuracy.panel_error = 0.12 * tolerance;
    accuracy.texture_threshold = 0.008 * tolerance;
    accuracy.first_step = 1.2 * std::pow(tolerance / 1e-3, 0.2);
    return accuracy;
  }
};

}  // namespace gamer
