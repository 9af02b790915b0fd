#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gamer/galaxy/accuracy.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// The part of a ray inside one galaxy's ball, and the ray in that ball's frame:
/// p(t) = nearest + (t - centre) direction, `nearest` the point closest to the galaxy's centre.
struct Hit {
  int galaxy;
  double begin;
  double end;
  double centre;
  double nearest[3];
  double direction[3];
};

/// A bundle of rays for finding the galaxies that they may meet: origins within `radius` of
/// axis.origin, directions within the angle whose tangent is `tangent` of axis.direction.
struct RayBundle {
  Ray axis;
  double radius = 0;
  double tangent = 0;
};

/// Points on rays with what fills them there: emissivity and opacity per scene unit of path, for
/// each wavelength (outer index).
struct RayNodes {
  std::vector<std::int32_t> ray;
  std::vector<double> t;
  std::vector<std::vector<float>> emission;
  std::vector<std::vector<float>> opacity;

  std::size_t size() const { return t.size(); }
  void clear();
  std::int32_t add(std::int32_t ray_index, double at) {
    ray.push_back(ray_index);
    t.push_back(at);
    return static_cast<std::int32_t>(t.size() - 1);
  }
};

/// How the cost of rendering is counted.
struct RenderCounts {
  std::uint64_t rays = 0;
  std::uint64_t nodes = 0;  ///< sample points
};

/// Everything that emits or absorbs in a scene, at the observed wavelengths.
class Medium {
 public:
  Medium(std::shared_ptr<const Scene> scene, std::vector<double> wavelengths,
         const Accuracy& accuracy);

  int planes() const { return static_cast<int>(wavelengths_.size()); }
  const std::vector<double>& wavelengths() const { return wavelengths_; }
  const Accuracy& accuracy() const { return accuracy_; }
  double radius(int galaxy) const {
    return scene_->galaxies[static_cast<std::size_t>(galaxy)].radius;
  }

  /// Indices of the galaxies whose bounding spheres the bundle may touch.
  void candidates(const RayBundle& bundle, std::vector<int>& out) const;
  /// Appends the ray's hits among `candidates`, nearest first.
  void hits(const Ray& ray, std::span<const int> candidates, std::vector<Hit>& out) const;
  /// Appends the wishes of the hit galaxy's components, in the ray's t.
  void mark(const Hit& hit, Marks& marks) const;
  /// Face-on central surface brightness of a galaxy's brightest component, dimmed by the galaxy's
  /// own dust mixed with it, per plane.
  std::span<const double> typical_brightness(int galaxy) const;

  /// Fills emission and opacity of nodes [first, size). `hits_of_ray[i]` are those of ray i.
  void evaluate(std::span<const std::span<const Hit>> hits_of_ray, std::size_t first,
                RayNodes& nodes) const;

 private:
  /// Spectra of a placed galaxy's components, [component][wavelength], per scene unit of path.
  struct Spectra {
    std::vector<int> light, dust;            ///< indices of components
    std::vector<float> light_factors;        ///< [light][wavelength]
    std::vector<float> dust_factors;         ///< [dust][wavelength]
    std::vector<double> typical_brightness;  ///< [wavelength]
  };

  std::shared_ptr<const Scene> scene_;
  std::vector<double> wavelengths_;
  Accuracy accuracy_;
  std::vector<Spectra> spectra_;
  /// Place of each galaxy in an order that does not depend on the scene's rows.
  std::vector<int> rank_;
};

}  // namespace gamer
