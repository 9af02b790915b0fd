#pragma once

#include <cstdint>
#include <utility>

#include "gamer/image/image.h"
#include "gamer/image/picture_style.h"

namespace gamer {

/// A BMP file gives its size in 32 bits.
inline constexpr std::uint64_t largest_bmp = 0xFFFFFFFF;
/// Size of a BMP file, bytes.
std::uint64_t bmp_bytes(int width, int height);

/// Width and height of an image's picture: of all its faces together, or of the image.
std::pair<int, int> picture_extent(const ImageHeader& header);

/// Memory that a picture's writer takes from the first row to the finished file, bytes.
std::uint64_t picture_memory(int width, int height, int planes, const PictureStyle& style);

}  // namespace gamer
