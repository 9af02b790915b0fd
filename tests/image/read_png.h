#pragma once

#include <gtest/gtest.h>
#include <png.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gamer {

/// A PNG file as libpng reads it.
struct ReadPng {
  int width = 0, height = 0, bits = 0, colour_type = 0;
  bool is_srgb = false;
  std::map<std::string, std::string> texts;
  std::vector<std::uint16_t> values;  ///< row 0 is the top; 8 or 16 bits

  int at(int x, int row, int channel) const {
    return values[(static_cast<std::size_t>(row) * width + x) * 3 + channel];
  }
};

inline ReadPng read_png(const std::filesystem::path& path) {
  ReadPng result;
  std::FILE* file = std::fopen(path.c_str(), "rb");
  EXPECT_NE(file, nullptr) << path;
  if (file == nullptr) return result;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  result.width = static_cast<int>(png_get_image_width(png, info));
  result.height = static_cast<int>(png_get_image_height(png, info));
  result.bits = png_get_bit_depth(png, info);
  result.colour_type = png_get_color_type(png, info);
  result.is_srgb = png_get_valid(png, info, PNG_INFO_sRGB) != 0;
  png_textp text = nullptr;
  const int texts = png_get_text(png, info, &text, nullptr);
  for (int i = 0; i < texts; ++i) result.texts[text[i].key] = text[i].text;
  png_bytepp rows = png_get_rows(png, info);
  for (int row = 0; row < result.height; ++row) {
    for (int i = 0; i < 3 * result.width; ++i) {
      // The first byte is the higher one.
      result.values.push_back(static_cast<std::uint16_t>(
          result.bits == 16 ? rows[row][2 * i] << 8 | rows[row][2 * i + 1] : rows[row][i]));
    }
  }
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
  return result;
}

}  // namespace gamer
