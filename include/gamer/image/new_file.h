#pragma once

#include <filesystem>

namespace gamer {

/// Before work begins: throws InputError "output '<path>': ..." where such a file cannot be made:
/// its folder does not exist or cannot be written, a folder has that name, or a file exists that
/// may not be overwritten. Nothing that stands there changes.
void check_new_file(const std::filesystem::path& path, bool overwrite);

}  // namespace gamer
