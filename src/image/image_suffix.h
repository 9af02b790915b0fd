#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace gamer {

enum class ImageSuffix { fits, fits_compressed, png, bmp };

/// The format that the name's suffix selects; nothing for an unknown suffix.
std::optional<ImageSuffix> image_suffix(const std::filesystem::path& path);

/// The suffix as written: ".fits", ".fits.fz", ".png", ".bmp"; "" where it is unknown.
std::string image_suffix_text(const std::filesystem::path& path);

}  // namespace gamer
