#include "gamer/job/warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>

#include "gamer/render/march/sampler.h"
#include "gamer/scene/galaxy_library.h"

namespace gamer {
namespace {

/// Wavelengths below this are ultraviolet in Angstrom, but optical in nanometres.
constexpr double likely_nanometres = 1500;
/// Largest number of rays that look for galaxies, and of tests of a ray with a galaxy.
constexpr double most_rays = 65536, most_tests = 1e8;

/// Whether light of some component is seen in some plane.
struct Lamps {
  bool are_there = false;
  bool are_seen = false;
};
Lamps find_lamps(const RenderJob& job) {
  Lamps lamps;
  for (const PlacedGalaxy& placed : job.scene->galaxies) {
    for (const auto& component : placed.galaxy->components()) {
      const Sed* sed = component->sed();
      if (sed == nullptr) continue;
      lamps.are_there = true;
      for (const SpectralPlane& plane : job.spectrum.planes) {
        lamps.are_seen = plane.flux(*sed, placed.redshift, job.spectrum.igm) > 0;
        if (lamps.are_seen) return lamps;
      }
    }
  }
  return lamps;
}

bool meets(const Ray& ray, const PlacedGalaxy& placed) {
  const glm::dvec3 to_centre = placed.centre - ray.origin;
  const double along = glm::dot(to_centre, ray.direction) / glm::length(ray.direction);
  const double distance2 = glm::dot(to_centre, to_centre), radius = placed.bounding_radius;
  if (distance2 <= radius * radius) return true;
  return along > 0 && distance2 - along * along <= radius * radius;
}

/// Whether the window shows the centre of a galaxy, or a ray of a grid meets a galaxy.
bool is_in_view(const Camera& camera, const std::vector<PlacedGalaxy>& galaxies) {
  const ImageRegion& window = camera.window();
  for (const PlacedGalaxy& placed : galaxies) {
    const std::optional<glm::dvec2> pixel = camera.pixel(placed.centre);
    if (pixel && pixel->x > window.left - 0.5 && pixel->x < window.right() - 0.5 &&
        pixel->y > window.bottom - 0.5 && pixel->y < window.top() - 0.5) {
      return true;
    }
  }
  const double rays = std::clamp(most_tests / static_cast<double>(galaxies.size()), 1.0, most_rays);
  const double pixels = static_cast<double>(window.width) * window.height;
  const int stride = static_cast<int>(std::ceil(std::sqrt(std::max(1.0, pixels / rays))));
  for (int y = window.bottom; y < window.top(); y += stride) {
    for (int x = window.left; x < window.right(); x += stride) {
      const std::optional<Ray> ray = camera.ray(x, y);
      if (!ray) continue;
      for (const PlacedGalaxy& placed : galaxies) {
        if (meets(*ray, placed)) return true;
      }
    }
  }
  return false;
}

std::string triple(const glm::dvec3& v) { return fmt::format("[{:g}, {:g}, {:g}]", v.x, v.y, v.z); }

std::string out_of_view(const RenderJob& job) {
  const Camera& camera = job.camera;
  const std::vector<PlacedGalaxy>& galaxies = job.scene->galaxies;
  if (camera.projection() == Projection::sky) return "no galaxy reaches into the image";
  const auto nearest =
      std::ranges::min_element(galaxies, [&](const PlacedGalaxy& a, const PlacedGalaxy& b) {
        return glm::distance(a.centre, camera.origin()) < glm::distance(b.centre, camera.origin());
      });
  return fmt::format(
      "no galaxy is in view: the camera at {} looks along {}, and the nearest galaxy, '{}', stands "
      "at {} with the radius {:g}",
      triple(camera.origin()), triple(0.0 - camera.back()), nearest->type.str(),
      triple(nearest->centre), nearest->bounding_radius);
}

std::string unseen_wavelengths(const RenderJob& job) {
  double longest = 0;
  std::string planes;
  for (const SpectralPlane& plane : job.spectrum.planes) {
    longest = std::max(longest, plane.range().high);
    planes += (planes.empty() ? "" : ", ") + plane.label;
  }
  std::string text = fmt::format("no spectrum of the scene shines at {}", planes);
  if (longest < likely_nanometres && job.spectrum.planes.front().band == nullptr) {
    text += fmt::format("; spectrum.wavelengths are in Angstrom: {} nm are {} Angstrom",
                        job.spectrum.planes.front().wavelength,
                        10 * job.spectrum.planes.front().wavelength);
  }
  return text;
}

std::string cause_of_darkness(const RenderJob& job) {
  const Scene& scene = *job.scene;
  if (scene.objects == 0) {
    return scene.rows == 0 ? "the scene has no objects"
                           : "no object of the scene touches the image";
  }
  if (scene.stars.empty()) {
    const Lamps lamps = find_lamps(job);
    if (!lamps.are_there) return "no component of a galaxy emits light";
    if (!lamps.are_seen) return unseen_wavelengths(job);
    if (!is_in_view(job.camera, scene.galaxies)) return out_of_view(job);
  }
  return "what is in view is too faint for the numbers of the file, or hidden by dust; see "
         "magnitude, distance, redshift and optical_depth";
}

}  // namespace

std::vector<std::string> job_warnings(const RenderJob& job) {
  std::vector<std::string> warnings;
  if (job.parameters.camera.supersample && job.scene->unit != PixelUnit::relative) {
    warnings.push_back(fmt::format(
        "camera.supersample = {} puts a fixed grid in place of the cells that keep a pixel's flux: "
        "galaxies of few pixels lose or gain tenths of a magnitude; without the key "
        "sampling.tolerance holds",
        *job.parameters.camera.supersample));
  }
  for (const auto& [name, values] : job.parameters.scene.overrides.table()) {
    const bool is_used = std::ranges::any_of(job.scene->galaxies, [&](const PlacedGalaxy& placed) {
      return name_of_type(placed.type) == name;
    });
    if (is_used) continue;
    warnings.push_back(
        fmt::format("{}: no galaxy in the image is of this type", values.key_where.file));
  }
  std::ranges::copy(job.scene->remarks, std::back_inserter(warnings));
  if (const Scene::Unlikely& unlikely = job.scene->unlikely; unlikely.number > 0) {
    const std::string others =
        unlikely.number > 1 ? fmt::format(", and {} more are", unlikely.number - 1) : " is";
    warnings.push_back(
        fmt::format("{}: an apparent magnitude of {:.1f}{} outside 5 to 40; are magnitude, "
                    "redshift and distance right?",
                    unlikely.where.text(), unlikely.magnitude, others));
  }
  return warnings;
}

bool has_light(std::span<const double> pixels, bool is_single_precision) {
  return std::ranges::any_of(pixels, [&](double value) {
    return std::isfinite(value) &&
           (is_single_precision ? double{static_cast<float>(value)} : value) != 0;
  });
}

std::string darkness_warning(const RenderJob& job) {
  return "no light in the image: " + cause_of_darkness(job);
}

std::string shortfall_warning(const std::string& where, double rays) {
  return fmt::format(
      "{}: {:.0f} rays did not converge to the tolerance within {} nodes and may have larger "
      "errors (card UNCONV); noises of fewer octaves or a larger sampling.tolerance would mend "
      "that",
      where, rays, most_nodes_of_a_ray);
}

std::vector<Card> shortfall_cards(double rays) {
  if (rays == 0) return {};
  return {{"UNCONV", static_cast<long long>(rays), "rays whose error may exceed the tolerance"}};
}

}  // namespace gamer
