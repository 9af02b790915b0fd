#include "processing/plane_operation.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "processing/operation_fixture.h"

namespace gamer::plane_operation_test {
namespace {

/// Two images of two planes with their variances, as gutil noise writes them: 3 and 5 with the
/// variances 0.5 and 0.25, then 7 and 9 with 2 and 4.
class Variances : public SmallFiles {
 protected:
  Variances() { write("in.fits", hdus("nJy")); }

  static std::vector<SmallHdu> hdus(const std::string& unit) {
    const auto cards = [&](const char* name, const std::string& own_unit) {
      return std::vector<Card>{{"EXTNAME", std::string(name), ""}, {"BUNIT", own_unit, ""}};
    };
    std::vector<Card> calibrated = cards("A", unit);
    calibrated.push_back({"MAGZERO", 31.4, ""});
    const std::string squares = squared_unit(unit);
    return {{{even(3), even(5)}, calibrated},
            {{even(0.5), even(0.25)}, cards("A_VARIANCE", squares)},
            {{even(7), even(9)}, cards("B", unit)},
            {{even(2), even(4)}, cards("B_VARIANCE", squares)}};
  }

  /// Compares one pixel of both planes in all HDUs.
  void expect_pixels(const std::vector<std::vector<double>>& expected) const {
    const FitsInput output = file();
    ASSERT_EQ(output.hdus().size(), expected.size());
    for (std::size_t hdu = 0; hdu < expected.size(); ++hdu) {
      for (int plane = 0; plane < 2; ++plane) {
        EXPECT_DOUBLE_EQ(pixel(output, hdu, plane), expected[hdu][static_cast<std::size_t>(plane)])
            << hdu << " " << plane;
      }
    }
  }
};

TEST_F(Variances, ScaleBySquares) {
  run({"scale", "--factor", "-3", "--offset", "1", "in.fits", "out.fits"});
  expect_pixels({{-8, -14}, {4.5, 2.25}, {-20, -26}, {18, 36}});
  EXPECT_EQ(file().hdus()[1].header.text("BUNIT"), "nJy2");
  // Each plane of light has its own factor.
  run({"scale", "--factor", "1,2,3,4", "in.fits", "out.fits"});
  expect_pixels({{3, 10}, {0.5, 1}, {21, 36}, {18, 64}});
  run({"scale", "--factor", "0.5", "--unit", "uJy", "in.fits", "out.fits"});
  EXPECT_EQ(file().hdus()[0].header.text("BUNIT"), "uJy");
  EXPECT_EQ(file().hdus()[1].header.text("BUNIT"), "uJy2");
  EXPECT_EQ(error({"scale", "--factor", "1,2,3,4,5,6,7,8", "in.fits", "out.fits"}),
            "gutil scale: --factor has 8 values for 4 planes; give one, or one for each");
}

TEST_F(Variances, AreNotMeasured) {
  // The total is that of 3, 5, 7 and 9, in 8 pixels each.
  run({"normalise", "--total", "96", "in.fits", "out.fits"});
  expect_pixels({{1.5, 2.5}, {0.125, 0.0625}, {3.5, 4.5}, {0.5, 1}});
  EXPECT_FALSE(file().hdus()[1].header.has("BUNIT"));
  run({"normalise", "--peak", "1", "--per", "plane", "in.fits", "out.fits"});
  expect_pixels({{1, 1}, {0.5 / 9, 0.25 / 25}, {1, 1}, {2.0 / 49, 4.0 / 81}});
}

TEST_F(Variances, MoveWithPixelsAndAddUp) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"flip", "--axis", "x"},
                                                  {"crop", "--box", "1,3,1,2"},
                                                  {"rotate", "--angle", "-180"}}) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"in.fits", "out.fits"});
    run(words);
    expect_pixels({{3, 5}, {0.5, 0.25}, {7, 9}, {2, 4}});
  }
  run({"pad", "--margin", "2", "--fill", "6", "in.fits", "out.fits"});
  expect_pixels({{6, 6}, {0, 0}, {6, 6}, {0, 0}});
  run({"bin", "--factor", "2,1", "in.fits", "out.fits"});
  expect_pixels({{6, 10}, {1, 0.5}, {14, 18}, {4, 8}});
  write("in.fits", hdus("MJy/sr"));
  run({"bin", "--factor", "2,1", "in.fits", "out.fits"});
  expect_pixels({{3, 5}, {0.25, 0.125}, {7, 9}, {1, 2}});
}

TEST_F(Variances, OfSums) {
  run({"subtract", "in.fits", "in.fits", "out.fits"});
  expect_pixels({{0, 0}, {1, 0.5}, {0, 0}, {4, 8}});
  run({"average", "in.fits", "in.fits", "out.fits"});
  expect_pixels({{3, 5}, {0.25, 0.125}, {7, 9}, {1, 2}});
  // A file without variances counts as exact.
  write("one.fits", {{{even(1)}, {{"BUNIT", std::string("nJy"), ""}}}});
  run({"add", "in.fits", "one.fits", "out.fits"});
  expect_pixels({{4, 6}, {0.5, 0.25}, {8, 10}, {2, 4}});
  EXPECT_NE(error({"multiply", "in.fits", "one.fits", "out.fits"}), "none");
}

TEST_F(Variances, AreRefusedWhereTheyDoNotFollow) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"convolve", "--psf", "gaussian", "--fwhm", "2"},
        {"rotate", "--angle", "30"},
        {"resample", "--factor", "2"},
        {"gamma", "--gamma", "0.5"},
        {"stretch"},
        {"noise", "--sigma", "1"}}) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"in.fits", "out.fits"});
    EXPECT_EQ(error(words),
              "gutil " + command[0] +
                  ": in.fits[A_VARIANCE] holds variances, which do not follow; take the image "
                  "alone: \"in.fits[0]\"");
    words[words.size() - 2] = "in.fits[0]";
    EXPECT_EQ(error(words), "none");
    // Alone, the variances are an image like any other.
    words[words.size() - 2] = "in.fits[1]";
    EXPECT_EQ(error(words), "none");
  }
}

TEST_F(Variances, OfOtherShape) {
  std::vector<SmallHdu> wrong = hdus("nJy");
  wrong[1].planes.pop_back();
  write("wrong.fits", wrong);
  EXPECT_EQ(error({"scale", "--factor", "2", "wrong.fits", "out.fits"}),
            "gutil scale: wrong.fits[A_VARIANCE] holds 1 planes of variances, the image before 2");
}

TEST_F(Variances, AreLeftOutOfStacks) {
  run({"stack", "in.fits", "out.fits"});
  const FitsInput cube = file();
  ASSERT_EQ(cube.hdus()[0].planes, 4);
  EXPECT_EQ(pixel(cube, 0, 1), 5);
  EXPECT_EQ(pixel(cube, 0, 2), 7);
}

TEST_F(Variances, AreLeftOutOfPictures) {
  std::vector<SmallHdu> image = hdus("nJy");
  image.resize(2);
  for (SmallHdu& hdu : image) hdu.planes.push_back(even(1));
  write("rgb.fits", image);
  const Operation& rgb = find_operation("rgb");
  const std::vector<std::string> words = {"--method",
                                          "plain",
                                          "--minimum",
                                          "0",
                                          "--maximum",
                                          "10",
                                          (folder_ / "rgb.fits").string(),
                                          (folder_ / "out.png").string()};
  EXPECT_EQ(rgb.run(parse_call(rgb, words)), 0);
}

// ---- Units -------------------------------------------------------------------------------------

class Units : public SmallFiles {
 protected:
  void write_unit(const std::string& name, const std::string& unit, double zero_point) const {
    write(name,
          {{{even(2)}, {{"BUNIT", unit, ""}, {"MAGZERO", zero_point, ""}, {"GAIN", 3.0, ""}}}});
  }
};

TEST_F(Units, SumsAreOfOneZeroPoint) {
  write_unit("a.fits", "nJy", 31.4);
  write_unit("b.fits", "nJy", 31.4 + 5e-7);
  write_unit("c.fits", "nJy", 31.5);
  for (const char* operation : {"add", "subtract", "average"}) {
    EXPECT_EQ(error({operation, "a.fits", "b.fits", "out.fits"}), "none");
    EXPECT_EQ(error({operation, "a.fits", "c.fits", "out.fits"}),
              std::string("gutil ") + operation +
                  ": MAGZERO of c.fits is 31.5, of a.fits 31.4; gutil scale --unit makes them the "
                  "same");
  }
}

TEST_F(Units, OfProducts) {
  write_unit("a.fits", "nJy", 31.4);
  write_unit("b.fits", "s", 20);
  write("flat.fits", {{{even(2)}, {}}});
  run({"multiply", "a.fits", "b.fits", "out.fits"});
  EXPECT_EQ(file().hdus()[0].header.text("BUNIT"), "nJy s");
  EXPECT_FALSE(file().hdus()[0].header.has("MAGZERO"));
  EXPECT_FALSE(file().hdus()[0].header.has("GAIN"));
  run({"multiply", "a.fits", "flat.fits", "out.fits"});
  EXPECT_EQ(file().hdus()[0].header.text("BUNIT"), "nJy");
  EXPECT_EQ(file().hdus()[0].header.number("MAGZERO"), 31.4);
}

TEST_F(Units, MagnitudesDoNotAddUp) {
  write_unit("mag.fits", "mag(AB)", 0);
  for (const std::vector<std::string>& command : {std::vector<std::string>{"add", "mag.fits"},
                                                  {"bin", "--factor", "2"},
                                                  {"resample", "--factor", "2"},
                                                  {"noise", "--sigma", "1"},
                                                  {"normalise", "--peak", "1"}}) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"mag.fits", "out.fits"});
    EXPECT_EQ(error(words), "gutil " + command[0] +
                                ": the pixels of mag.fits are magnitudes (mag(AB)), which do not "
                                "add up; a flux or surface brightness is needed");
  }
}

TEST_F(Units, ADetectorWithoutFullWellHasNoSaturation) {
  write("in.fits", {{{even(1), even(2)}, {{"SATURATE", 4.0, ""}, {"SATURATE2", 3.0, ""}}}});
  run({"noise", "--exposure", "10", "--electrons-per-unit", "2", "in.fits", "out.fits"});
  EXPECT_FALSE(file().hdus()[0].header.has("SATURATE"));
  EXPECT_FALSE(file().hdus()[0].header.has("SATURATE2"));
}

TEST_F(Units, StretchedPixelsHaveNoGain) {
  write("in.fits", {{{{0, 1, 2, 3, 4, 5, 6, 7}, {1, 2, 3, 4, 5, 6, 7, 8}},
                     {{"GAIN", 3.0, ""}, {"SATURATE2", 4.0, ""}, {"MAGZERO", 31.4, ""}}}});
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"gamma", "--gamma", "0.5"}, {"stretch"}}) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"in.fits", "out.fits"});
    run(words);
    for (const char* key : {"GAIN", "SATURATE2", "MAGZERO"}) {
      EXPECT_FALSE(file().hdus()[0].header.has(key)) << key;
    }
  }
  run({"normalise", "--peak", "16", "in.fits", "out.fits"});
  EXPECT_EQ(file().hdus()[0].header.number("GAIN"), 1.5);
  EXPECT_EQ(file().hdus()[0].header.number("SATURATE2"), 8);
}

}  // namespace
}  // namespace gamer::plane_operation_test
