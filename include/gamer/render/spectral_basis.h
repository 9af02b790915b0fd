#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "gamer/scene/spectrum.h"
#include "gamer/sed/extinction.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// The few wavelengths, called spectral nodes, that carry the light of all planes through dust.
///
/// A component's light that reaches the camera at the observed wavelength lambda is
/// F(lambda) G(lambda). F is its spectrum and G(lambda) = int e exp(-tau(s, lambda)) ds. Without
/// dust G is constant; with dust it is smooth, since extinction curves are. G is marched at a few
/// nodes lambda_j and interpolated, G(lambda) = sum_j l_j(lambda) G_j. A plane's flux is then
///   sum_j W_j G_j,  W_j = (1+z)^-1 int lambda F(lambda/(1+z)) X T l_j dlambda / int T
///   dlambda/lambda,
/// an integral over the band in which spectrum, response and (through l_j) extinction are evaluated
/// finely. Monochromatic planes are bands of no width. The nodes are the Gauss-Legendre points of
/// segments that cover the bands; l_j are the Lagrange polynomials of a segment.
class SpectralBasis {
 public:
  /// A spectrum at a redshift and the dust in front of it, for which the nodes are chosen.
  struct Probe {
    const Sed* sed;
    double sed_redshift;
    const ExtinctionCurve* dust;
    double dust_redshift;
  };

  /// Without probes nothing is absorbed, and there is one node. `band_samples` gives the number of
  /// nodes in each band. Otherwise the number is the smallest for which no plane's flux errs by
  /// more than `error` of the flux without dust. This holds behind screens of tau_V = 1/4, 1 and 4.
  SpectralBasis(Spectrum spectrum, const std::vector<Probe>& probes,
                std::optional<int> band_samples, double error);

  const Spectrum& spectrum() const { return spectrum_; }
  std::size_t planes() const { return spectrum_.planes.size(); }
  std::size_t size() const { return nodes_.size(); }
  /// Observed wavelength of a node, Angstrom.
  double node(std::size_t j) const { return nodes_[j]; }
  /// The node with the largest weight for a plane.
  std::size_t main_node(std::size_t plane) const { return main_nodes_[plane]; }

  /// weights[plane * size() + j]: W_j above.
  std::vector<double> weights(const Sed& sed, double redshift) const;
  /// l_j at a plane's pivot wavelength.
  std::vector<double> interpolation(std::size_t plane) const;

  /// Extinction relative to V (rest frame) of dust at `redshift`, at an observed wavelength.
  /// Shortward of the Lyman limit, where no light is left, the extinction is that at the limit.
  static double extinction(const ExtinctionCurve& curve, double redshift, double wavelength);

 private:
  struct Segment {
    double low, high;
    std::size_t first;  ///< node
    std::size_t count;
  };
  void set_segments(const std::vector<Sed::Range>& intervals, std::size_t order, double spacing);
  void add_segment(double low, double high, std::size_t order);
  /// The light of a probe behind screens, for error().
  struct Trial;

  /// The segment whose polynomials are used at a wavelength of a plane.
  const Segment& segment_at(std::size_t plane, double wavelength) const;
  /// Adds `light` times l_j at a wavelength of a plane to the sums of the nodes.
  void spread(std::size_t plane, double wavelength, double light, double* nodes) const;
  std::vector<Trial> trials(const std::vector<Probe>& probes) const;
  double error(const std::vector<Trial>& trials) const;

  Spectrum spectrum_;
  std::vector<Segment> segments_;
  bool own_segments_ = false;  ///< one segment per plane, which may overlap
  std::vector<double> nodes_;
  /// The place of each node in its segment, in [-1, 1], and the factor that makes its polynomial 1
  /// there.
  std::vector<double> places_, scales_;
  std::vector<std::size_t> main_nodes_;
};

}  // namespace gamer
