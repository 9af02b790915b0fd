#pragma once

#include <string>
#include <vector>

#include "gamer/scene/scene_columns.h"

namespace gamer {

/// Names in lower case under which catalogues often have a scene column. Names of a later group
/// count only where the catalogue has none of an earlier group; two names of one group are
/// ambiguous.
using NameGroups = std::vector<std::vector<std::string>>;

/// The groups of a column. {band} stands for the name of the reference band in lower case
/// ("sdss_r"). {letter} stands for the part behind the name's last "_" ("r").
const NameGroups& usual_names(column::Column column);

/// The groups of a column in which {band} and {letter} are replaced by those of a reference band.
NameGroups usual_names(column::Column column, const std::string& reference_band);

}  // namespace gamer
