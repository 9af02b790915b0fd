#pragma once

#include <cstdint>

namespace gamer {

/// Size of a BMP file, bytes.
std::uint64_t bmp_bytes(int width, int height);

/// Memory that a picture's writer takes, bytes, from the first row to the finished file.
std::uint64_t picture_memory(int width, int height, int planes);

}  // namespace gamer
