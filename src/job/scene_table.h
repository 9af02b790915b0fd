#pragma once

#include <string>
#include <string_view>

#include "gamer/core/resources.h"
#include "gamer/image/data_table.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// Records what the scene's list lacks of the catalogue: its other columns, and the number of
/// flagged rows. Where the resources hold the columns of the catalogue that the scene was read
/// from, the scene's rows of these are recorded. Columns that say nothing, rows 1, 2, 3..., are
/// left out unless `always`.
void record_other_columns(Scene& scene, bool always, const std::string& label,
                          Resources& resources);

/// The table SCENE: a row per object of the list, with the columns of the list in their units and
/// then those of the recorded text `others` (null: the row's number). A number without a value is
/// its column's default, or NaN where there is none.
DataTable scene_table(const Scene& scene, const Resources::Text* others,
                      const RenderParameters& parameters);

/// The card NSKIPPED from its recorded number.
Card flagged_card(std::string_view number);

}  // namespace gamer
