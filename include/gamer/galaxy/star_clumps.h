#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

class AssociationTexture;
class Layer;
struct ClumpPlace;

/// The clumps of a texture of associations, as places of stars. The stars of clump c are a Poisson
/// process of the density n D Phi_c, where D is the layer's envelope and
///   Phi_c = share_l M w K_c/p
/// is the clump's part of Phi (AssociationTexture). Candidates of the halo and of each core have
/// the density q^3, moved by the waves that bend the clump. A candidate is a star where share_l D M
/// w/p exceeds a uniform random share of a bound. In the halo this product has two more factors,
/// those of cavity and tilt. The bound is the largest value at several places in the clump, with a
/// margin. Larger values count as the bound.
class StarClumps {
 public:
  /// `layer` is the layer whose texture is `texture`. Both must outlive this object.
  StarClumps(const AssociationTexture& texture, const Layer& layer);
  ~StarClumps();

  /// Largest number of cells of a tier whose clumps can hold stars.
  static constexpr double most_cells = 1 << 20;

  /// A box that holds clumps.
  struct Box {
    double centre[3];
    double half;  ///< half of its side
  };
  struct Candidate {
    double position[3];
    double threshold;  ///< the candidate is a star where evaluate() exceeds this value
    std::uint64_t key;
    std::uint32_t clump;
  };

  /// Calls take(candidate) for all candidates of a process of `number` stars where D Phi = 1, per
  /// unit of volume. The process is a function of `key`. Clumps in boxes for which keep(box) is
  /// false are skipped. The order of candidates is fixed.
  void walk(std::uint64_t key, double number, const std::function<bool(const Box&)>& keep,
            const std::function<void(const Candidate&)>& take) const;
  /// share_l D M w/p at the places of candidates from these clumps.
  void evaluate(const Points& points, std::span<const std::uint32_t> clumps, float* out) const;
  /// The number of octaves that evaluate() needs at a place.
  std::size_t octaves() const;
  /// AssociationTexture::scale().
  double scale() const;

 private:
  /// A clump that exists.
  struct Source;
  /// The parts of a box, or the clumps in a box without parts.
  struct Node {
    Box box;
    std::uint32_t first, count;  ///< clumps
    std::uint32_t parts;         ///< index of the first of two parts; 0 for none
  };

  /// A piece of the halo or of a core of a clump. It holds the places of a cube within the unit
  /// cube of three numbers: the shares of the light within the radius, below the height and before
  /// the azimuth.
  struct Piece {
    std::uint32_t clump;
    int part;
    std::array<double, 3> low;  ///< corner of the cube
    int level;                  ///< its side is 2^-level
    std::uint64_t key;
  };

  /// The clumps of a tier that may exist.
  std::vector<Source> possible_sources(std::size_t tier) const;
  void find_sources(std::size_t tier);
  void add_node(std::size_t at, std::uint32_t first, std::uint32_t count);
  /// Offers the candidates of a piece, in smaller pieces where many are expected.
  void offer(const Piece& piece, double expected, const std::function<bool(const Box&)>& keep,
             const std::function<void(const Candidate&)>& take) const;
  void fill(const Piece& piece, double expected,
            const std::function<void(const Candidate&)>& take) const;
  Box box_of(const Piece& piece) const;
  /// A place of a clump in the galaxy's ball.
  std::array<double, 3> place_of(const Source& source, const ClumpPlace& at) const;
  /// Largest slope of the mid-plane.
  double warp_slope() const;
  /// share_l D M w/p at places in clumps, whose z are heights above the mid-plane.
  void evaluate_places(const Points& points, std::span<const Source* const> owners,
                       float* out) const;

  const AssociationTexture& texture_;
  const Layer& layer_;
  std::vector<Source> sources_;
  std::vector<Node> nodes_;
};

}  // namespace gamer
