#pragma once

#include <algorithm>
#include <cmath>

namespace gamer {

/// All knobs that trade accuracy for time, and the errors that they control. The values of
/// from_tolerance() keep the rms relative error over pixels above 1 % of an image's peak below the
/// tolerance. tests/render/tolerance_test.cc measures this error.
struct Accuracy {
  /// Largest relative change of a ray's intensity when every second node is left out. Controls the
  /// quadrature's error, which is smaller, since all nodes are used.
  double ray_error;
  /// Error of the optical depth in front of a star, relative to the star's light. The errors of
  /// stars do not average out.
  double star_error;
  /// Distance of a ray's first nodes, in units of the structure that they must find. Controls the
  /// light of missed features, which are too rare for error estimates.
  double first_step;
  /// Factor on ray_error and on the distance of first nodes where many rays make a pixel, since
  /// their errors average out.
  double shared_error;
  double shared_step;
  /// Values in place of shared_error and shared_step, for rays that meet only galaxies whose own
  /// rays fix their flux. The errors of rays average out over a whole galaxy.
  double fixed_flux_error;
  double fixed_flux_step;
  /// Further factor on ray_error in galaxies of fixed flux that at most 64 pixels cross
  /// (fixed_error()). Each pixel of such a galaxy has many rays.
  double small_galaxy_error;
  /// Layers end where their envelope is exp(log_envelope_threshold) times its largest value.
  /// Controls the light lost outside.
  double log_envelope_threshold;
  /// A texture is replaced by its mean where its component's envelope, relative to its largest
  /// value and times sqrt(<Phi^2>), is below this value. Controls the texture lost at a disk's
  /// faint edges.
  double texture_threshold;
  /// The faint limit of a ray, as a share of the face-on central brightness of its brightest
  /// galaxy. Fainter rays must meet ray_error only relative to this limit.
  double faint_share;
  /// A cell of a pixel has one ray (midpoint rule) if it is smaller than ray_size times the length
  /// over which the brightness changes. A cell has four rays (2 x 2 Gauss rule) if it is smaller
  /// than cell_size times this length. Larger cells are cut. Both control a pixel's mean over its
  /// area.
  double ray_size;
  double cell_size;
  /// The widest footprint of rays that see a galaxy from outside, galaxy radii. All rays in larger
  /// pixels have this footprint, since the light of a texture adds up only if all rays resolve it
  /// equally. Controls a galaxy's flux, which depends on the overlap of resolved clumps of light
  /// and dust.
  double widest_footprint;
  /// Smallest distance of rays that noise and arms need, in units of widest_footprint. Controls the
  /// light of clumps that rays would miss or count twice.
  double ray_spacing;
  /// Brightness, as a share of a component's peak, below which rays are farther apart. The second
  /// value is for galaxies of fixed flux. Controls the light of faint outskirts.
  double faint_brightness, fixed_flux_faint_brightness;
  /// Largest factor on the distance of rays below faint_brightness, in galaxies whose flux is not
  /// fixed.
  double faint_spacing;
  /// Smallest distance of rays that an edge needs, in units of widest_footprint. Controls the light
  /// at the edges of bars.
  double edge_spacing;
  /// Largest factor on the distance of rays in a galaxy whose flux is fixed by its own rays
  /// (fixed_spacing()). The factor's square root multiplies ray_size and cell_size. Controls pixels
  /// and colours.
  double fixed_flux_spacing;
  /// Largest share of a pixel's light that the dust of layers (GalaxyLayer) takes from layers
  /// behind. Light behind is dimmed by the pixel's mean, as if it had the spectrum of the layer in
  /// front. The error is some per cent of what the dust takes. Where dust takes more, rays go
  /// through all galaxies together.
  double most_dimmed;
  /// Relative error of a texture's mean over a galaxy, as if its sample points were independent.
  /// The points are spread evenly, so their error is up to four times smaller. Controls a galaxy's
  /// flux. Faint components and closures may have a larger error (docs/method.md, "Larger clouds").
  double mean_error;
  /// Whether all seeds of a galaxy's file share one closure of hidden dust. A new seed is then
  /// cheap, but its flux differs by chance from the flux with its own closure. Images with a grid
  /// of rays never share closures, since their pixels hide equally much dust at every tolerance.
  bool shares_closure;

  /// The knobs for the light of a whole galaxy, to which many rays contribute, so that their
  /// errors average out. Rays are `distance` times as far apart, and have fewer first nodes.
  Accuracy for_sums(double distance) const {
    Accuracy result = *this;
    result.first_step *= std::sqrt(shared_step);
    result.ray_spacing *= distance;
    result.edge_spacing *= distance;
    return result;
  }

  /// Factor on the distance of rays in a galaxy of fixed flux. `pixel` is the width of a pixel,
  /// galaxy radii. Where more than 128 pixels cross the galaxy, the factor falls with the square of
  /// the pixel's width. From 256 pixels on it is 1.
  double fixed_spacing(double pixel) const {
    constexpr double most_pixels = 64;  // of a radius
    const double coarse = most_pixels * pixel;
    return std::clamp(fixed_flux_spacing * coarse * coarse, 1.0, fixed_flux_spacing);
  }

  /// Factor on ray_error in a galaxy of fixed flux. `pixel` is the width of a pixel, galaxy radii.
  /// Where more than 64 pixels cross the galaxy, small_galaxy_error falls with the fifth power of
  /// the pixel's width, to 1 at 128 pixels.
  double fixed_error(double pixel) const { return fixed_flux_error * small_error(pixel); }
  /// Factor on the distance of first nodes in a galaxy of fixed flux. A factor of 4 on errors
  /// corresponds to 1.5 on distances.
  double fixed_step(double pixel) const {
    return fixed_flux_step * std::pow(small_error(pixel), 0.29);
  }

  /// The smallest tolerance that densities of single precision allow. Smaller values count as this
  /// one.
  static constexpr double finest_tolerance = 3e-6;

  /// The knobs for a tolerance. Above 1e-4 ray_error grows faster than the tolerance, up to a
  /// limit: the error of few nodes is a smaller share of the change that ray_error limits
  /// (bench/ray_error_bench).
  /// star_error is smaller, since errors of stars do not average out. first_step changes little
  /// up to 1e-2, since the light of missed features grows with a high power of it. The error of the
  /// midpoint rule grows with the square of ray_size, and that of Gauss' rule with the fourth power
  /// of cell_size.
  static Accuracy from_tolerance(double tolerance) {
    const double t = std::max(tolerance, finest_tolerance);
    const double coarser = std::max(t / 1e-4, 1.0);
    // Rays and means take most of the time for many small galaxies.
    const double rough = std::clamp(t / 1e-3, 1.0, 10.0);
    const double fine = std::min(t / 1e-3, 1.0);
    const double glance = std::max(t / 1e-2, 1.0);
    return {.ray_error = std::min({1.35 * t * std::pow(coarser, 0.3), 3 * t, 0.1}),
            .star_error = std::min(0.15 * t * std::pow(coarser, 0.35), 0.025),
            .first_step = 0.7 * std::pow(t / 1e-3, 0.08) * std::pow(glance, 0.3),
            .shared_error = 2 * std::pow(rough, 0.3),
            .shared_step = 1.5,
            .fixed_flux_error = 16 * std::pow(rough, -0.6),
            .fixed_flux_step = 2 * std::pow(rough, -0.125),
            .small_galaxy_error = std::max(32 * std::pow(fine, 2.5), 1.0),
            .log_envelope_threshold = std::log(0.003 * t),
            .texture_threshold = 0.01 * t,
            .faint_share = 0.01,
            .ray_size = 0.06 * std::sqrt(t / 1e-3) * std::pow(rough, 0.15),
            .cell_size = 0.5 * std::pow(t / 1e-3, 0.25) * std::pow(rough, 0.3),
            .widest_footprint = std::sqrt(t / 1e-3) / 160,
            .ray_spacing = 0.8 * std::pow(rough, 0.2),
            .faint_brightness = 0.25 * std::log10(rough),
            .fixed_flux_faint_brightness = 0.04 * std::pow(fine, 1.5) * std::pow(rough, 0.8),
            .faint_spacing = std::pow(rough, 0.6),
            .edge_spacing = 0.8 * std::pow(rough, 0.2) * std::log10(rough),
            .fixed_flux_spacing = std::max(4 * std::pow(std::min(t / 1e-3, 1e-3 / t), 0.3), 1.0),
            .most_dimmed = std::min(0.003 * std::pow(t / 1e-3, 1.5), 1.0),
            .mean_error = 0.003 * std::pow(rough, 0.3),
            .shares_closure = t > 3e-3};
  }

 private:
  double small_error(double pixel) const {
    constexpr double most_pixels = 32;  // of a radius
    const double coarse = most_pixels * pixel;
    return std::clamp(small_galaxy_error * std::pow(coarse, 5), 1.0, small_galaxy_error);
  }
};

}  // namespace gamer
