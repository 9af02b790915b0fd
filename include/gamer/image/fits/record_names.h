#pragma once

#include <string_view>

namespace gamer {

// An image's record, from which `gamer --from-header` makes it again.

/// EXTNAME of the table with the texts.
inline constexpr const char* record_table_name = "INPUTS";
/// Keys of the cards with the resolved parameters begin so, behind HIERARCH.
inline constexpr std::string_view record_key_stem = "GAMER ";

}  // namespace gamer
