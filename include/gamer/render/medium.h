#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "gamer/galaxy/accuracy.h"
#include "gamer/render/spectral_basis.h"
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
  double footprint = 0;  ///< width across the ray for which it stands, galaxy radii
};

/// The galaxies that fill a stretch of a ray together, in an order that does not depend on the
/// scene's rows. Their components have *slots*: light slots, then dust slots, each numbered through
/// the galaxies.
struct Cover {
  std::vector<int> galaxies;
  int light_slots = 0;
  int dust_slots = 0;
};

/// Points on rays with what fills them there: per slot of the point's cover, the emissivity at 5500
/// Angstrom (rest frame) or the opacity at V per scene unit of path.
struct RayNodes {
  std::vector<std::int32_t> ray;
  std::vector<std::int32_t> cover;  ///< index in `covers`
  std::vector<double> t;
  std::vector<Cover> covers;
  std::vector<std::vector<float>> light;  ///< [slot][node]; 0 in slots that a cover lacks
  std::vector<std::vector<float>> dust;

  std::size_t size() const { return t.size(); }
  /// Drops the nodes, keeps the covers.
  void clear_nodes();
  void clear();
  std::int32_t add(std::int32_t ray_index, std::int32_t cover_index, double at) {
    ray.push_back(ray_index);
    cover.push_back(cover_index);
    t.push_back(at);
    return static_cast<std::int32_t>(t.size() - 1);
  }
};

class Medium;

/// What came through on each ray of a bundle: per light component of every hit galaxy, in the order
/// of the ray's hits, the integral G_j = int e exp(-tau_j) ds at each spectral node.
struct RayLight {
  std::vector<std::size_t> begin;  ///< of each ray's part of `light`
  std::vector<double> light;       ///< [begin[ray] + component * nodes + j]
  std::vector<double> depth;       ///< [ray * nodes + j], optical depth of the whole ray

  /// Zeroes for rays with these hits.
  void prepare(const Medium& medium, std::span<const std::span<const Hit>> hits);
};

/// How the cost of rendering is counted; seconds are sums over threads.
struct RenderCounts {
  std::uint64_t rays = 0;
  std::uint64_t nodes = 0;              ///< sample points
  std::uint64_t noise_evaluations = 0;  ///< of one octave at one point
  double noise_seconds = 0;
  double envelope_seconds = 0;
  double transfer_seconds = 0;

  RenderCounts& operator+=(const RenderCounts& more);
};

/// Everything that emits or absorbs in a scene.
class Medium {
 public:
  /// With `dust_free` there is one more spectral node, the last, at which nothing absorbs.
  Medium(std::shared_ptr<const Scene> scene, std::shared_ptr<const SpectralBasis> basis,
         const Accuracy& accuracy, bool dust_free = false);

  int planes() const { return static_cast<int>(basis_->planes()); }
  const SpectralBasis& basis() const { return *basis_; }
  /// Spectral nodes, that of dust_free included.
  std::size_t nodes() const { return nodes_; }
  const Accuracy& accuracy() const { return accuracy_; }
  double radius(int galaxy) const { return placed(galaxy).radius; }

  /// Appends the ray's hits among `candidates`, nearest first.
  void hits(const Ray& ray, std::span<const int> candidates, std::vector<Hit>& out) const;
  /// Appends the wishes of the hit galaxy's components, in the ray's t.
  void mark(const Hit& hit, Marks& marks) const;

  /// The cover of the hits that hold `t`; no galaxies where none does.
  Cover cover(std::span<const Hit> hits, double t) const;
  /// Light components of a galaxy.
  std::size_t light_components(int galaxy) const { return spectra(galaxy).light.size(); }
  /// Where the light slots of a cover stand in a ray's part of RayLight::light.
  void places(std::span<const Hit> hits, const Cover& cover, std::vector<std::size_t>& out) const;
  /// What dust slot `slot` of a cover does at spectral node j, relative to V.
  float extinction(const Cover& cover, int slot, std::size_t j) const;

  /// Fills light and dust of nodes [first, size). `hits_of_ray[i]` are those of ray i.
  void evaluate(std::span<const std::span<const Hit>> hits_of_ray, std::size_t first,
                RayNodes& nodes) const;

  /// Planes that steer the refinement when there are many: the bluest, the reddest, one between.
  std::span<const std::size_t> steering() const { return steering_; }
  /// Dust-free flux in the s-th steering plane of a unit of light in a light slot of a cover.
  float steering_flux(const Cover& cover, int slot, std::size_t s) const;
  /// Face-on central brightness of a galaxy's brightest component, dimmed by the galaxy's own dust
  /// mixed with it, in the s-th steering plane.
  double typical_brightness(int galaxy, std::size_t s) const {
    return spectra(galaxy).typical_brightness[s];
  }

  /// Adds the surface brightness of a hit galaxy's light component in every plane: `light` has its
  /// G_j. With `dust_free`, what it would be without dust.
  void add_planes(int galaxy, std::size_t component, const double* light, bool dust_free,
                  std::span<double> out) const;
  /// Optical depth at a plane's pivot wavelength, `depth` those at the nodes.
  double depth(std::size_t plane, const double* depth) const;

 private:
  /// What a placed galaxy's components do.
  struct Spectra {
    std::vector<int> light, dust;  ///< indices of components
    /// [light component]: weights[plane * basis nodes + j]; shared by galaxies of one redshift.
    std::vector<std::shared_ptr<const std::vector<double>>> weights;
    double brightness = 1;                   ///< factor of the weights
    std::vector<float> extinction;           ///< [dust component][node]
    std::vector<float> steering_flux;        ///< [light component][steering plane]
    std::vector<double> typical_brightness;  ///< [steering plane]
  };
  const PlacedGalaxy& placed(int galaxy) const {
    return scene_->galaxies[static_cast<std::size_t>(galaxy)];
  }
  const Spectra& spectra(int galaxy) const { return spectra_[static_cast<std::size_t>(galaxy)]; }
  void rank_galaxies();
  /// The galaxy of a cover's slot, and the slot counted within that galaxy.
  template <class Count>
  std::pair<int, std::size_t> find_slot(const Cover& cover, int slot, Count count) const;

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const SpectralBasis> basis_;
  Accuracy accuracy_;
  std::size_t nodes_;
  std::vector<std::size_t> steering_;
  std::vector<std::vector<double>> interpolation_;  ///< [plane][basis node]
  std::vector<Spectra> spectra_;
  /// Place of each galaxy in an order that does not depend on the scene's rows.
  std::vector<int> rank_;
};

}  // namespace gamer
