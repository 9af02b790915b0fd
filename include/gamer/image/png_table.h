#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// Type of the private PNG chunk that holds one table, before the pixels. Other programs skip it,
/// and drop it when they change the picture. (A text chunk is known to every program, and some
/// refuse files with large ones.) The chunk's data are the length of the unpacked content (64 bits,
/// big-endian), then the content in zlib's format. The content is netstrings without commas,
/// "<length>:<bytes>": the table's name, the number of columns, their names, then the cells, row by
/// row.
inline constexpr const char* png_table_chunk = "gaMR";

/// The data of the table's chunk.
std::vector<unsigned char> pack_png_table(const TextTable& table);

/// Reads the table `name`. Throws InputError "<path>: ..." for a file that is no PNG, is damaged or
/// has no such table.
TextTable read_png_table(const std::filesystem::path& path, const std::string& name);

/// Reads all chunks piece by piece up to the last (IEND) and compares them with their CRCs. Throws
/// InputError that names the chunk.
void check_png_sums(const std::filesystem::path& path);

}  // namespace gamer
