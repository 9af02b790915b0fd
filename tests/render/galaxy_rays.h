#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/job/measure_galaxies.h"
#include "gamer/render/march/sampler.h"
#include "gamer/render/medium.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"
#include "gamer/scene/spectrum.h"
#include "render/measured_scene.h"

namespace gamer {

/// Parallel rays, spread over the image of one galaxy at an inclination (degrees), at three
/// wavelengths. Their footprint is a 512th of the galaxy's diameter.
class GalaxyRays {
 public:
  /// Rays through a shipped galaxy.
  GalaxyRays(const std::filesystem::path& project, const std::string& galaxy, double inclination,
             int rays, int seed = 1)
      : GalaxyRays(Resources({project}),
                   fmt::format("galaxy x y z inclination pa seed\n{} 0 0 0 {} 90 {}\n", galaxy,
                               inclination, seed),
                   inclination, rays) {}
  /// Rays through all galaxies of a scene.
  GalaxyRays(Resources resources, const std::string& scene, double inclination, int rays)
      : inclination_(inclination * std::numbers::pi / 180), rays_(static_cast<std::size_t>(rays)) {
    const ConfigNode root = parse_toml(
        "[image]\nsize = 512\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, 10]\n"
        "up = [0, 1, 0]\nwidth = 2\n[spectrum]\nwavelengths = [4300, 5750, 7400]\n",
        "view.par");
    const RenderParameters parameters = RenderParameters::read(root);
    const Spectrum spectrum = load_spectrum(parameters, resources);
    GalaxyLibrary library(parameters, "scene.lst", resources);
    scene_ = std::make_shared<Scene>(
        read_scene(Catalogue::parse(scene, "scene.lst", CatalogueFormat::list), parameters,
                   spectrum, Camera(parameters), resources, library));
    const auto unmeasured = library.take_unmeasured(*scene_);
    const std::vector<FootprintRange> footprints(unmeasured.size(), {pixel, pixel});
    measure_galaxies(unmeasured, footprints, Ranks(), &measurements());
    for (std::size_t g = 0; g < scene_->galaxies.size(); ++g) {
      galaxies_.push_back(static_cast<int>(g));
    }
    // A spectral node at each wavelength.
    basis_ = std::make_shared<const SpectralBasis>(spectrum, std::vector<SpectralBasis::Probe>{}, 1,
                                                   1e-3);
  }

  /// Brightness of each ray in each plane, by the adaptive sampler.
  std::vector<double> adaptive(double tolerance, RenderCounts& counts) const {
    const Medium medium(scene_, basis_, Accuracy::from_tolerance(tolerance));
    return trace(medium, *make_adaptive_sampler(medium), counts);
  }
  /// Brightness by this number of equal steps through the galaxy's ball.
  std::vector<double> uniform(double steps) const {
    const Medium medium(scene_, basis_, Accuracy::from_tolerance(Accuracy::finest_tolerance));
    RenderCounts counts;
    return trace(medium, *make_uniform_sampler(medium, 2 / steps), counts);
  }

  /// The rms relative error over the rays above 1 % of the brightest, in the worst plane.
  double rms_error(const std::vector<double>& light, const std::vector<double>& exact) const {
    double worst = 0;
    for (std::size_t p = 0; p < basis_->planes(); ++p) {
      double peak = 0, sum = 0, count = 0;
      for (std::size_t i = p; i < exact.size(); i += basis_->planes()) {
        peak = std::max(peak, exact[i]);
      }
      for (std::size_t i = p; i < exact.size(); i += basis_->planes()) {
        if (exact[i] < 0.01 * peak) continue;
        sum += std::pow(light[i] / exact[i] - 1, 2);
        ++count;
      }
      worst = std::max(worst, std::sqrt(sum / count));
    }
    return worst;
  }

 private:
  static constexpr double pixel = 2.0 / 512;  ///< galaxy radii

  std::vector<double> trace(const Medium& medium, const Sampler& sampler,
                            RenderCounts& counts) const {
    constexpr double widest = 0.9, thinnest = 0.1;
    const double height = widest * std::max(std::cos(inclination_), thinnest);
    std::vector<std::vector<Hit>> hits(rays_);
    std::vector<std::span<const Hit>> spans;
    for (std::size_t i = 0; i < rays_; ++i) {
      // An additive sequence, crowded towards the middle.
      const auto next = [&](double step) {
        const double u = 2 * std::fmod(0.5 + static_cast<double>(i + 1) * step, 1.0) - 1;
        return u * std::abs(u);
      };
      const Ray ray{{widest * next(0.7548776662466927), height * next(0.5698402909980532), 10},
                    {0, 0, -1}};
      medium.hits(ray, galaxies_, hits[i]);
      for (Hit& hit : hits[i]) hit.footprint = pixel;
      spans.emplace_back(hits[i]);
    }
    RayLight light;
    sampler.integrate(spans, light, counts);
    const std::size_t planes = basis_->planes();
    std::vector<double> result(rays_ * planes, 0.0);
    for (std::size_t i = 0; i < rays_; ++i) {
      std::size_t at = light.begin[i];
      for (const Hit& hit : spans[i]) {
        for (std::size_t m = 0; m < medium.light_components(hit.galaxy); ++m) {
          medium.add_planes(hit.galaxy, m, light.light.data() + at, false,
                            std::span(result).subspan(i * planes, planes));
          at += medium.nodes();
        }
      }
    }
    return result;
  }

  double inclination_;
  std::size_t rays_;
  std::vector<int> galaxies_;
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const SpectralBasis> basis_;
};

}  // namespace gamer
