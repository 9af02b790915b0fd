#pragma once

#include <string>
#include <string_view>

#include "scene/text_rows.h"

namespace gamer {

// One reader per text format; all throw InputError with line and column.
TextCatalogue read_plain(std::string_view text, const std::string& label, bool has_commas);
/// `table` is the name, the ID or the number (from 1) of a TABLE; if it is empty, the first is
/// read.
TextCatalogue read_votable(std::string_view text, const std::string& label,
                           const std::string& table);
TextCatalogue read_ecsv(std::string_view text, const std::string& label);
TextCatalogue read_sextractor(std::string_view text, const std::string& label);
TextCatalogue read_skymaker(std::string_view text, const std::string& label);

/// The text format of `text`.
CatalogueFormat detect_format(std::string_view text);

/// Whether a text or a line begins a table of that format.
bool opens_xml(std::string_view text);
bool opens_ecsv(std::string_view line);
bool opens_sextractor(std::string_view line);
/// Whether these words are a first row of SkyMaker's format.
bool opens_skymaker(const std::vector<LineWord>& words);

}  // namespace gamer
