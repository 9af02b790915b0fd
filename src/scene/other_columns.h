#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "gamer/image/data_table.h"
#include "gamer/scene/catalogue.h"
#include "scene/column_sources.h"

namespace gamer {

/// The columns of a catalogue that serve as no column of a scene, in the given rows. The first
/// column is `row`, the row of the catalogue from 1.
///
/// Words are integers or numbers where all of them are, unless the file says that they are texts.
/// Words with leading zeros are texts. Names differ from each other, and from those of a scene's
/// columns, by more than case. A name that breaks this rule gets the prefix "cat_". Characters of
/// names other than ASCII letters and digits become "_", as FITS wants them, and so do characters
/// of units that are not printable ASCII. Names are cut after 60 characters, and an empty name
/// becomes "column". At most 950 columns are kept, so that a FITS table can hold all.
DataTable other_columns(const Catalogue& catalogue, std::span<const ColumnSource> sources,
                        std::span<const std::size_t> rows);

/// The given rows of all columns of a catalogue, as numbers or texts, with their own names.
DataTable table_of(const Catalogue& catalogue, std::span<const std::size_t> rows);

/// Identifiers as integers where all words are written as integers, else as texts.
decltype(DataColumn::values) integers_or_texts(std::vector<std::string> words);

}  // namespace gamer
