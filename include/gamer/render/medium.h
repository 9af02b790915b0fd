#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "gamer/galaxy/accuracy.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/render/spectral_basis.h"
#include "gamer/render/stars/star_fields.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// The part of a ray inside one galaxy's ball, with the ray in this ball's frame: p(t) = nearest +
/// (t - centre) direction. `nearest` is the ray's point closest to the galaxy's centre.
struct Hit {
  int galaxy;
  double begin;
  double end;
  double centre;
  double nearest[3];
  double direction[3];
  double footprint = 0;  ///< width of the area that the ray represents, galaxy radii
  /// Growth of the footprint with the distance from the ray's origin, galaxy radii per scene unit.
  /// The growth is not 0 for a camera within the galaxy, which sees near parts in more detail than
  /// far parts.
  double footprint_growth = 0;

  double error_factor = 1;   ///< factor on Accuracy::ray_error, where errors of rays average out
  double step_factor = 1;    ///< factor on Accuracy::first_step
  bool seeks_depth = false;  ///< whether the optical depth decides the nodes, instead of the light

  double footprint_at(double t) const { return footprint + footprint_growth * t; }
};

/// The galaxies that together fill an interval of a ray, in an order that does not depend on the
/// scene's rows. Their components have numbers, called slots: light slots and dust slots, each
/// counted through all galaxies.
struct Cover {
  struct Slot {
    int galaxy;
    int component;  ///< index among the galaxy's light components, or its dust components
  };
  std::vector<int> galaxies;
  std::vector<Slot> light, dust;
  int light_slots = 0;
  int dust_slots = 0;
};

/// A table that finds the hits of rays by galaxy.
class HitTable {
 public:
  void build(std::span<const std::span<const Hit>> hits);
  /// The index of a galaxy's hit among the ray's hits. The ray must have one.
  std::size_t find(std::size_t ray, int galaxy) const;

 private:
  struct Entry {
    int galaxy;
    std::uint32_t hit;
  };
  std::vector<std::size_t> end_;  ///< [ray] end of its entries
  std::vector<Entry> entries_;    ///< ray by ray, ascending by galaxy
};

/// Nodes of segments of rays, with light and dust. Each slot of a segment's cover has the
/// emissivity at 5500 Angstrom (rest frame) or the extinction coefficient at V, per scene unit of
/// path.
struct RayNodes {
  struct Segment {
    std::int32_t ray;
    std::int32_t cover;  ///< index in `covers`
    std::int32_t first;  ///< index of its first node; the others follow
    std::int32_t count;
    double origin;  ///< place on the ray where s = 0
  };
  std::vector<Segment> segments;
  std::vector<float> s;  ///< place of each node on its segment, ascending
  /// [slot][node] and [variant * dust_slots + slot][node]. Slots that a cover lacks have arbitrary
  /// values. The arrays never shrink.
  std::vector<std::vector<float>> light, dust;
  std::size_t dust_slots = 0;  ///< number of dust slots of the largest cover

  std::size_t size() const { return s.size(); }
  /// Extra numbers after the last node, so that several can be read at once.
  static constexpr std::size_t padding = 3;
  /// Makes room for all nodes in these numbers of slots, with unspecified values.
  void make_room(std::size_t light_slots, std::size_t most_dust_slots, std::size_t variants) {
    dust_slots = most_dust_slots;
    const auto grow = [](auto& values, std::size_t least) {
      if (values.size() < least) values.resize(least);
    };
    grow(light, light_slots);
    grow(dust, variants * dust_slots);
    for (std::size_t slot = 0; slot < light_slots; ++slot) grow(light[slot], size() + padding);
    for (std::size_t k = 0; k < variants * dust_slots; ++k) grow(dust[k], size() + padding);
  }
  void clear() {
    segments.clear();
    s.clear();
  }
};

class Medium;

/// The light that reaches the camera on each ray of a bundle: G_j = int e exp(-tau_j) ds at each
/// spectral node j. G_j is given for each light component of every hit galaxy, in the order of the
/// ray's hits.
struct RayLight {
  std::vector<std::size_t> begin;      ///< [ray] begin of its part of `light`
  std::vector<double> light;           ///< [begin[ray] + component * nodes + j]
  std::vector<double> depth;           ///< [ray * nodes + j] optical depth of the whole ray
  std::vector<double> through;         ///< [ray * nodes + j] transmission of light from behind
  HitTable table;                      ///< finds the hits of the rays
  std::vector<std::size_t> first_hit;  ///< [ray] index of its first hit in `hit_begin`
  std::vector<std::size_t> hit_begin;  ///< [hit] begin of its part of `light`

  /// Fills everything with zeros, for rays with these hits.
  void prepare(const Medium& medium, std::span<const std::span<const Hit>> hits);
};

/// Counts of the work of rendering. Seconds are sums over threads.
struct RenderCounts : EvaluationCounts {
  std::uint64_t rays = 0;
  std::uint64_t nodes = 0;  ///< sample points
  /// Number of rays on which most_nodes_of_a_ray kept the adaptive sampler from its tolerance.
  std::uint64_t unconverged_rays = 0;
  double transfer_seconds = 0;

  RenderCounts& operator+=(const RenderCounts& more);
};

/// The emitting and absorbing matter of a scene.
class Medium {
 public:
  /// `dust_free` adds a last spectral node, at which nothing absorbs. The medium's light lacks the
  /// stars of `fields` that are drawn individually; without `fields` it holds all stars.
  Medium(std::shared_ptr<const Scene> scene, std::shared_ptr<const SpectralBasis> basis,
         const Accuracy& accuracy, bool dust_free = false,
         std::shared_ptr<const StarFields> fields = nullptr);

  int planes() const { return static_cast<int>(basis_->planes()); }
  const SpectralBasis& basis() const { return *basis_; }
  /// Number of spectral nodes, including the node of dust_free.
  std::size_t nodes() const { return nodes_; }
  const Accuracy& accuracy() const { return accuracy_; }
  double radius(int galaxy) const { return placed(galaxy).radius; }

  /// Appends the ray's hits among `candidates`, nearest first. The functions below may be called
  /// only for galaxies that some ray has hit.
  void hits(const Ray& ray, std::span<const int> candidates, std::vector<Hit>& out) const;
  /// The plan of the hit galaxy's components on the ray, in t - hit.centre.
  void plan(const Hit& hit, RayPlan& out) const;

  /// The cover of these hits.
  Cover cover(std::span<const Hit> hits) const;
  /// Number of a galaxy's light components; a star field may be several components with different
  /// spectra.
  std::size_t light_components(int galaxy) const { return kind(galaxy).light.size(); }
  /// The index, among the galaxy's emitting components, of the component to which a light component
  /// belongs.
  std::size_t emitter(int galaxy, std::size_t light) const { return kind(galaxy).emitter[light]; }
  /// Number of a galaxy's emitting components.
  std::size_t emitters(int galaxy) const {
    const auto& own = kind(galaxy).emitter;
    return own.empty() ? 0 : own.back() + 1;
  }
  /// The rank of a galaxy in an order that does not depend on the scene's rows.
  int rank(int galaxy) const { return rank_[static_cast<std::size_t>(galaxy)]; }
  /// The indices in RayLight::light of the light slots of a cover of the ray.
  void places(const RayLight& light, std::size_t ray, const Cover& cover,
              std::vector<std::size_t>& out) const;
  /// The extinction of a cover's dust slot at spectral node j, relative to V.
  float extinction(const Cover& cover, int slot, std::size_t j) const;

  /// Whether a hit needs the variants of dust_variants.h.
  bool has_variants(const Hit& hit) const;

  /// Fills light and dust of the nodes. With one variant dust is the expectation over the hidden
  /// noise; otherwise there are all variants of dust_variants.h. `hits_of_ray[i]` are the hits of
  /// ray i. Nodes of a segment with one galaxy lie on its hit, except for rounding.
  void evaluate(std::span<const std::span<const Hit>> hits_of_ray, std::span<const Cover> covers,
                std::size_t variants, RayNodes& nodes, RenderCounts& counts) const;

  /// Planes whose errors steer the refinement. Where there are many planes, they are the bluest,
  /// the reddest and one between these.
  std::span<const std::size_t> steering() const { return steering_; }
  /// A galaxy's brightness, or 1 if it has none.
  double unit_of(int galaxy) const {
    return spectra(galaxy).brightness > 0 ? spectra(galaxy).brightness : 1;
  }
  /// Dust-free flux of a unit of light in a light slot of a cover, in the s-th steering plane. Its
  /// unit is the brightness of the cover's first galaxy.
  float steering_flux(const Cover& cover, int slot, std::size_t s) const;
  /// Face-on central brightness of a galaxy's brightest component in the s-th steering plane,
  /// dimmed by the galaxy's own dust, for a galaxy of brightness 1.
  double typical_brightness(int galaxy, std::size_t s) const;

  /// Adds the surface brightness of a hit galaxy's light component to every plane, for a galaxy of
  /// brightness 1. `light` holds its G_j. With `dust_free` the brightness is that without dust.
  void add_planes(int galaxy, std::size_t component, const double* light, bool dust_free,
                  std::span<double> out) const;
  /// The transmission of a galaxy in a plane, from its transmissions at the spectral nodes. The
  /// light behind the galaxy is taken to have the spectrum of the galaxy's first component.
  double through(int galaxy, std::size_t plane, const double* through) const;
  /// The value at a plane's pivot wavelength of a quantity that is known at the spectral nodes.
  double at_pivot(std::size_t plane, const double* values) const;

 private:
  /// Data shared by galaxies of one type and seed. A galaxy whose stars are drawn has a class of
  /// its own.
  struct GalaxyClass {
    std::vector<int> light, dust;      ///< indices of components
    std::vector<std::size_t> emitter;  ///< [light] index among emitting components
    std::vector<const Sed*> seds;      ///< [light] spectrum
    /// The star field of each of `light`; null where no star is drawn individually.
    std::vector<const StarFields::Field*> fields;
    std::vector<const StarFields::SmoothPart*> field_parts;
    std::vector<double> columns;  ///< [component] typical largest line integral, with amplitude
    std::vector<double>
        dust_columns;  ///< [dust component] `columns` without the galaxy's stretch along z
  };
  /// Places of the spectral data shared by galaxies of one class and redshift, in arrays for all
  /// galaxies (up to a million). The data are filled when a ray first meets one of the galaxies, so
  /// that a rank pays only for galaxies in its rows.
  struct SharedSpectra {
    /// Index in weights_ of three arrays: weights [light component][plane * basis nodes + j], their
    /// sums over the nodes [light component][steering plane], typical brightnesses [steering
    /// plane].
    std::size_t weights;
    std::size_t extinction;  ///< index in extinction_ of [dust component][node]
  };
  struct Spectra {
    double brightness;  ///< factor on the weights
    std::uint32_t kind;
    std::uint32_t share;
  };
  /// The range of a segment's nodes that lie in a galaxy's ball, and the range of all its nodes.
  struct NodesInBall {
    const Hit* hit;
    std::int32_t first, count;
    std::int32_t segment_first, segment_count;
    double origin;
  };
  struct Scratch;
  static Scratch& scratch();
  /// Fills the galaxy's slots, from the given first slots on, at the nodes of the stretches. At
  /// other nodes of their segments the slots become 0.
  void fill(int galaxy, std::span<const NodesInBall> stretches, std::size_t first_light,
            std::size_t first_dust, std::size_t variants, RayNodes& nodes,
            RenderCounts& counts) const;

  const PlacedGalaxy& placed(int galaxy) const {
    return scene_->galaxies[static_cast<std::size_t>(galaxy)];
  }
  const Spectra& spectra(int galaxy) const { return spectra_[static_cast<std::size_t>(galaxy)]; }
  const GalaxyClass& kind(int galaxy) const { return kinds_[spectra(galaxy).kind]; }
  const SharedSpectra& share(int galaxy) const { return shares_[spectra(galaxy).share]; }
  std::size_t planes_times_steps() const { return basis_->planes() * basis_->size(); }
  /// Dust-free flux of a unit of light in a light component of a galaxy of brightness 1, in the
  /// s-th steering plane.
  double flux(int galaxy, std::size_t component, std::size_t s) const {
    return weights_[share(galaxy).weights + kind(galaxy).light.size() * planes_times_steps() +
                    component * steering_.size() + s];
  }
  void make_kinds();
  void make_shares();
  /// Fills a galaxy's SharedSpectra unless they are filled.
  void prepare(int galaxy) const;
  void fill_share(const PlacedGalaxy& galaxy, const GalaxyClass& kind,
                  const SharedSpectra& share) const;
  void rank_galaxies();
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const SpectralBasis> basis_;
  std::shared_ptr<const StarFields> star_fields_;
  Accuracy accuracy_;
  std::size_t nodes_;
  std::vector<std::size_t> steering_;
  std::vector<std::vector<double>> interpolation_;  ///< [plane][basis node]
  std::vector<GalaxyClass> kinds_;
  std::vector<SharedSpectra> shares_;
  std::vector<Spectra> spectra_;
  std::unique_ptr<double[]> weights_;
  std::unique_ptr<float[]> extinction_;
  std::unique_ptr<std::atomic<bool>[]> is_ready_;  ///< [SharedSpectra] whether it is filled
  std::unique_ptr<std::mutex[]> mutexes_;          ///< protect SharedSpectra that are filled
  /// Rank of each galaxy in an order that does not depend on the scene's rows.
  std::vector<int> rank_;
};

}  // namespace gamer
