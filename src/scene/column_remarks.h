#pragma once

#include <span>
#include <string>
#include <vector>

#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"
#include "scene/column_sources.h"

namespace gamer {

/// Warnings about the columns of a catalogue that is no scene list; empty for scene lists. One kind
/// names unused columns whose names resemble a column of a scene. Another names values that a sky
/// view lacks where other columns may hold them. A third names magnitudes and half-light radii of
/// another band than the default of photometry.reference_band.
std::vector<std::string> column_remarks(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources,
                                        const RenderParameters& parameters);

}  // namespace gamer
