#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "gamer/image/fits/record_names.h"
#include "processing/operation_fixture.h"

namespace gamer::file_operations_test {
namespace {

class FileOperations : public SmallFiles {
 protected:
  FileOperations() {
    write("in.fits",
          {{{even(1)}, {{"EXTNAME", std::string("Sci"), ""}, {"OBJECT", std::string("M1"), ""}}},
           {{even(2)}, {{"EXTNAME", std::string("other"), ""}}}});
  }

  std::optional<Card> set(const std::string& setting, const std::string& key) const {
    run({"header", "--set", setting, "in.fits", "out.fits"});
    return file().hdus()[0].header.card(key);
  }
};

// ---- header ------------------------------------------------------------------------------------

TEST_F(FileOperations, KeysThatNameNoCard) {
  for (const std::string setting :
       {"A B=1", "A.B=1", "X$Y=x", "X?=3", "CONTINUE=3", "hierarch=2", "HIERARCH A B=3"}) {
    const std::string message = error({"header", "--set", setting, "in.fits", "out.fits"});
    EXPECT_TRUE(message.starts_with("gutil header: --set '" + setting + "': ")) << message;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out.fits"));
  }
  for (const std::string setting : {"A-B_9=1", "LONGKEYWORD=2"}) {
    EXPECT_EQ(error({"header", "--set", setting, "in.fits", "out.fits"}), "none") << setting;
  }
}

TEST_F(FileOperations, ValuesInQuotes) {
  EXPECT_EQ(std::get<std::string>(set("NAME='O''Brien' / who", "NAME")->value), "O'Brien");
  EXPECT_EQ(set("NAME='O''Brien' / who", "NAME")->comment, "who");
  EXPECT_EQ(std::get<std::string>(set("NAME='a / b' / c", "NAME")->value), "a / b");
  EXPECT_EQ(std::get<std::string>(set("NAME='12'", "NAME")->value), "12");
  EXPECT_EQ(std::get<std::string>(set("NAME='tis", "NAME")->value), "'tis");
  EXPECT_EQ(std::get<long long>(set("NAME=12 / dozen", "NAME")->value), 12);
}

TEST_F(FileOperations, CommentsAreTextAlone) {
  run({"header", "--set", "COMMENT=see x / y", "in.fits", "out.fits"});
  const FitsInput output = file();
  bool is_there = false;
  for (const std::string& record : output.hdus()[0].header.records()) {
    is_there = is_there || record.starts_with("COMMENT see x / y  ");
  }
  EXPECT_TRUE(is_there);
}

TEST_F(FileOperations, HdusInAnyCase) {
  for (const char* name : {"OTHER", "Other"}) {
    run({"header", "--hdu", name, "--set", "A=1", "in.fits", "out.fits"});
    EXPECT_FALSE(file().hdus()[0].header.has("A"));
    EXPECT_TRUE(file().hdus()[1].header.has("A"));
  }
  run({"header", "--hdu", "All", "--set", "A=1", "in.fits", "out.fits"});
  EXPECT_TRUE(file().hdus()[0].header.has("A"));
  EXPECT_TRUE(file().hdus()[1].header.has("A"));
}

TEST_F(FileOperations, OptionsThatDoNotGoTogether) {
  EXPECT_EQ(error({"header", "--from", "in.fits", "--set", "A=1", "in.fits", "out.fits"}),
            "gutil header: --from goes with --copy, which names the cards");
  EXPECT_EQ(error({"header", "--get", "OBJECT", "--set", "A=1", "in.fits", "out.fits"}),
            "gutil header: --get prints and --set, --delete and --copy write a file; give one of "
            "them");
}

// ---- stack -------------------------------------------------------------------------------------

TEST_F(FileOperations, CardsOfADetectorStayWithTheirPlane) {
  write("cube.fits", {{{even(1), even(2)},
                       {{"BAND1", std::string("g"), ""},
                        {"BAND2", std::string("r"), ""},
                        {"GAIN1", 2.0, ""},
                        {"GAIN2", 3.0, ""},
                        {"SATURATE1", 10.0, ""},
                        {"SATURATE2", 20.0, ""},
                        {"RDNOISE", 5.0, ""}}}});
  run({"stack", "--layout", "files", "cube.fits", "out.fits"});
  const FitsInput red = file("out_r.fits");
  EXPECT_EQ(red.hdus()[0].header.number("GAIN"), 3);
  EXPECT_EQ(red.hdus()[0].header.number("SATURATE"), 20);
  EXPECT_EQ(red.hdus()[0].header.number("RDNOISE"), 5);
  EXPECT_FALSE(red.hdus()[0].header.has("GAIN1"));
  run({"stack", "out_r.fits", "out_g.fits", "out.fits"});
  const FitsInput cube = file();
  EXPECT_EQ(cube.hdus()[0].header.number("GAIN1"), 3);
  EXPECT_EQ(cube.hdus()[0].header.number("GAIN2"), 2);
  EXPECT_FALSE(cube.hdus()[0].header.has("GAIN"));
}

/// Integral field spectrographs write such cubes, without WAVELEN cards.
TEST_F(FileOperations, WavelengthsOfALinearAxis) {
  write("muse.fits", {{{even(1), even(2), even(3)},
                       {{"CTYPE3", std::string("AWAV"), ""},
                        {"CUNIT3", std::string("nm"), ""},
                        {"CRPIX3", 1.0, ""},
                        {"CRVAL3", 600.0, ""},
                        {"CDELT3", -50.0, ""}}}});
  run({"stack", "--order", "wavelength", "muse.fits", "out.fits"});
  const FitsInput cube = file();
  for (int plane = 0; plane < 3; ++plane) {
    EXPECT_EQ(pixel(cube, 0, plane), 3 - plane);
    EXPECT_NEAR(*cube.hdus()[0].header.number("WAVELEN" + std::to_string(plane + 1)),
                5000 + 500 * plane, 1e-9);
  }
  run({"stack", "--layout", "files", "muse.fits", "out.fits"});
  EXPECT_NEAR(*file("out_5500A.fits").hdus()[0].header.number("WAVELEN1"), 5500, 1e-9);
}

// ---- Records -----------------------------------------------------------------------------------

class Records : public SmallFiles {
 protected:
  Records() {
    for (const char* name : {"a.fits", "b.fits.fz"}) {
      ImageHeader header = test_header(9, 7, {4400, 5500});
      header.cards = {{"HIERARCH GAMER IMAGE SIZE", std::string("[9, 7]"), ""},
                      {"OBJECT", std::string("M1"), ""}};
      header.tables = {{record_table_name, {"NAME", "TEXT"}, {{"render.par", "size = 3"}}, {}},
                       {"SCENE", {"galaxy"}, {{"spiral"}}, {}}};
      write_test_image({folder_ / name, -32, ImageLayout::cube, true}, header);
    }
  }

  /// The parts of the record in out.fits.
  std::string parts() const {
    std::string found;
    bool has_object = false, has_scene = false;
    const FitsInput output = file();
    for (const FitsHdu& hdu : output.hdus()) {
      if (hdu.name == record_table_name) found += " table";
      if (hdu.header.has("GAMER IMAGE SIZE")) found += " card";
      has_object = has_object || hdu.header.has("OBJECT");
      has_scene = has_scene || hdu.name == "SCENE";
    }
    EXPECT_TRUE(has_object && has_scene);
    return found;
  }
};

TEST_F(Records, StayWithOneImage) {
  for (const char* name : {"a.fits", "b.fits.fz"}) {
    run({"scale", "--factor", "2", name, "out.fits"});
    EXPECT_EQ(parts(), " card table");
  }
}

TEST_F(Records, AreDroppedWhereImagesAreCombined) {
  for (const char* name : {"a.fits", "b.fits.fz"}) {
    run({"stack", name, "a.fits", "out.fits"});
    EXPECT_EQ(parts(), "");
    run({"stack", "--planes", "2", name, "out.fits"});
    EXPECT_EQ(parts(), "");
    run({"add", name, "a.fits", "out.fits"});
    EXPECT_EQ(parts(), "");
  }
}

}  // namespace
}  // namespace gamer::file_operations_test
