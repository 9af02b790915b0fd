#pragma once

#include <algorithm>
#include <cmath>

namespace gamer {

/// Every knob that trades accuracy for time, and the error that it controls. The defaults of
/// from_tolerance() together keep the rms relative error over the pixels above 1 % of an image's
/// peak below the tolerance (tests/render/tolerance_test.cc measures it).
struct Accuracy {
  /// Share by which a ray's intensity may change when every second node is left out. Controls the
  /// quadrature's error, which is smaller since it is that of all nodes.
  double ray_error;
  /// Error of the optical depth in front of a star, relative to the star's light. No neighbours
  /// make up for the error of a star.
  double star_error;
  /// Distance of a ray's first nodes, in units of the structure that they must not step over.
  /// Controls the light of features that no node finds. They are too rare to show in error
  /// estimates.
  double first_step;
  /// Where many rays make a pixel, each may err by so many times ray_error, and its first nodes may
  /// be so many times further apart. The errors of such rays average out.
  double shared_error;
  double shared_step;
  /// Layers are followed to where their envelope is exp(this) times its largest value. Controls the
  /// light lost beyond.
  double log_envelope_threshold;
  /// A texture counts as its mean where its component's envelope, relative to its largest value
  /// and times sqrt(<Phi^2>), is below this. Controls the texture lost at a disk's faint edges.
  double texture_threshold;
  /// Rays fainter than this share of the face-on centre of the brightest galaxy on them need not
  /// meet ray_error relatively, only in units of that share.
  double faint_share;
  /// A cell of a pixel has one ray (midpoint rule) if it is smaller than ray_size times the length
  /// over which the brightness changes. It has four (2 x 2 Gauss rule) if it is smaller than
  /// cell_size times that length. Larger cells are cut. Both control a pixel's mean over its area.
  double ray_size;
  double cell_size;
  /// The widest footprint of rays that see a galaxy from outside, galaxy radii. All rays in larger
  /// pixels have it, since the light of a texture adds up only if all see equally much of it.
  /// Controls a galaxy's flux: which clumps of light and dust cover each other shows only where
  /// they are seen.
  double widest_footprint;
  /// Largest distance of rays where there is a texture, in footprints. Controls the light of clumps
  /// that rays would miss or count twice.
  double ray_spacing;
  /// Relative error of a texture's mean over a galaxy, if the points that it is taken over were
  /// independent. The points are spread evenly, and their error is up to four times smaller.
  /// Controls a galaxy's flux.
  double mean_error;
  /// Whether all seeds of a galaxy's file share one closure of hidden dust. A new seed is then
  /// cheap, but its flux differs by chance from that with a closure of its own. Images with a grid
  /// of rays never share closures, since their pixels hide as much at every tolerance.
  bool shares_closure;

  /// Densities are single precision: smaller tolerances count as this one.
  static constexpr double finest_tolerance = 3e-6;

  /// The quadrature's error is a smaller part of its change where nodes are few, hence the power of
  /// ray_error (bench/ray_error_bench). A star's dust has no neighbours that make up for its error,
  /// hence the smaller star_error. The features missed fall with a high power of
  /// the first step, hence the small one here; the error of the midpoint rule with the second power
  /// of the size, that of Gauss' with the fourth.
  static Accuracy from_tolerance(double tolerance) {
    const double t = std::max(tolerance, finest_tolerance);
    const double coarser = std::max(t / 1e-4, 1.0);
    // Means take longest where galaxies are small and many.
    const double rough = std::clamp(t / 1e-3, 1.0, 10.0);
    return {.ray_error = std::min({1.35 * t * std::pow(coarser, 0.3), 3 * t, 0.1}),
            .star_error = std::min(0.15 * t * std::pow(coarser, 0.35), 0.025),
            .first_step = 0.7 * std::pow(t / 1e-3, 0.08),
            .shared_error = 2,
            .shared_step = 1.5,
            .log_envelope_threshold = std::log(0.003 * t),
            .texture_threshold = 0.01 * t,
            .faint_share = 0.01,
            .ray_size = 0.06 * std::sqrt(t / 1e-3),
            .cell_size = 0.5 * std::pow(t / 1e-3, 0.25),
            .widest_footprint = std::sqrt(t / 1e-3) / 160,
            .ray_spacing = 0.8,
            .mean_error = 0.003 * std::pow(rough, 0.6),
            .shares_closure = t > 3e-3};
  }
};

}  // namespace gamer
