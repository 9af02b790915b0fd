#include "gamer/image/fits/fits.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/version.h"
#include "gamer/image/wcs.h"
#include "image/fits/card_record.h"
#include "image/fits/fits_cards.h"
#include "image/fits/fits_file.h"
#include "image/image_test_util.h"

namespace gamer::fits_test {
namespace {

const Card* find_card(const std::vector<Card>& cards, const std::string& key) {
  for (const Card& card : cards) {
    if (card.key == key) return &card;
  }
  return nullptr;
}

template <class Value>
Value card_value(const std::vector<Card>& cards, const std::string& key) {
  const Card* card = find_card(cards, key);
  if (card == nullptr || !std::holds_alternative<Value>(card->value)) {
    ADD_FAILURE() << "no card " << key << " of this type";
    return Value{};
  }
  return std::get<Value>(card->value);
}

void expect_test_image(const Image& image, const ImageHeader& header, int bitpix,
                       int first_plane = 0) {
  ASSERT_EQ(image.width(), header.width);
  ASSERT_EQ(image.height(), header.height);
  for (int plane = 0; plane < image.planes(); ++plane) {
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const double value = test_value(x, y, plane + first_plane);
        const double expected = bitpix == -32 ? static_cast<float>(value) : value;
        ASSERT_EQ(image.at(x, y, plane), expected) << x << ' ' << y << ' ' << plane;
      }
    }
  }
}

const std::vector<double> bits_of_one = {5500}, three = {4400, 5500, 8000},
                          linear = {4000.1, 4000.4, 4000.7, 4001.0};

// ---- Pixels ------------------------------------------------------------------------------------

struct FormatCase {
  const char* suffix;
  int bitpix;
  ImageLayout layout;
  std::vector<double> wavelengths;
};

class FitsFormats : public testing::TestWithParam<FormatCase> {};

TEST_P(FitsFormats, RoundTripIsCleanForFitsverify) {
  const FormatCase& format = GetParam();
  TemporaryFolder folder;
  ImageHeader header = test_header(37, 23, format.wavelengths);
  header.cards = {{"HIERARCH GAMER CAMERA.FOV", 45.0, "[deg] full angle"},
                  {"HIERARCH GAMER LONG", std::string(300, 'q'), ""}};
  header.tables = {{"SCENE", {"NAME", "TEXT"}, {{"a", "one\ntwo\n"}}, {}}};
  const OutputOptions options{folder / (std::string("image") + format.suffix), format.bitpix,
                              format.layout, false};
  write_test_image(options, header);
  const auto files = output_files(options, header);
  EXPECT_EQ(folder.file_count(), files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    expect_fitsverify_clean(files[i]);
    EXPECT_EQ(FitsFile::open(files[i], "image").hdu_count(), fits_hdus(options, header));
    const FitsImage read = read_fits(files[i]);
    EXPECT_EQ(read.image.planes(), files.size() > 1 ? 1 : header.planes());
    expect_test_image(read.image, header, format.bitpix, static_cast<int>(i));
    EXPECT_EQ(card_value<std::string>(read.cards, "BUNIT"), "nJy");
    EXPECT_EQ(card_value<double>(read.cards, "HIERARCH GAMER CAMERA.FOV"), 45.0);
    EXPECT_EQ(card_value<std::string>(read.cards, "HIERARCH GAMER LONG"), std::string(300, 'q'));
    EXPECT_EQ(card_value<std::string>(read.cards, "ORIGIN"), "gamer");
    EXPECT_EQ(card_value<std::string>(read.cards, "CREATOR"), std::string("gamer ") + version());
    EXPECT_EQ(card_value<double>(read.cards, "WAVELEN1"), format.wavelengths[i]);
    ASSERT_EQ(read.tables.size(), 1U);
    EXPECT_EQ(read.tables[0].rows, header.tables[0].rows);
  }
}

std::vector<FormatCase> all_formats() {
  std::vector<FormatCase> cases;
  for (const char* suffix : {".fits", ".fits.fz"}) {
    for (const int bitpix : {-32, -64}) {
      for (const ImageLayout layout :
           {ImageLayout::cube, ImageLayout::extensions, ImageLayout::files}) {
        for (const auto& wavelengths : {bits_of_one, three, linear}) {
          cases.push_back({suffix, bitpix, layout, wavelengths});
        }
      }
    }
  }
  return cases;
}

std::string format_name(const testing::TestParamInfo<FormatCase>& test) {
  const char* layouts[] = {"cube", "extensions", "files"};
  const FormatCase& format = test.param;
  return std::string(layouts[static_cast<int>(format.layout)]) +
         (std::string(format.suffix) == ".fits" ? "" : "_fz") +
         (format.bitpix == -32 ? "_float" : "_double") + std::to_string(format.wavelengths.size());
}

INSTANTIATE_TEST_SUITE_P(All, FitsFormats, testing::ValuesIn(all_formats()), format_name);

TEST(FitsWriter, OrderOfRowsDoesNotChangeTheBytes) {
  for (const char* suffix : {".fits", ".fits.fz"}) {
    TemporaryFolder folder;
    ImageHeader header = test_header(300, 7, three);
    header.cards = {{"DATE", std::string("2020-02-02T02:02:02"), "fixed"}};
    const OutputOptions first{folder / (std::string("a") + suffix), -32, ImageLayout::cube, false};
    OutputOptions second = first;
    second.path = folder / (std::string("b") + suffix);
    write_test_image(first, header);
    write_test_image(second, header, {6, 0, 3, 5, 1, 4, 2, 2});
    EXPECT_EQ(file_bytes(first.path), file_bytes(second.path));
    EXPECT_EQ(card_value<std::string>(read_fits(first.path).cards, "DATE"), "2020-02-02T02:02:02");
  }
}

TEST(FitsDate, IsNowOrTheSourcesDate) {
  const char* variable = "SOURCE_DATE_EPOCH";
  ASSERT_EQ(setenv(variable, "1000000000", 1), 0);
  EXPECT_EQ(fits_date(), "2001-09-09T01:46:40");
  ASSERT_EQ(setenv(variable, "today", 1), 0);
  EXPECT_GT(fits_date(), "2024");
  ASSERT_EQ(unsetenv(variable), 0);
  EXPECT_GT(fits_date(), "2024");
}

TEST(FitsWriter, TakesBlocksOfRows) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(5, 11, three);
  const OutputOptions options{folder / "a.fits", -64, ImageLayout::extensions, false};
  auto writer = make_fits_writer(options, header);
  writer->write_rows(4, 7, test_rows(header, 4, 7));
  writer->write_rows(0, 4, test_rows(header, 0, 4));
  writer->finish();
  expect_test_image(read_fits(options.path).image, header, -64);
}

TEST(FitsWriter, KeepsInfinityAndNan) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(3, 1, bits_of_one);
  const OutputOptions options{folder / "a.fits.fz", -32, ImageLayout::cube, false};
  auto writer = make_fits_writer(options, header);
  const double infinity = std::numeric_limits<double>::infinity();
  writer->write_rows(0, 1, std::vector<double>{std::nan(""), infinity, 1e-45});
  writer->finish();
  const Image image = read_fits(options.path).image;
  EXPECT_TRUE(std::isnan(image.at(0, 0)));
  EXPECT_EQ(image.at(1, 0), infinity);
  EXPECT_EQ(image.at(2, 0), static_cast<double>(1e-45F));
}

TEST(FitsWriter, RowsOfZerosTakeNoRoomOnDisk) {
  for (const ImageLayout layout : {ImageLayout::cube, ImageLayout::extensions}) {
    for (const int bitpix : {-32, -64}) {
      TemporaryFolder folder;
      constexpr int width = 5000, height = 400;
      const ImageHeader header = test_header(width, height, three);
      const OutputOptions options{folder / "a.fits", bitpix, layout, false};
      auto writer = make_fits_writer(options, header);
      const auto zeros = [](int rows) {
        return std::vector<double>(static_cast<std::size_t>(rows) * width * 3);
      };
      std::vector<double> one_pixel = zeros(10);
      one_pixel[7 * width + 123] = 1.5;  // row 2, second plane
      one_pixel[9 * width] = -0.0;       // row 3, first plane
      writer->write_rows(390, 10, zeros(10));
      writer->write_rows(100, 10, one_pixel);
      writer->write_rows(0, 100, zeros(100));
      writer->write_rows(110, 280, zeros(280));
      writer->finish();
      expect_fitsverify_clean(options.path);
      struct stat status {};
      ASSERT_EQ(stat(options.path.c_str(), &status), 0);
      EXPECT_GT(status.st_size, 3 * width * height * -bitpix / 8);
      EXPECT_LT(status.st_blocks * 512, status.st_size / 10);
      const Image image = read_fits(options.path).image;
      EXPECT_EQ(image.at(123, 102, 1), 1.5);
      EXPECT_TRUE(std::signbit(image.at(0, 103, 0)));
      double sum = 0;
      for (int plane = 0; plane < 3; ++plane) {
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) sum += std::abs(image.at(x, y, plane));
        }
      }
      EXPECT_EQ(sum, 1.5);
    }
  }
}

TEST(FitsWriter, RowsMayComeAgain) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(50, 3, three);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  auto writer = make_fits_writer(options, header);
  writer->write_rows(0, 3, test_rows(header, 0, 3));
  writer->write_rows(1, 1, std::vector<double>(150));
  writer->finish();
  expect_fitsverify_clean(options.path);
  const Image image = read_fits(options.path).image;
  EXPECT_EQ(image.at(7, 1, 2), 0);
  EXPECT_EQ(image.at(7, 2, 2), static_cast<float>(test_value(7, 2, 2)));
}

// ---- Complete or absent ------------------------------------------------------------------------

TEST(FitsWriter, NothingBeforeFinishAndNothingLeftWithoutIt) {
  for (const ImageLayout layout : {ImageLayout::cube, ImageLayout::files}) {
    TemporaryFolder folder;
    const ImageHeader header = test_header(8, 4, three);
    const OutputOptions options{folder / "a.fits", -32, layout, false};
    {
      auto writer = make_fits_writer(options, header);
      writer->write_rows(0, 4, test_rows(header, 0, 4));
      for (const auto& file : output_files(options, header)) {
        EXPECT_FALSE(std::filesystem::exists(file));
      }
      for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
        EXPECT_EQ(entry.path().filename().string().front(), '.');
      }
      EXPECT_EQ(folder.file_count(), 1U);
    }
    EXPECT_EQ(folder.file_count(), 0U);
  }
}

TEST(FitsWriter, MissingRowIsAnError) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, bits_of_one);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  {
    auto writer = make_fits_writer(options, header);
    writer->write_rows(0, 3, test_rows(header, 0, 3));
    EXPECT_THROW(writer->finish(), RunError);
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(FitsWriter, FileThatAppearsMeanwhileIsKept) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, bits_of_one);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  {
    auto writer = make_fits_writer(options, header);
    writer->write_rows(0, 4, test_rows(header, 0, 4));
    std::ofstream(options.path) << "precious";
    EXPECT_THROW(writer->finish(), RunError);
  }
  EXPECT_EQ(file_bytes(options.path), "precious");
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(FitsWriter, OverwriteReplacesAndObeysUmask) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, bits_of_one);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, true};
  std::ofstream(options.path) << "old";
  write_test_image(options, header);
  expect_test_image(read_fits(options.path).image, header, -32);
  const mode_t mask = umask(0);
  umask(mask);
  struct stat information {};
  ASSERT_EQ(stat(options.path.c_str(), &information), 0);
  EXPECT_EQ(information.st_mode & 0777, 0666 & ~mask);
}

TEST(FitsWriter, NameIsTakenLiterally) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, bits_of_one);
  for (const char* name : {"a[1].fits", "!b.fits", "c(d).fits", " e'.fits", "g+1.fits.fz"}) {
    const OutputOptions options{folder / name, -32, ImageLayout::cube, false};
    write_test_image(options, header);
    EXPECT_TRUE(std::filesystem::exists(options.path)) << name;
    expect_test_image(read_fits(options.path).image, header, -32);
  }
}

/// A limit on the size of files acts like a full disk: the write fails at an equal place.
TEST(FitsWriter, FullDiskIsARunErrorThatLeavesNothing) {
  for (const char* suffix : {".fits", ".fits.fz", ".png", ".bmp"}) {
    TemporaryFolder folder;
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{20000, 20000};
      setrlimit(RLIMIT_FSIZE, &limit);
      int code = 1;
      const ImageHeader header = test_header(256, 256, three);
      // Values that do not compress.
      std::vector<double> values(256 * 256 * 3);
      std::mt19937_64 random(1);
      for (double& value : values) value = static_cast<double>(random());
      try {
        auto writer = make_image_writer({folder / (std::string("a") + suffix), -64}, header);
        writer->write_rows(0, 256, values);
        writer->finish();
      } catch (const RunError& error) {
        const bool says_why = std::string(error.what()).find("File too large") != std::string::npos;
        code = says_why ? 42 : 2;
      } catch (...) {
        code = 3;
      }
      _exit(code);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << suffix;
    EXPECT_EQ(WEXITSTATUS(status), 42) << suffix;
    EXPECT_EQ(folder.file_count(), 0U) << suffix;
  }
}

// ---- Header ------------------------------------------------------------------------------------

TEST(FitsCards, EveryKindOfValueRoundTrips) {
  TemporaryFolder folder;
  ImageHeader header = test_header(4, 4, bits_of_one);
  const std::vector<double> doubles = {0.1,    1.0 / 3, 1,     1e20,     -1e-300,
                                       5e-324, 1e22,    1e308, 123456.0, 0.0};
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    header.cards.push_back({"HIERARCH GAMER D" + std::to_string(i), doubles[i], "a double"});
  }
  const std::vector<std::string> texts = {"",
                                          "plain",
                                          "it's",
                                          "''",
                                          "trailing blank ",
                                          " leading",
                                          std::string(68, 'x'),
                                          std::string(69, 'y'),
                                          std::string(500, '\''),
                                          std::string(200, '&'),
                                          "ends in &",
                                          "Sérsic\n\t100 % %41 %",
                                          std::string("nul\0byte", 8)};
  for (std::size_t i = 0; i < texts.size(); ++i) {
    header.cards.push_back({"HIERARCH GAMER S" + std::to_string(i), texts[i], "a text"});
    header.cards.push_back({"TEXT" + std::to_string(i), texts[i], ""});
  }
  header.cards.push_back({"CREATOR", std::string("someone else"), ""});
  header.cards.push_back({"YES", true, "a flag"});
  header.cards.push_back({"NO", false, ""});
  header.cards.push_back({"LARGE", std::numeric_limits<long long>::max(), "an integer"});
  header.cards.push_back({"SMALL", std::numeric_limits<long long>::min(), ""});
  header.cards.push_back({"HISTORY", {}, "made by a test"});
  header.cards.push_back({"COMMENT", {}, "for the test"});
  for (const char* name : {"a.fits", "a.fits.fz"}) {
    const OutputOptions options{folder / name, -32, ImageLayout::cube, false};
    write_test_image(options, header);
    expect_fitsverify_clean(options.path);
    const std::vector<Card> cards = read_fits(options.path).cards;
    for (std::size_t i = 0; i < doubles.size(); ++i) {
      EXPECT_EQ(card_value<double>(cards, "HIERARCH GAMER D" + std::to_string(i)), doubles[i]);
    }
    for (std::size_t i = 0; i < texts.size(); ++i) {
      EXPECT_EQ(card_value<std::string>(cards, "HIERARCH GAMER S" + std::to_string(i)), texts[i]);
      EXPECT_EQ(card_value<std::string>(cards, "TEXT" + std::to_string(i)), texts[i]);
    }
    EXPECT_EQ(card_value<std::string>(cards, "CREATOR"), "someone else");
    EXPECT_TRUE(card_value<bool>(cards, "YES"));
    EXPECT_FALSE(card_value<bool>(cards, "NO"));
    EXPECT_EQ(find_card(cards, "YES")->comment, "a flag");
    EXPECT_EQ(card_value<long long>(cards, "LARGE"), std::numeric_limits<long long>::max());
    EXPECT_EQ(card_value<long long>(cards, "SMALL"), std::numeric_limits<long long>::min());
    ASSERT_NE(find_card(cards, "HISTORY"), nullptr);
    EXPECT_EQ(find_card(cards, "HISTORY")->comment, "made by a test");
    ASSERT_NE(find_card(cards, "COMMENT"), nullptr);
    EXPECT_EQ(find_card(cards, "COMMENT")->comment, "for the test");
    for (const char* key : {"NAXIS", "BITPIX", "CHECKSUM", "ZHECKSUM", "ZCMPTYPE", "LONGSTRN"}) {
      EXPECT_EQ(find_card(cards, key), nullptr) << key;
    }
  }
}

TEST(FitsCards, NoUnitIsDimensionless) {
  TemporaryFolder folder;
  ImageHeader header = test_header(4, 4, bits_of_one);
  header.unit.clear();
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  write_test_image(options, header);
  expect_fitsverify_clean(options.path);
  const FitsImage image = read_fits(options.path);
  const Card* unit = find_card(image.cards, "BUNIT");
  ASSERT_NE(unit, nullptr);
  EXPECT_EQ(std::get<std::string>(unit->value), "");
  EXPECT_EQ(file_bytes(options.path).find("CROTA"), std::string::npos);
}

TEST(FitsCards, AxesWithoutTypeAndPlanesWithoutWavelengthAreClean) {
  TemporaryFolder folder;
  ImageHeader header = test_header(4, 4, three);
  header.x = header.y = LinearAxis{};
  header.wavelengths.clear();
  header.unit.clear();
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  write_test_image(options, header);
  expect_fitsverify_clean(options.path);
}

TEST(FitsCards, ValuesThatFitsCannotHoldAreErrors) {
  TemporaryFolder folder;
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  ImageHeader header = test_header(4, 4, bits_of_one);
  header.cards = {{"BAD", std::nan(""), ""}};
  EXPECT_THROW(make_fits_writer(options, header), RunError);
  header.cards = {{"HIERARCH GAMER " + std::string(70, 'K'), 0.1, ""}};
  EXPECT_THROW(make_fits_writer(options, header), RunError);
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(FitsCards, PercentEncoding) {
  EXPECT_EQ(percent_encode("a b"), "a b");
  EXPECT_EQ(percent_encode("\xC3\xA9\n"), "%C3%A9%0A");
  EXPECT_EQ(percent_encode("100 %"), "100 %");
  EXPECT_EQ(percent_encode("%41"), "%2541");
  EXPECT_EQ(percent_encode("a  "), "a %20");
  for (int i = 0; i < 256; ++i) {
    for (const char* around : {"", "4", "%", "%2", " "}) {
      const std::string text = around + std::string(1, static_cast<char>(i)) + around;
      EXPECT_EQ(percent_decode(percent_encode(text)), text);
    }
  }
}

// ---- Tables ------------------------------------------------------------------------------------

TEST(FitsTable, TextsOfAnyKindRoundTrip) {
  TemporaryFolder folder;
  ImageHeader header = test_header(4, 4, bits_of_one);
  std::string megabytes;
  for (int i = 0; i < 60000; ++i) megabytes += "line " + std::to_string(i) + " of a long text\n";
  header.tables = {
      {"GAMERSRC",
       {"NAME", "LABEL", "TEXT"},
       {{"galaxies/a", "a.toml", "# Sérsic\n\n[galaxy]\nname = \"a\"\n"},
        {"", "", ""},
        {"b", "two\nlines", "one"},
        {"c", "", "\n"},
        {"d", "\n\n", "no newline at the end\nlast"},
        {"e", "trailing blanks  ", "  \n \n"},
        {"f", "50 % %20", "tab\there\r\nDOS\r\n"},
        {"g", "wide", std::string(3000000, 'w')},
        {std::string(250, 'n'), "wide\n" + std::string(500, ' ') + "\nx", std::string(999, '%')},
        {"h", "long", megabytes}},
       {{"HIERARCH GAMER FORMAT", 1LL, "version"}, {"NOTE", std::string("about it"), ""}}},
      {"EMPTY", {"NAME"}, {}, {}},
      {"ONE", {"A"}, {{""}}, {}}};
  for (const char* name : {"a.fits", "b.fits.fz"}) {
    const OutputOptions options{folder / name, -32, ImageLayout::cube, false};
    write_test_image(options, header);
    expect_fitsverify_clean(options.path);
    const FitsImage read = read_fits(options.path);
    ASSERT_EQ(read.tables.size(), header.tables.size());
    for (std::size_t i = 0; i < read.tables.size(); ++i) {
      const TextTable &expected = header.tables[i], &table = read.tables[i];
      EXPECT_EQ(table.name, expected.name);
      EXPECT_EQ(table.columns, expected.columns);
      EXPECT_TRUE(table.rows == expected.rows) << expected.name;
      ASSERT_EQ(table.cards.size(), expected.cards.size());
      for (std::size_t j = 0; j < table.cards.size(); ++j) {
        EXPECT_EQ(table.cards[j].key, expected.cards[j].key);
        EXPECT_EQ(table.cards[j].value, expected.cards[j].value);
      }
    }
    EXPECT_EQ(read_fits_table(options.path, "ONE").columns, std::vector<std::string>{"A"});
    EXPECT_THROW(read_fits_table(options.path, "NONE"), InputError);
  }
}

TEST(FitsTable, OneRowPerLine) {
  TemporaryFolder folder;
  if (astropy_python().empty()) GTEST_SKIP() << "no Python with Astropy";
  ImageHeader header = test_header(4, 4, bits_of_one);
  header.tables = {{"T", {"NAME", "TEXT"}, {{"a", "x\ny é\n"}, {"b", "z"}}, {}}};
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  write_test_image(options, header);
  const CommandResult result =
      run_command(astropy_python() + " -c 'from astropy.io import fits\nd = fits.getdata(\"" +
                  options.path.string() +
                  "\", \"T\")\nprint(list(d[\"LINE\"]), list(d[\"NAME\"]), list(d[\"TEXT\"]))'");
  EXPECT_EQ(result.output, "[1, 2, 1] ['a', '', 'b'] ['x', 'y %C3%A9%0A', 'z']\n");
}

// ---- World coordinates, as Astropy sees them ---------------------------------------------------

std::string astropy(const std::filesystem::path& path, const std::string& script) {
  const std::string prefix =
      "import sys\nfrom astropy.io import fits\nfrom astropy.wcs import WCS\n"
      "h = fits.open(sys.argv[1], checksum=True)\n";
  const auto file = path.string() + ".py";
  std::ofstream(file) << prefix << script << "\nh.close()\n";
  return run_command(astropy_python() + " -W error '" + file + "' '" + path.string() + "'").output;
}

/// World coordinates of the pixel (x, y, z), counted from 1, in degrees and Angstrom.
const std::string world =
    "def world(hdu, *pixel):\n"
    "    w = WCS(hdu.header)\n"
    "    c = w.wcs_pix2world([pixel], 1)[0]\n"
    "    s = [u.to(\"Angstrom\") if u.physical_type == \"length\" else 1 for u in w.wcs.cunit]\n"
    "    print(*[f\"{a * b:.9g}\" for a, b in zip(c, s)])\n";

TEST(FitsWorldCoordinates, LinearWavelengths) {
  if (astropy_python().empty()) GTEST_SKIP() << "no Python with Astropy";
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, linear);
  for (const char* name : {"a.fits", "a.fits.fz"}) {
    const OutputOptions options{folder / name, -32, ImageLayout::cube, false};
    write_test_image(options, header);
    // 0.1 - 0.25 (1 - 4.5) = 0.975 and -0.2 + 0.25 (4 - 2.5) = 0.175; the third plane has 4000.7
    // Angstrom.
    EXPECT_EQ(
        astropy(options.path, world + "i = [x for x in h if x.is_image and x.data is not None]\n"
                                      "print(i[0].header[\"CTYPE3\"], i[0].header[\"CUNIT3\"])\n"
                                      "world(i[0], 1, 4, 3)\n"),
        "WAVE Angstrom\n0.975 0.175 4000.7\n");
  }
}

// Planes of uneven wavelengths are counted, so that WCS(header) needs no table.
TEST(FitsWorldCoordinates, UnevenWavelengthsAreCounted) {
  if (astropy_python().empty()) GTEST_SKIP() << "no Python with Astropy";
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, three);
  for (const char* name : {"a.fits", "a.fits.fz"}) {
    const OutputOptions options{folder / name, -64, ImageLayout::cube, false};
    write_test_image(options, header);
    EXPECT_EQ(astropy(options.path,
                      world + "i = [x for x in h if x.is_image and x.data is not None]\n"
                              "print(i[0].header[\"CTYPE3\"])\n"
                              "world(i[0], 1, 4, 1)\nworld(i[0], 8, 1, 2)\nworld(i[0], 1, 4, 3)\n"
                              "print(i[0].data[2, 1, 5], [i[0].header[f\"WAVELEN{n}\"] for n in "
                              "(1, 2, 3)])\n"),
              "PLANE\n0.975 0.175 1\n-0.775 -0.575 2\n0.975 0.175 3\n"
              "-68.7 [4400.0, 5500.0, 8000.0]\n");
  }
}

TEST(FitsWorldCoordinates, ManyPlanesHaveTheirWavelengths) {
  if (astropy_python().empty()) GTEST_SKIP() << "no Python with Astropy";
  TemporaryFolder folder;
  std::vector<double> wavelengths;
  for (int i = 0; i < 30; ++i) wavelengths.push_back(4000 + 10 * i + i * i);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::cube, false};
  write_test_image(options, test_header(4, 3, wavelengths));
  expect_fitsverify_clean(options.path);
  EXPECT_EQ(
      astropy(options.path, world + "print(h[0].header[\"WAVELEN9\"], h[0].header[\"WAVELEN30\"],"
                                    " h[0].data.shape)\nworld(h[0], 1, 1, 30)\n"),
      "4144.0 5131.0 (30, 3, 4)\n0.475 -0.45 30\n");
}

TEST(FitsWorldCoordinates, ExtensionsAndFilesHaveTwoAxes) {
  if (astropy_python().empty()) GTEST_SKIP() << "no Python with Astropy";
  TemporaryFolder folder;
  const ImageHeader header = test_header(8, 4, three);
  OutputOptions options{folder / "a.fits", -32, ImageLayout::extensions, false};
  write_test_image(options, header);
  EXPECT_EQ(
      astropy(options.path, world + "print(h[0].data, [x.name for x in h[1:]])\n"
                                    "world(h[\"5500A\"], 1, 4)\n"
                                    "print(h[\"5500A\"].header[\"WAVELEN1\"], h[1].data.shape)"),
      "None ['4400A', '5500A', '8000A']\n0.975 0.175\n5500.0 (4, 8)\n");
  options.layout = ImageLayout::files;
  write_test_image(options, header);
  EXPECT_EQ(astropy(folder / "a_8000A.fits", world + "print(len(h), h[0].name)\n"
                                                     "world(h[0], 1, 4)\n"),
            "1 8000A\n0.975 0.175\n");
}

// ---- Celestial coordinates ---------------------------------------------------------------------

/// A header with a matrix and two more descriptions of the axes.
const std::vector<std::string> matrix_records = {"CTYPE1  = 'RA---TAN'           / first",
                                                 "CRPIX1  =    4.500000000000000000",
                                                 "CRVAL1  = 1.0E-2",
                                                 "CTYPE2  = 'DEC--TAN'",
                                                 "CRPIX2  = 2.5",
                                                 "CRVAL2  = 40.",
                                                 "CD1_1   = -7.0E-02",
                                                 "CD1_2   = 1.0E-02",
                                                 "CD2_1   = 1.0E-02",
                                                 "CD2_2   = 7.0E-02",
                                                 "RADESYS = 'FK5     '",
                                                 "EQUINOX =               2000.0",
                                                 "CTYPE1A = 'LINEAR'",
                                                 "CTYPE2A = 'LINEAR'",
                                                 "CD1_1A  = 2.0",
                                                 "CD2_2A  = 2.0",
                                                 "CTYPE1B = 'LINEAR'",
                                                 "CTYPE2B = 'LINEAR'",
                                                 "CDELT1B = 2.0",
                                                 "CDELT2B = 2.0"};

const std::vector<std::string> sip_records = {"CTYPE1  = 'RA---TAN-SIP'",
                                              "CTYPE2  = 'DEC--TAN-SIP'",
                                              "CRPIX1  = 4.5",
                                              "CRPIX2  = 2.5",
                                              "CRVAL1  = 1.0E-2",
                                              "CRVAL2  = 40.",
                                              "CD1_1   = -7.0E-02",
                                              "CD1_2   = 1.0E-02",
                                              "CD2_1   = 1.0E-02",
                                              "CD2_2   = 7.0E-02",
                                              "A_ORDER = 2",
                                              "A_2_0   = 1.0E-2",
                                              "B_ORDER = 2",
                                              "B_1_1   = -2.0E-2"};

std::vector<std::string> padded(std::vector<std::string> records) {
  for (std::string& record : records) record.resize(80, ' ');
  return records;
}

const char* read_celestial = R"(
import sys
from astropy.io import fits
from astropy.wcs import WCS
for path in sys.argv[1:]:
    hdus = fits.open(path)
    header = [x for x in hdus if x.is_image and x.data is not None][0].header
    # Astropy takes no cubes with distortions.
    wcs = WCS(header, naxis=2 if "A_ORDER" in header else None)
    at = wcs.all_pix2world([[1.0, 4.0] + [1.0] * (wcs.naxis - 2)], 1)[0]
    # WAVE comes in metres.
    unit = 1e-10 if header.get("CTYPE3") == "WAVE" else 1
    print("%.11f %.11f" % tuple(at[:2]), *("%.6g" % (x / unit) for x in at[2:]))
    for letter in "AB":
        if "CTYPE1" + letter in header:
            WCS(header, key=letter).wcs.set()
)";

class CelestialFormats : public testing::TestWithParam<FormatCase> {};

TEST_P(CelestialFormats, RecordsAreReproducedAndAstropyAgrees) {
  const FormatCase& format = GetParam();
  TemporaryFolder folder;
  SkyView view;
  view.projection = "ZEA";
  view.center = {359.999, -89.5};
  view.pixel_scale = 100.0 / 3;
  view.rotation = 20;
  view.width = 8;
  view.height = 4;
  std::ofstream(folder / "read.py") << read_celestial;
  std::string command = astropy_python() + " -W ignore '" + (folder / "read.py").string() + "'";
  std::string expected;
  for (const auto& records :
       {padded(matrix_records), padded(sip_records), CelestialWcs(view).records()}) {
    ImageHeader header = test_header(8, 4, format.wavelengths);
    header.wcs_records = records;
    const std::string name = std::to_string(records.size()) + format.suffix;
    const OutputOptions options{folder / name, format.bitpix, format.layout, false};
    write_test_image(options, header);
    const auto path = output_files(options, header).back();
    expect_fitsverify_clean(path);
    const CelestialWcs wcs = CelestialWcs::from_header(header_text(path), "test");
    EXPECT_EQ(wcs.records(), records);
    const SkyPosition sky = *wcs.sky({1, 4});
    const bool third_axis = format.layout == ImageLayout::cube && format.wavelengths.size() > 1 &&
                            records.size() != sip_records.size();
    expected += fmt::format("{:.11f} {:.11f}", sky.ra, sky.dec);
    // Planes whose wavelengths are not evenly spaced are counted.
    const double first = format.wavelengths == three ? 1 : format.wavelengths[0];
    expected += third_axis ? fmt::format(" {:.6g}\n", first) : "\n";
    command += " '" + path.string() + "'";
  }
  if (astropy_python().empty()) return;
  EXPECT_EQ(run_command(command).output, expected);
}

std::vector<FormatCase> single_precision_formats() {
  std::vector<FormatCase> cases = all_formats();
  std::erase_if(cases, [](const FormatCase& format) {
    return format.bitpix != -32 ||
           (format.layout != ImageLayout::cube && format.wavelengths != three);
  });
  return cases;
}

INSTANTIATE_TEST_SUITE_P(All, CelestialFormats, testing::ValuesIn(single_precision_formats()),
                         format_name);

// ---- What differs from plane to plane ----------------------------------------------------------

TEST(FitsPlanes, UnitsAndCards) {
  TemporaryFolder folder;
  ImageHeader header = test_header(4, 3, three);
  header.plane_units = {"mag", "", "MJy/sr"};
  for (int i = 0; i < 3; ++i) {
    header.plane_cards.push_back({{"PHOTPLAM", 100.5 * i, "pivot"},
                                  {"BAND", "b" + std::to_string(i), ""},
                                  {"HISTORY", {}, "made by a test"}});
  }
  OutputOptions options{folder / "a.fits", -32, ImageLayout::extensions, false};
  const std::vector<std::string> units = {"mag", "nJy", "MJy/sr"};
  write_test_image(options, header);
  expect_fitsverify_clean(options.path);
  for (int i = 0; i < 3; ++i) {
    FitsFile file = FitsFile::open(options.path, "a.fits");
    file.move_to(i + 2);
    const std::vector<Card> cards = read_cards(file);
    EXPECT_EQ(card_value<std::string>(cards, "BUNIT"), units[i]);
    EXPECT_EQ(card_value<double>(cards, "PHOTPLAM"), 100.5 * i);
    EXPECT_EQ(card_value<std::string>(cards, "BAND"), "b" + std::to_string(i));
  }
  options = {folder / "b.fits", -32, ImageLayout::files, false};
  write_test_image(options, header);
  for (int i = 0; i < 3; ++i) {
    const auto path = output_files(options, header)[i];
    expect_fitsverify_clean(path);
    const std::vector<Card> cards = read_fits(path).cards;
    EXPECT_EQ(card_value<std::string>(cards, "BUNIT"), units[i]);
    EXPECT_EQ(card_value<double>(cards, "PHOTPLAM"), 100.5 * i);
  }
  options = {folder / "c.fits", -32, ImageLayout::cube, false};
  EXPECT_THROW(make_fits_writer(options, header), std::invalid_argument);
  header.plane_units = {"mag", "mag", "mag"};
  write_test_image(options, header);
  expect_fitsverify_clean(options.path);
  const std::vector<Card> cards = read_fits(options.path).cards;
  EXPECT_EQ(card_value<std::string>(cards, "BUNIT"), "mag");
  EXPECT_EQ(card_value<double>(cards, "HIERARCH PHOTPLAM3"), 201.0);
  EXPECT_EQ(card_value<std::string>(cards, "BAND1"), "b0");
  EXPECT_NE(find_card(cards, "HISTORY"), nullptr);
  header.plane_cards.pop_back();
  options.overwrite = true;
  EXPECT_THROW(make_fits_writer(options, header), std::invalid_argument);
}

// ---- Wrong input -------------------------------------------------------------------------------

TEST(ReadFits, WrongFilesAreInputErrors) {
  TemporaryFolder folder;
  EXPECT_THROW(read_fits(folder / "missing.fits"), InputError);
  std::ofstream(folder / "text.fits") << "not a FITS file";
  EXPECT_THROW(read_fits(folder / "text.fits"), InputError);
  std::ofstream(folder / "empty.fits") << "";
  EXPECT_THROW(read_fits(folder / "empty.fits"), InputError);
  EXPECT_THROW(read_fits(folder.path()), InputError);

  const OutputOptions options{folder / "a.fits", -64, ImageLayout::cube, false};
  write_test_image(options, test_header(64, 64, bits_of_one));
  std::filesystem::resize_file(options.path, 2880 * 4);
  try {
    read_fits(options.path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("a.fits: "), std::string::npos) << error.what();
  }
}

TEST(ReadFits, BlankPixelsOfIntegersAreNan) {
  TemporaryFolder folder;
  {
    FitsFile file = FitsFile::create(folder / "a.fits", "a.fits");
    long sizes[] = {3, 1};
    file.call(fits_create_img, SHORT_IMG, 2, sizes);
    file.call(fits_write_key_lng, "BLANK", -99L, nullptr);
    file.call(fits_set_hdustruc);
    short values[] = {5, -99, 7};
    file.call(fits_write_img_sht, 1L, LONGLONG{1}, LONGLONG{3}, values);
    file.close();
  }
  const Image image = read_fits(folder / "a.fits").image;
  EXPECT_EQ(image.at(0, 0), 5);
  EXPECT_TRUE(std::isnan(image.at(1, 0)));
  EXPECT_EQ(image.at(2, 0), 7);
}

TEST(ReadFits, HugeImageIsAnInputError) {
  TemporaryFolder folder;
  std::string bytes;
  const auto card = [&bytes](std::string text) {
    text.resize(80, ' ');
    bytes += text;
  };
  card("SIMPLE  =                    T");
  card("BITPIX  =                  -64");
  card("NAXIS   =                    2");
  card("NAXIS1  =              1000000");
  card("NAXIS2  =              1000000");
  card("END");
  bytes.resize(2880, ' ');
  std::ofstream(folder / "a.fits") << bytes << std::string(2880, '\0');
  EXPECT_THROW(read_fits(folder / "a.fits"), InputError);
}

}  // namespace
}  // namespace gamer::fits_test
