#pragma once

#include <filesystem>

namespace gamer {

/// Checks, before work begins, that a file can be made; changes nothing. Throws InputError "output
/// '<path>': ..." where its folder is missing or not writable, a folder has that name, or an
/// existing file must not be overwritten.
void check_new_file(const std::filesystem::path& path, bool overwrite);

/// Whether a file, folder or link, even a broken one, has this path.
bool is_there(const std::filesystem::path& path);

}  // namespace gamer
