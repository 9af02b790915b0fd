#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "gamer/core/batch.h"

namespace gamer {

class AssociationTexture;
class Layer;
struct AssociationClump;

/// The clumps of a texture of associations, as places of stars. The stars of clump c are a Poisson
/// process of the density n D Phi_c, where D is the layer's envelope and
///   Phi_c = share_l M w K_c/p
/// is the clump's part of Phi (AssociationTexture). Candidates follow K_c exactly. A candidate is a
/// star where share_l D M w/p exceeds a uniform random share of a bound. The bound is the largest
/// value at several places in the clump, with a margin; larger values count as the bound.
class StarClumps {
 public:
  /// `layer` is the layer whose texture is `texture`. Both must outlive this object.
  StarClumps(const AssociationTexture& texture, const Layer& layer);
  ~StarClumps();

  /// Largest number of cells of a tier whose clumps can hold stars.
  static constexpr double most_cells = 1 << 22;

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
  /// One over the mean of the texture without its scale.
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

  void find_sources(std::size_t tier);
  void add_node(std::size_t at, std::uint32_t first, std::uint32_t count);
  void offer(const Source& source, std::uint32_t index, std::uint64_t key, double number,
             const std::function<void(const Candidate&)>& take) const;
  /// share_l D M w/p at places in clumps, whose z are heights above the mid-plane.
  void evaluate_places(const Points& points, std::span<const Source* const> owners,
                       float* out) const;

  const AssociationTexture& texture_;
  const Layer& layer_;
  std::vector<Source> sources_;
  std::vector<Node> nodes_;
};

}  // namespace gamer
