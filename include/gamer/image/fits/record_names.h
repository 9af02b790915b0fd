#pragma once

#include <string_view>

namespace gamer {

// Names of the record in an image, from which `gamer --from-header` makes the image again.

/// EXTNAME of the table with the texts.
inline constexpr const char* record_table_name = "INPUTS";
/// First word, after HIERARCH, of the keys of cards with the resolved parameters.
inline constexpr std::string_view record_key_stem = "GAMER ";

}  // namespace gamer
