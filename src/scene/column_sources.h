#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene_columns.h"

namespace gamer {

using column::Column;

/// The source of the values of one scene column.
struct ColumnSource {
  enum class Kind { absent, constant, catalogue };
  Kind kind = Kind::absent;
  std::string constant;   ///< the word of every row
  std::size_t place = 0;  ///< index of the catalogue's column
  double factor = 1;      ///< to the scene column's unit
};

/// The sources of all scene columns, by Column. Names in scene lists and SkyMaker lists are fixed.
/// In other catalogues the first of these gives a column: the key of [catalogue], the column's own
/// name, that name in any case, a usual name in any case. Throws InputError for unknown, repeated,
/// ambiguous and missing columns, and for units that do not fit.
std::vector<ColumnSource> find_columns(const Catalogue& catalogue,
                                       const RenderParameters& parameters);

/// Indices of the catalogue's columns that serve as no column of a scene.
std::vector<std::size_t> unused_columns(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources);

/// The end of a message on missing columns: near names, then all columns of a catalogue that has
/// none of `wanted`. It is empty for scene lists.
std::string columns_hint(const Catalogue& catalogue, std::span<const ColumnSource> sources,
                         std::span<const Column> wanted);

}  // namespace gamer
