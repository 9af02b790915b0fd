#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "galaxy/associations/association_texture.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer {

/// The means of Phi over a layer for rays of each width (galaxy radii; 0 resolves everything), with
/// a relative error of about `error`. Clouds of points have at most `most_points`.
///   <Phi>/scale = (1 - sum_l s_l) <M> + sum_l s_l <M C_l>.
/// s_l is the share of the light that such rays resolve as clumps of tier l. C_l is the light of
/// these clumps, relative to its mean. <M> is a mean over a cloud of points. A cloud would miss the
/// few brightest clumps. <M C_l> is therefore a sum over all clumps: the light of each, times the
/// mean of density and M over points that follow its profile. Tiers with so many clumps that chance
/// hardly changes their sum have <M C_l> = <M>.
std::vector<double> association_means(const AssociationTexture& texture, const Layer& layer,
                                      std::span<const double> widths, double error,
                                      std::size_t most_points);

}  // namespace gamer
