#pragma once

#include <cstddef>
#include <span>

#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// A galaxy's textures as seen by rays of several widths. Points belong to the cloud of a
/// component, turned back by its twirl.
class SeenTextures {
 public:
  /// `galaxy` must outlive this object.
  explicit SeenTextures(const Galaxy& galaxy) : galaxy_(&galaxy) {}

  /// Phi of component c for rays of each width, including the factor Phi of a followed component.
  void phi(std::size_t c, const Points& points, std::span<const double> widths,
           std::span<BatchArray> out) const;
  /// Multiplies arrays by Phi of the component that c follows, if any, for rays of each width.
  void multiply_followed(std::size_t c, const Points& points, const BatchArray& shear,
                         std::span<const double> widths, std::span<BatchArray> out) const;
  /// Phi of the component that c follows, for rays that resolve everything.
  void phi_of_followed(std::size_t c, const Points& points, float* out) const;
  /// The octaves of a component that rays of each width see.
  static void see(const Component& component, const Points& points, const BatchArray& shear,
                  std::span<const double> widths, bool wants_coherent, std::span<SeenNoise> out);
  /// r dtheta/dr, for all places of a batch.
  void fill_shear(const Points& points, BatchArray& out) const;

 private:
  const Component& at(std::size_t c) const { return *galaxy_->components()[c]; }
  const Component& followed_by(std::size_t c) const {
    return at(static_cast<std::size_t>(galaxy_->followed(c)));
  }
  /// The expectation of a component's Phi for each width.
  static void expect(const Component& component, const Points& points, const BatchArray& shear,
                     std::span<const double> widths, std::span<BatchArray> out);
  /// Points turned back by the twirl of the component that c follows, from points turned back by
  /// c's own twirl. The arrays x, y, z hold the result.
  Points turn_to_followed(std::size_t c, const Points& points, BatchArray& x, BatchArray& y,
                          BatchArray& z) const;

  const Galaxy* galaxy_;
};

}  // namespace gamer
