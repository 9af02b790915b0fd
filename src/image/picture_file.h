#pragma once

#include <filesystem>

#include "gamer/image/picture.h"

namespace gamer {

/// As write_png() and write_bmp(); RunError also when the file exists and may not be overwritten.
void write_png_file(const std::filesystem::path& path, const Picture& picture, bool overwrite);
void write_bmp_file(const std::filesystem::path& path, const Picture& picture, bool overwrite);

}  // namespace gamer
