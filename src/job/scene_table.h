#pragma once

#include <string>
#include <string_view>

#include "gamer/core/resources.h"
#include "gamer/image/data_table.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// Records data of the catalogue that the scene's list lacks: other columns, and the number of
/// flagged rows. The other columns are those in the resources, for the scene's rows. Row numbers 1,
/// 2, 3... alone are left out unless `always`.
void record_other_columns(Scene& scene, bool always, const std::string& label,
                          Resources& resources);

/// The table SCENE has a row per object of the list. It has the columns of the list in their units,
/// then those of the recorded text `others`. Without this text (null) the row's number follows.
/// Where a row gives no number, the table has the column's default, or NaN without a default.
DataTable scene_table(const Scene& scene, const Resources::Text* others,
                      const RenderParameters& parameters);

/// The card NSKIPPED from its recorded number.
Card flagged_card(std::string_view number);

}  // namespace gamer
