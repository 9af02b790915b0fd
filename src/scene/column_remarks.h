#pragma once

#include <span>
#include <string>
#include <vector>

#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"
#include "scene/column_sources.h"

namespace gamer {

/// Warnings about the columns of a catalogue that is no scene list: columns that serve as none of a
/// scene but are called nearly like one, and values that a sky view lacks where other columns may
/// hold them. Columns of magnitudes and half-light radii whose names are of another band than the
/// default of photometry.reference_band count too. Empty for scene lists.
std::vector<std::string> column_remarks(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources,
                                        const RenderParameters& parameters);

}  // namespace gamer
