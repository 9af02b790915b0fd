#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "galaxy/associations/association_kernel.h"
#include "galaxy/scaled_texture.h"
#include "gamer/core/parameter.h"
#include "gamer/noise/noise.h"

namespace gamer {

/// Parameters of associations. Lengths are in galaxy radii.
struct AssociationParameters {
  double number = 3000;
  double luminosity_slope = 2;
  double luminosity_range = 500;
  double size_exponent = 2.8;
  double largest = 0.04;
  double complex_size = 0.05;
  double clustering = 1;
  double diffuse = 0.3;
  double filling = 1;
  double size_scatter = 0.4;
  double irregularity = 1;
  double cores = 0.6;
  double cavity = 0.6;
  double age = 0;
  double age_range = 1;
  std::uint64_t seed = 1;
  const Noise* kind = nullptr;  ///< of the complexes

  /// The declaration of these parameters, with these values as defaults.
  ParameterTable table() const;
  /// Takes the values of table().
  void apply(const ParameterSet& values);
};

/// The texture of young stars: clumps that gather in complexes. Their luminosities have the
/// distribution dN/dL ~ L^-a between cut-offs, and their diameters are D ~ L^(1/size_exponent).
///
/// Clumps are grouped in tiers l, within each of which diameters differ by at most a factor of 2. A
/// tier has a square lattice, turned by an angle of its own, whose cells are as large as its
/// largest clump. A cell's hash gives a place within the cell, a number u in [0, 1), one of
/// clump_count clumps, and its shape (association_kernel.h). The clumps are quantiles of the tier's
/// luminosities, with heights z_k above the plane, radii R_k and ages. Old clumps have fainter
/// cores and deeper cavities. Ages beyond age_range fade, so that components of equal seeds and
/// different ranges show the same clumps at several ages. A clump of profile K_k exists where u <
/// p_k (1 + fade_range); p_k is the surface density of clumps at its centre, times the cell's area.
/// Its weight w_k falls from 1 at u = p_k (1 - fade_range) to 0 at u = p_k (1 + fade_range). The
/// surface density is that of the layer times M_l, a product of octaves of mean 1
/// (multiply_octave()). These octaves are longer than four of the tier's largest diameters, and M_l
/// is at least least_complexes. With M the product of all octaves,
///   Phi = M (1 + sum_l share_l (sum_k w_k K_k/p_k - 1)).
/// The heights z_k follow sech^2(z/z0) convolved with a core, without the layer's edge. The
/// amplitudes of halo and cores make each clump emit exactly its luminosity, apart from octaves
/// below its size. The mean of Phi over all seeds and heights is thus 1 at every (x, y). `diffuse`
/// is the share of the light outside clumps.
///
/// A ray of footprint w sees a share of a tier and of an octave, as in FractalNoise; the rest
/// counts by its mean.
class AssociationTexture : public ScaledTexture {
 public:
  /// `density` is the layer's surface density, up to a factor, and `z0` is the layer's scale
  /// height.
  AssociationTexture(const AssociationParameters& parameters, SurfaceDensity density, double z0);
  /// A texture with equal parameters, but for the seed.
  AssociationTexture(const AssociationTexture& twin, std::uint64_t seed);

  /// The texture of the clumps alone: that of `whole` without the light outside clumps.
  static std::unique_ptr<AssociationTexture> of_clumps(const AssociationTexture& whole);

  /// Fills `whole` with Phi, and `of_clumps` with that of `clumps`, which is of_clumps(*this).
  /// Values may differ from those of evaluate() by rounding.
  void evaluate_with(const AssociationTexture& clumps, const Points& points,
                     const float* footprints, BatchArray& whole, BatchArray& of_clumps,
                     std::uint64_t& evaluations) const;

  bool hides(double footprint) const override;
  double frequency() const override;
  double refinement(double footprint, double cosine) const override;
  double sharpness() const override { return 2; }
  void see(const Points& points, std::span<const float* const> footprints, bool wants_coherent,
           std::span<SeenNoise> out, std::uint64_t& evaluations) const override;
  void expect(std::size_t size, const SeenNoise& seen, const float* coherence,
              std::span<const double> deviations, std::span<BatchArray> out) const override;

  /// Largest number of octaves. The last is no shorter than the diameter of the smallest clumps.
  static constexpr std::size_t most_octaves = 7;
  using OctaveArrays = std::array<BatchArray, most_octaves + 1>;
  /// The noise of each octave.
  void fill_octaves(const Points& points, OctaveArrays& noise) const;
  /// products[k] is the product of the first k octaves for rays of these footprints (null for
  /// none).
  void multiply_octaves(std::size_t size, const OctaveArrays& noise, const float* footprints,
                        OctaveArrays& products) const;
  /// The number of octaves of M_l, and of M.
  std::size_t octaves_before(std::size_t tier) const { return before_[tier]; }
  std::size_t octaves() const { return octaves_.size(); }

  const std::vector<ClumpTier>& tiers() const { return tiers_; }
  const SurfaceDensity& density() const { return *density_; }

 private:
  void evaluate_whole(const Points& points, BatchArray& out,
                      std::uint64_t& evaluations) const override;
  void add_tier(double least, double most);
  /// Gives the lattices of all tiers the places that follow from the seed.
  void place_lattices();
  void add_octaves();
  /// Phi/scale() for each of the footprints, which may be null. `of_clumps` is empty, or receives
  /// that of the texture of_clumps(*this).
  void look(const Points& points, std::span<const float* const> footprints,
            std::span<float* const> out, std::span<float* const> of_clumps,
            std::uint64_t& evaluations) const;

  AssociationParameters parameters_;
  /// The density, of integral 1; galaxies of one type share it.
  std::shared_ptr<const SurfaceDensity> density_;
  double z0_;
  std::vector<ClumpTier> tiers_;     ///< from the largest clumps on
  std::vector<std::size_t> before_;  ///< number of octaves of M_l
  std::vector<Octave> octaves_;
  float contrast_ = 0;
};

}  // namespace gamer
