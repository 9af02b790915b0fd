#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene_columns.h"

namespace gamer {

using column::Column;

/// Where the values of one scene column come from.
struct ColumnSource {
  enum class Kind { absent, constant, catalogue };
  Kind kind = Kind::absent;
  std::string constant;   ///< the word of every row
  std::size_t place = 0;  ///< index of the catalogue's column
  double factor = 1;      ///< to the scene column's unit
};

/// Names in lower case under which catalogues often have a scene column, the likeliest first:
/// "raj2000", "alpha_j2000"... Magnitudes have those of the reference band ("sdss_r": "mag_r").
std::vector<std::string> usual_names(Column column, const std::string& reference_band);

/// The sources of all scene columns, by Column. A scene list and SkyMaker's have their own names.
/// In other catalogues a column is found by, in this order, the key of [catalogue], its own name,
/// its own name in any case, a usual name in any case. Throws InputError: unknown, repeated and
/// missing columns, units that do not fit.
std::vector<ColumnSource> find_columns(const Catalogue& catalogue,
                                       const RenderParameters& parameters);

}  // namespace gamer
