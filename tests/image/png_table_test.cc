#include "gamer/image/png_table.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "core/error_text.h"
#include "gamer/core/error.h"
#include "gamer/image/picture.h"
#include "image/image_test_util.h"
#include "image/read_png.h"

namespace gamer::png_table_test {
namespace {

TextTable some_table(const std::string& name) {
  // The table has arbitrary bytes, and one cell that packs well.
  return {
      name, {"A", ""}, {{"1", std::string("\0\xff 7:", 6)}, {"", std::string(100000, 'x')}}, {}};
}

void write(const std::filesystem::path& path, const std::vector<TextTable>& tables) {
  PictureFileOptions options;
  options.name = path.string();
  for (const TextTable& table : tables) options.tables.push_back(pack_png_table(table));
  PictureFile file(options, 2, 1);
  const std::uint16_t row[] = {1, 2, 3, 40000, 50000, 65535};
  file.write_row(row);
  file.finish();
}

class PngTableTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "x.png";
};

TEST_F(PngTableTest, IsReadAsItWasWritten) {
  write(path_, {some_table("FIRST"), some_table("SECOND")});
  const TextTable table = read_png_table(path_, "SECOND");
  EXPECT_EQ(table.name, "SECOND");
  EXPECT_EQ(table.columns, some_table("").columns);
  EXPECT_EQ(table.rows, some_table("").rows);
  EXPECT_LT(std::filesystem::file_size(path_), 1000u);
  // Other programs see only the picture.
  const ReadPng picture = read_png(path_);
  EXPECT_EQ(picture.values, (std::vector<std::uint16_t>{1, 2, 3, 40000, 50000, 65535}));
  EXPECT_EQ(picture.texts.size(), 1u);
}

TEST_F(PngTableTest, MissingTablesAndOtherFiles) {
  write(path_, {some_table("FIRST")});
  EXPECT_NE(error_text([&] { read_png_table(path_, "INPUTS"); }).find("no table 'INPUTS' in it"),
            std::string::npos);
  EXPECT_EQ(error_text([&] { read_png_table("/dev/null", "A"); }), "/dev/null: not a regular file");
  EXPECT_EQ(error_text([&] { read_png_table(folder_.path() / "no.png", "A"); }),
            (folder_.path() / "no.png").string() + ": there is no such file");
  std::ofstream(path_) << "text";
  EXPECT_EQ(error_text([&] { read_png_table(path_, "A"); }), path_.string() + ": not a PNG file");
}

TEST_F(PngTableTest, DamageIsFound) {
  write(path_, {some_table("A")});
  std::ifstream file(path_, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const std::size_t begin = bytes.find(png_table_chunk), end = bytes.find("IDAT");
  ASSERT_LT(begin, end);
  for (std::size_t i = begin - 4; i < end - 4; ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x20);
    std::ofstream(path_, std::ios::binary) << damaged;
    EXPECT_THROW(read_png_table(path_, "A"), InputError) << i;
    std::ofstream(path_, std::ios::binary) << bytes.substr(0, i);
    EXPECT_THROW(read_png_table(path_, "A"), InputError) << i;
  }
}

}  // namespace
}  // namespace gamer::png_table_test
