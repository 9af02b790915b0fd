#pragma once

#include <span>
#include <string>
#include <vector>

#include "gamer/scene/catalogue.h"
#include "scene/column_sources.h"

namespace gamer {

/// Warnings about the columns of a catalogue that is no scene list: columns that serve as none of a
/// scene but are called nearly like one, and values that a sky view lacks where other columns may
/// hold them. Empty for scene lists.
std::vector<std::string> column_remarks(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources, bool is_sky);

}  // namespace gamer
