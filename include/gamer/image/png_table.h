#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// Tables of a PNG file, each in a chunk of its own before the pixels, of the private type "gaMR":
/// programs that do not know it pass over it, and drop it when they change the picture. (Texts
/// would be chunks that every program knows; some refuse files where they are large.) Its data are
/// the length of what follows when unpacked (64 bits, big-endian) and, in zlib's format,
/// netstrings without their commas, "<length>:<bytes>": the table's name, the number of columns,
/// their names, then the cells, row by row.
inline constexpr const char* png_table_chunk = "gaMR";

/// The chunk's data.
std::vector<unsigned char> pack_png_table(const TextTable& table);

/// The text table `name`. Throws InputError "<path>: ...": no PNG file, damaged, no such table.
TextTable read_png_table(const std::filesystem::path& path, const std::string& name);

/// Reads all chunks to the last (IEND), piece by piece, and compares them with their CRCs. Throws
/// InputError that names the chunk.
void check_png_sums(const std::filesystem::path& path);

}  // namespace gamer
