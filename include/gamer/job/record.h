#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/image/fits/record_names.h"
#include "gamer/image/image.h"

namespace gamer {

/// All texts from which a job is made. Other ranks get the record as one string, and the FITS file
/// holds it as a table.
using Record = std::vector<Resources::Text>;

/// Name of the text with the resolved parameters.
inline constexpr const char* recorded_parameters = "render.par";

/// Name of the text with the scene's list.
inline constexpr const char* recorded_scene = "scene.lst";

/// Name of the text with the catalogue's columns that the list lacks, as ECSV (Scene::others).
inline constexpr const char* recorded_columns = "scene.ecsv";

/// Name of the text with the number of rows that catalogue.skip_flagged left out.
inline constexpr const char* recorded_flagged = "scene.flagged";

/// The text of this name; null if there is none.
const Resources::Text* find_text(const Record& record, std::string_view name);
Resources::Text* find_text(Record& record, std::string_view name);
/// The text of this name. Throws InputError if there is none.
const Resources::Text& text_of(const Record& record, std::string_view name);

std::string pack_record(const Record& record);
/// Packs a record in pieces, without copying the texts.
void pack_record(const Record& record, const std::function<void(std::string_view)>& take);
/// Unpacks a record of pack_record(). Throws RunError if `packed` is something else.
Record unpack_record(std::string_view packed);

/// The record as a table with columns NAME, LABEL, TEXT and one row per text.
TextTable record_table(const Record& record);
/// The record in such a table. Throws InputError if its columns have other names.
Record record_from_table(const TextTable& table);

/// Whether images with this file name hold the record of their job, as FITS files and PNG pictures
/// do.
bool keeps_record(const std::filesystem::path& image);
/// The record in an image's file. Throws InputError if the file holds none.
Record read_record(const std::filesystem::path& image);

}  // namespace gamer
