#include "gamer/image/fits/fits_stream.h"

#include <fitsio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "gamer/core/error.h"
#include "image/image_test_util.h"

namespace gamer::fits_stream_test {
namespace {

constexpr int image_width = 37, image_height = 11;

std::vector<double> values_of(const Plane& plane) {
  std::vector<double> values(static_cast<std::size_t>(plane.width()) * plane.height());
  plane.read(plane.whole(), values.data());
  return values;
}

/// Whether bits are equal; a NaN only needs to be a NaN.
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

std::vector<double> difficult(double first) {
  std::vector<double> values(image_width * image_height);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = first + static_cast<double>(i) / 8;
  values[3] = std::numeric_limits<double>::quiet_NaN();
  values[5] = std::numeric_limits<double>::infinity();
  values[7] = -0.0;
  values[9] = 1e-42;
  return values;
}

PlanePtr plane_of(std::vector<double> values) {
  return std::make_shared<MemoryPlane>(image_width, image_height, std::move(values));
}

/// Writes an image in tiles that do not divide it. No tile can be quantised, so that numbers are
/// packed unchanged. Returns the numbers.
template <class Number>
std::vector<double> write_tiles(const std::string& name, int method, int bitpix, int type,
                                bool has_sum) {
  std::vector<Number> numbers;
  for (int i = 0; i < 23 * 21; ++i) {
    numbers.push_back(
        static_cast<Number>(std::sin(12.9 * i) * std::pow(10, i % 60 - 30) * (i % 7 + 1)));
  }
  long sizes[] = {23, 21}, tile[] = {16, 16};
  fitsfile* file = nullptr;
  int status = 0;
  fits_create_diskfile(&file, name.c_str(), &status);
  fits_set_compression_type(file, method, &status);
  fits_set_tile_dim(file, 2, tile, &status);
  fits_set_quantize_level(file, 16, &status);
  fits_create_img(file, bitpix, 2, sizes, &status);
  fits_write_img(file, type, 1, static_cast<LONGLONG>(numbers.size()), numbers.data(), &status);
  fits_flush_file(file, &status);
  if (has_sum) fits_write_chksum(file, &status);
  fits_close_file(file, &status);
  EXPECT_EQ(status, 0);
  return {numbers.begin(), numbers.end()};
}

std::string message_of(const std::string& name) {
  try {
    const FitsInput input(name);
    for (std::size_t i = 0; i < input.hdus().size(); ++i) {
      for (int plane = 0; plane < input.hdus()[i].planes; ++plane) {
        values_of(*input.plane(i, plane));
      }
    }
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

class FitsStreamTest : public testing::TestWithParam<std::string> {
 protected:
  std::string name(const std::string& stem) const {
    return (folder_ / (stem + GetParam())).string();
  }

  TemporaryFolder folder_;
};

TEST_P(FitsStreamTest, PixelsAndHeadersComeBack) {
  for (const int bitpix : {-32, -64}) {
    std::vector<double> first = difficult(-20), second = difficult(7);
    FitsHeader header;
    header.set("OBJECT", std::string("M100"));
    FitsOutput output({name("a"), true});
    output.write(header, {plane_of(first), plane_of(second)}, bitpix, 2);
    header.set("EXTNAME", std::string("OTHER"));
    output.write(header, {plane_of(second)}, bitpix, 1);
    output.finish();
    expect_fitsverify_clean(name("a"));
    for (double& value : first) value = bitpix == -32 ? static_cast<float>(value) : value;
    for (double& value : second) value = bitpix == -32 ? static_cast<float>(value) : value;

    const FitsInput input(name("a"));
    std::vector<std::size_t> images;
    for (std::size_t i = 0; i < input.hdus().size(); ++i) {
      if (input.hdus()[i].is_image()) images.push_back(i);
    }
    ASSERT_EQ(images.size(), 2u);
    const FitsHdu& cube = input.hdus()[images[0]];
    EXPECT_EQ(cube.planes, 2);
    EXPECT_EQ(cube.width, image_width);
    EXPECT_EQ(cube.bitpix, bitpix);
    EXPECT_EQ(cube.header.text("OBJECT"), "M100");
    EXPECT_EQ(input.hdus()[images[1]].name, "OTHER");
    EXPECT_TRUE(same_bits(values_of(*input.plane(images[0], 0)), first));
    EXPECT_TRUE(same_bits(values_of(*input.plane(images[0], 1)), second));
    EXPECT_TRUE(same_bits(values_of(*input.plane(images[1], 0)), second));
    std::vector<double> part(6);
    input.plane(images[0], 1)->read({4, 6, 3, 2}, part.data());
    EXPECT_EQ(part[4], second[7 * image_width + 5]);
  }
}

TEST_P(FitsStreamTest, CopiesHdus) {
  FitsHeader header;
  header.set("OBJECT", std::string("M100"));
  FitsOutput output({name("a"), false});
  output.write(header, {plane_of(difficult(0))}, -64, 1);
  output.finish();
  const FitsInput input(name("a"));
  std::size_t image = 0;
  while (!input.hdus()[image].is_image()) ++image;
  FitsHeader edited = input.hdus()[image].header;
  edited.set("OBJECT", std::string("M51"));
  FitsOutput copy({name("b"), false});
  for (std::size_t i = 0; i < image; ++i) copy.copy(input, i);
  copy.copy(input, image, edited);
  copy.copy(input, image);
  copy.finish();
  expect_fitsverify_clean(name("b"));
  const FitsInput back(name("b"));
  ASSERT_EQ(back.hdus().size(), image + 2);
  EXPECT_EQ(back.hdus()[image].header.text("OBJECT"), "M51");
  EXPECT_EQ(back.hdus()[image + 1].header.text("OBJECT"), "M100");
  EXPECT_TRUE(same_bits(values_of(*back.plane(image, 0)), difficult(0)));
  EXPECT_TRUE(same_bits(values_of(*back.plane(image + 1, 0)), difficult(0)));
}

TEST_P(FitsStreamTest, CubesHaveAWavelengthAxis) {
  FitsOutput output({name("c"), false});
  output.write_cube({}, {plane_of(difficult(0)), plane_of(difficult(1)), plane_of(difficult(2))},
                    {4400, 5500, 8000}, -32, 1);
  output.finish();
  expect_fitsverify_clean(name("c"));
  const FitsInput input(name("c"));
  std::size_t image = 0;
  while (!input.hdus()[image].is_image()) ++image;
  EXPECT_EQ(input.hdus()[image].header.text("CTYPE3"), "PLANE");
  EXPECT_EQ(input.hdus()[image].header.number("WAVELEN3"), 8000);
}

INSTANTIATE_TEST_SUITE_P(All, FitsStreamTest, testing::Values(".fits", ".fits.fz"),
                         [](const auto& suffix) {
                           return suffix.param == ".fits" ? "Plain" : "Compressed";
                         });

TEST(FitsStream, Integers) {
  TemporaryFolder folder;
  const std::string name = folder / "int.fits";
  fitsfile* file = nullptr;
  int status = 0;
  long sizes[] = {3, 2};
  short values[] = {1, 2, 3, 4, 5, -32768};
  double zero = 32768, scale = 0.5;
  short blank = -32768;
  fits_create_diskfile(&file, name.c_str(), &status);
  fits_create_img(file, SHORT_IMG, 2, sizes, &status);
  fits_write_key(file, TDOUBLE, "BZERO", &zero, nullptr, &status);
  fits_write_key(file, TDOUBLE, "BSCALE", &scale, nullptr, &status);
  fits_write_key(file, TSHORT, "BLANK", &blank, nullptr, &status);
  fits_set_bscale(file, 1, 0, &status);
  fits_write_img(file, TSHORT, 1, 6, values, &status);
  fits_close_file(file, &status);
  ASSERT_EQ(status, 0);
  const FitsInput input(name);
  const std::vector<double> read = values_of(*input.plane(0, 0));
  EXPECT_EQ(read[4], 32770.5);
  EXPECT_TRUE(std::isnan(read[5]));
  EXPECT_EQ(input.hdus()[0].bitpix, -32);
  EXPECT_FALSE(input.hdus()[0].header.has("BZERO"));
  EXPECT_FALSE(input.hdus()[0].header.has("BLANK"));
}

TEST(FitsStream, FourAxes) {
  TemporaryFolder folder;
  const std::string name = folder / "four.fits";
  FitsOutput output({name, false});
  std::vector<PlanePtr> planes;
  for (int i = 0; i < 6; ++i) planes.push_back(plane_of(difficult(i)));
  output.write({}, planes, -32, 1, {2, 3});
  output.finish();
  const FitsInput input(name);
  EXPECT_EQ(input.hdus()[0].further_axes, (std::vector<long long>{2, 3}));
  EXPECT_EQ(input.hdus()[0].planes, 6);
  EXPECT_EQ(values_of(*input.plane(0, 5))[0], 5);
}

TEST(FitsStream, PlanesTooSmallForFloats) {
  TemporaryFolder folder;
  FitsOutput output({folder / "a.fits", true});
  // Values far below the peak may vanish as floats.
  std::vector<double> wings(image_width * image_height, 1e-60);
  wings[0] = 1;
  output.write({}, {plane_of(wings)}, -32, 1);
  wings[0] = 0;
  EXPECT_THROW(output.write({}, {plane_of(wings)}, -32, 1), RunError);
  FitsOutput zeros({folder / "b.fits", true});
  zeros.write({}, {plane_of(std::vector<double>(image_width * image_height))}, -32, 1);
}

TEST(FitsStream, ExtendedNames) {
  TemporaryFolder folder;
  const std::string name = folder / "a.fits";
  FitsOutput output({name, false});
  output.write({}, {plane_of(difficult(0))}, -64, 1);
  FitsHeader header;
  header.set("EXTNAME", std::string("SCI"));
  output.write(header, {plane_of(difficult(100))}, -64, 1);
  output.finish();
  for (const char* extension : {"[1]", "[SCI]"}) {
    const FitsInput input(name + extension);
    ASSERT_EQ(input.hdus().size(), 1u);
    EXPECT_EQ(input.hdus()[0].name, "SCI");
    EXPECT_TRUE(same_bits(values_of(*input.plane(0, 0)), difficult(100)));
  }
  const FitsInput section(name + "[SCI][3:5,2:3]");
  ASSERT_EQ(section.hdus().size(), 1u);
  EXPECT_EQ(section.hdus()[0].width, 3);
  EXPECT_EQ(values_of(*section.plane(0, 0))[1], difficult(100)[image_width + 3]);
  EXPECT_NE(message_of(name + "[SCI][*,*,2:2]").find("a section of the third axis"),
            std::string::npos);
}

TEST(FitsStream, Failures) {
  TemporaryFolder folder;
  const std::string good = folder / "good.fits", bad = folder / "bad.fits";
  FitsOutput output({good, false});
  output.write({}, {plane_of(difficult(0))}, -64, 1);
  output.finish();
  std::ifstream file(good, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const auto with = [&](const std::string& changed) {
    std::ofstream(bad, std::ios::binary) << changed;
    return message_of(bad);
  };
  EXPECT_EQ(message_of(folder / "none.fits"), (folder / "none.fits").string() + ": no such file");
  EXPECT_EQ(message_of(folder.path()), folder.path().string() + ": is a folder");
  EXPECT_EQ(with(""), bad + ": is no FITS file");
  EXPECT_EQ(with("P6 1 1 255"), bad + ": is no FITS file");
  EXPECT_NE(with(bytes.substr(0, 4000)).find("HDU 0 is cut off: it should end at byte"),
            std::string::npos);
  EXPECT_NE(with(bytes.substr(0, 400)), "");
  std::string large = bytes;
  const std::size_t naxis = large.find("NAXIS1  =") + 10;
  large.replace(naxis, 20, "          2000000000");
  EXPECT_NE(with(large).find("is cut off"), std::string::npos) << with(large);
  // The product of the sizes overflows 64 bits.
  std::string larger = bytes;
  larger.replace(larger.find("NAXIS1  =") + 10, 20, "          2147483647");
  larger.replace(larger.find("NAXIS2  =") + 10, 20, "          2147483647");
  EXPECT_EQ(with(larger), bad + ": HDU 0: its sizes cannot be");
  large.replace(naxis, 20, "          3000000000");
  EXPECT_NE(with(large), "");
  EXPECT_NE(message_of(good + "[7]"), "");
}

TEST(FitsStream, OutputsThatCannotBe) {
  TemporaryFolder folder;
  std::ofstream(folder / "there.fits") << "x";
  const auto message = [](const FitsOutputOptions& options) -> std::string {
    try {
      FitsOutput output(options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message({folder / "there.fits", false}).find("exists already; --overwrite replaces it"),
            std::string::npos);
  EXPECT_EQ(message({folder / "there.fits", true}), "");
  EXPECT_NE(message({folder / "x.txt", false}).find("must end in .fits or .fits.fz"),
            std::string::npos);
  EXPECT_NE(message({folder / "no/x.fits", false}).find("does not exist"), std::string::npos);
  // An unfinished output leaves nothing, and an existing file remains.
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(FitsStream, NumbersBeyondFloats) {
  TemporaryFolder folder;
  std::vector<double> values = difficult(0);
  values[20] = 1e39;
  FitsOutput output({folder / "a.fits", false});
  EXPECT_THROW(output.write({}, {plane_of(values)}, -32, 1), RunError);
}

TEST(FitsTiles, OfNumbersThatCannotBeQuantised) {
  const TemporaryFolder folder;
  const std::string name = (folder / "a.fits").string();
  for (const int method : {RICE_1, GZIP_1, GZIP_2}) {
    for (const bool has_sum : {false, true}) {
      for (const int bitpix : {-32, -64}) {
        std::filesystem::remove(name);
        const std::vector<double> values =
            bitpix == -32 ? write_tiles<float>(name, method, bitpix, TFLOAT, has_sum)
                          : write_tiles<double>(name, method, bitpix, TDOUBLE, has_sum);
        const FitsInput input(name);
        EXPECT_TRUE(same_bits(values_of(*input.plane(1, 0)), values)) << method << ' ' << bitpix;
      }
      // CFITSIO packs such a tile, but cannot read it.
      std::filesystem::remove(name);
      write_tiles<float>(name, method, -64, TFLOAT, has_sum);
      EXPECT_EQ(message_of(name),
                name + ": HDU 1: tile 1 holds 1024 bytes; its 256 pixels need 2048");
    }
  }
}

}  // namespace
}  // namespace gamer::fits_stream_test
