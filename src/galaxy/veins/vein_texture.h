#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "galaxy/scaled_texture.h"
#include "galaxy/spiral_coordinates.h"
#include "gamer/core/parameter.h"
#include "gamer/noise/noise.h"

namespace gamer {

struct VeinView;

/// Parameters of veins. Lengths and frequencies are in units of the arms' spacing (of u) unless
/// noted.
struct VeinParameters {
  double vein_width = 0.1;
  double spur_number = 14;
  double spur_width = 0.12;
  double spur_angle = 60;  ///< degrees
  double spur_curvature = 2;
  double spur_length = 1;
  double spur_strength = 0.9;
  double spur_variation = 0.5;
  double displacement = 0.06;
  double displacement_frequency = 2;
  int displacement_octaves = 2;
  double density_high = 5.6;
  double density_low = 0.6;
  int octaves = 8;
  double noise_frequency = 1.5;
  double noise_contrast = 0.25;
  double spectral_index = 2.9;
  double clumpiness = 1;
  double anisotropy = 2;
  double anisotropy_angle = 60;       ///< degrees
  double isotropic_scale = 0.04;      ///< galaxy radii
  std::uint64_t seed = 1;             ///< of the noise
  std::uint64_t pattern_seed = 1;     ///< of displacement and spurs
  const Noise* small_kind = nullptr;  ///< of the isotropic octaves

  /// The declaration of these parameters, with these values as defaults.
  ParameterTable table() const;
  /// Takes the values of table().
  void apply(const ParameterSet& values);
};

/// The texture of dust in veins along the arms of a spiral and in spurs that leave them [Bizard
/// 2018, sections 3.4 and 3.5, extended to three dimensions]. With the spiral coordinates (u, v),
///   Phi = N [(D_h - D_l) V + D_l] / mean,   V = 1 - (1 - A)(1 - S).
/// One helical gradient noise P (rms `displacement`) displaces both kinds of vein:
/// arms   A = G(u + P, width),   G(x, sigma) = exp((cos 2 pi x - 1)/(4 pi^2 sigma^2)), a Gaussian
///        of period 1;
/// spurs  S = 1 - prod_k (1 - strength fade(u_k) G(t_k, width)) over the arms k inwards of the
///        point, u_k = u + P - k outwards from the arm, and along it
///        t_k = q (v - k n'/n + P + rho f(u_k)) + phase_k,   f(u) = u cot(angle) + curvature u^2,
///        q n'(1 + tan^2 p) spurs per turn, rho = |grad v|/|grad u|. The fade rises within the
///        arm, falls as (1 - (u_k/length)^2)^2, and vanishes where the pattern turns into a bar.
/// Bizard 2018 takes the maximum of A and S in place of this smooth union.
///
/// N is the product of octaves clamp(1 + c noise/sigma, 0, 2), of mean 1. Large octaves are
/// helical, on the lattice of a HelicalMap. Their cells are stretched along the spurs and grow with
/// the radius. Octaves with cells below isotropic_scale are Cartesian; their factors are raised to
/// the power clumpiness and divided by their mean. In helical octaves c is noise_contrast. In
/// Cartesian octaves c makes the power of the column density of a layer of this thickness scale as
/// |k|^-spectral_index: c^2 ~ F^(2 - spectral_index) (1 + 2 F thickness).
///
/// A ray of footprint w resolves octaves as in FractalNoise. Veins are widened at constant mean, by
/// the variance w^2/12 of the footprint and by the variance of the hidden displacement. Hidden
/// factors of mean 1 count as 1. The coherent part of the hidden dust is a log-normal factor, whose
/// weighted mean over the three dust variants is 1.
class VeinTexture : public ScaledTexture {
 public:
  /// `thickness` is that of the layer, galaxy radii.
  VeinTexture(const VeinParameters& parameters, const SpiralCoordinates& coordinates,
              double thickness);

  const SpiralCoordinates& coordinates() const { return coordinates_; }

  void normalise(std::span<const WeightedBatch> cloud, const FractalNoise::Factor& factor) override;
  std::vector<double> statistics() const override { return {scale(), rms(), frequency_}; }
  void restore(std::span<const double> statistics) override {
    ScaledTexture::restore(statistics);
    frequency_ = statistics[2];
  }
  bool hides(double footprint) const override;
  double frequency() const override { return frequency_; }
  double sharpness() const override { return std::sqrt(std::max(parameters_.clumpiness, 1.0)); }
  void see(const Points& points, std::span<const float* const> footprints, bool wants_coherent,
           std::span<SeenNoise> out, std::uint64_t& evaluations) const override;
  void expect(std::size_t size, const SeenNoise& seen, const float* coherence,
              std::span<const double> deviations, std::span<BatchArray> out) const override;

  /// The parts of Phi before normalisation, without footprints.
  struct Parts {
    BatchArray displacement;
    BatchArray arms;   ///< A
    BatchArray spurs;  ///< S
    BatchArray veins;  ///< V
    BatchArray noise;  ///< N
  };
  void parts(const Points& points, Parts& out) const;

 private:
  void evaluate_whole(const Points& points, BatchArray& out,
                      std::uint64_t& evaluations) const override;
  struct Batch;
  struct Inputs;
  /// Phi over a cloud.
  std::vector<BatchArray> phi(std::span<const WeightedBatch> cloud) const;
  void take_frequency(std::span<const WeightedBatch> cloud);
  /// Fills the densities of views, and their hidden variance.
  void look(const Points& points, std::span<VeinView> views, std::uint64_t& evaluations) const;
  void displace(Batch& batch, std::uint64_t& evaluations) const;
  void base(const Batch& batch, Parts* parts) const;
  void multiply(Batch& batch, std::uint64_t& evaluations) const;
  VeinParameters parameters_;
  SpiralCoordinates coordinates_;
  std::shared_ptr<const Inputs> inputs_;  ///< inputs of the kernels
  double finest_ = 1;                     ///< highest frequency of N, cycles per galaxy radius
  double frequency_ = 1;
};

}  // namespace gamer
