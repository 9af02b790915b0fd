#include "gamer/image/data_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits.h"
#include "image/fits/fits_file.h"
#include "image/image_test_util.h"

namespace gamer::data_table_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double positive_infinity = std::numeric_limits<double>::infinity();

using Reals = std::vector<double>;
using Integers = std::vector<std::int64_t>;
using Texts = std::vector<std::string>;

/// Expects equal numbers, and NaN in equal rows.
void expect_reals(const DataColumn& column, const Reals& expected) {
  ASSERT_TRUE(std::holds_alternative<Reals>(column.values)) << column.name;
  const auto& values = std::get<Reals>(column.values);
  ASSERT_EQ(values.size(), expected.size()) << column.name;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(expected[i])) {
      EXPECT_TRUE(std::isnan(values[i])) << column.name << ' ' << i;
    } else {
      EXPECT_EQ(values[i], expected[i]) << column.name << ' ' << i;
    }
  }
}

template <class Values>
void expect_values(const DataColumn& column, const Values& expected) {
  ASSERT_TRUE(std::holds_alternative<Values>(column.values)) << column.name;
  EXPECT_EQ(std::get<Values>(column.values), expected) << column.name;
}

const Reals some_reals = {0.1, nan_value, -1e-310, positive_infinity, 1.0 / 3};
const Integers integers = {1, -2, std::numeric_limits<std::int64_t>::max(),
                           std::numeric_limits<std::int64_t>::min(), 0};
const Texts some_texts = {"plain", "two words", "", "Sérsic\n%41 ", "'\"#,"};

DataTable test_table() {
  return {"TRUTH",
          {{"ra", "deg", "right ascension: \"the\" angle", some_reals},
           {"id", "", "", integers},
           {"name", "", std::string(100, 'd'), some_texts},
           {"flux_sdss_g", "nJy", "", Reals{1, 2, 3, 4, 5}}},
          {{"GAMERVER", 1LL, "version"}, {"NOTE", std::string("about \\ it"), ""}}};
}

void write_image_with(const std::filesystem::path& path, const std::vector<DataTable>& tables) {
  ImageHeader header = test_header(4, 4, {5500});
  header.tables = {{"SCENE", {"NAME"}, {{"a"}}, {}}};
  header.data_tables = tables;
  write_test_image({path, -32, ImageLayout::cube, false}, header);
}

// ---- FITS --------------------------------------------------------------------------------------

TEST(DataTables, RoundTripIsCleanForFitsverify) {
  TemporaryFolder folder;
  const DataTable written = test_table();
  const DataTable empty = {"EMPTY", {{"x", "pix", "", Reals{}}, {"s", "", "", Texts{}}}, {}};
  for (const char* name : {"a.fits", "b.fits.fz"}) {
    write_image_with(folder / name, {written, empty});
    expect_fitsverify_clean(folder / name);
    EXPECT_EQ(read_fits(folder / name).tables.size(), 1U);
    for (const char* hdu : {"TRUTH", "truth"}) {
      const DataTable table = read_data_table(folder / name, hdu);
      EXPECT_EQ(table.name, "TRUTH");
      EXPECT_EQ(table.rows(), 5U);
      ASSERT_EQ(table.columns.size(), 4U);
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(table.columns[i].name, written.columns[i].name);
        EXPECT_EQ(table.columns[i].unit, written.columns[i].unit);
        EXPECT_EQ(table.columns[i].description, written.columns[i].description);
      }
      expect_reals(table.columns[0], some_reals);
      expect_values(table.columns[1], integers);
      expect_values(table.columns[2], some_texts);
      ASSERT_EQ(table.cards.size(), 2U);
      EXPECT_EQ(table.cards[1].key, "NOTE");
      EXPECT_EQ(table.cards[1].value, written.cards[1].value);
    }
    const DataTable none = read_data_table(folder / name, "EMPTY");
    EXPECT_EQ(none.rows(), 0U);
    EXPECT_EQ(none.columns.size(), 2U);
    EXPECT_EQ(none.columns[0].unit, "pix");
  }
  // Tables of texts come last in a file.
  EXPECT_EQ(read_data_table(folder / "a.fits").name, "TRUTH");
  EXPECT_EQ(read_data_table(folder / "a.fits", "3").name, "SCENE");
}

/// A column as another program writes it: name, type, form, rows.
struct ForeignColumn {
  const char* form;
  const char* unit = "";
};

FitsFile foreign_table(const std::filesystem::path& path, int type, LONGLONG rows,
                       std::vector<ForeignColumn> columns) {
  FitsFile file = FitsFile::create(path, path.string());
  file.call(fits_create_img, BYTE_IMG, 0, nullptr);
  std::vector<std::string> names;
  std::vector<char*> name_pointers, forms, units;
  for (std::size_t i = 0; i < columns.size(); ++i) names.push_back("c" + std::to_string(i + 1));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    name_pointers.push_back(names[i].data());
    forms.push_back(const_cast<char*>(columns[i].form));
    units.push_back(const_cast<char*>(columns[i].unit));
  }
  file.call(fits_create_tbl, type, rows, static_cast<int>(columns.size()), name_pointers.data(),
            forms.data(), units.data(), "FOREIGN");
  return file;
}

void write_texts(FitsFile& file, int column, Texts texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  file.call(fits_write_col_str, column, LONGLONG{1}, LONGLONG{1},
            static_cast<LONGLONG>(texts.size()), pointers.data());
}

void write_integers(FitsFile& file, int column, std::vector<LONGLONG> values) {
  file.call(fits_write_col_lnglng, column, LONGLONG{1}, LONGLONG{1},
            static_cast<LONGLONG>(values.size()), values.data());
}

/// Writes columns of all types, with nulls, an offset that makes the type unsigned, and a scale.
void write_foreign_columns(const std::filesystem::path& path) {
  FitsFile file = foreign_table(path, BINARY_TBL, 3,
                                {{"1I", "mag"},
                                 {"1I"},
                                 {"1I"},
                                 {"1J"},
                                 {"1E"},
                                 {"3E"},
                                 {"1C"},
                                 {"6A"},
                                 {"6A3"},
                                 {"1PJ"},
                                 {"1L"},
                                 {"8X"},
                                 {"1B"},
                                 {"0D"},
                                 {"1K"}});
  file.call(fits_write_key_lng, "TNULL1", -99L, nullptr);
  file.call(fits_write_key_lng, "TZERO2", 32768L, nullptr);
  file.call(fits_write_key_dbl, "TSCAL3", 0.5, 15, nullptr);
  file.call(fits_write_key_dbl, "TZERO3", 10.0, 15, nullptr);
  file.call(fits_write_key_lng, "TNULL3", -99L, nullptr);
  file.call(fits_write_key_str, "TCOMM1", "first", nullptr);
  file.call(fits_write_key_lng, "ANSWER", 42L, nullptr);
  file.call(fits_set_hdustruc);
  write_integers(file, 1, {1, -99, 3});
  write_integers(file, 2, {0, 40000, 65535});
  file.call(fits_set_tscale, 3, 1.0, 0.0);
  write_integers(file, 3, {2, -99, -4});
  write_integers(file, 4, {-5, 6, 2147483647});
  Reals reals = {1.5, nan_value, positive_infinity};
  file.call(fits_write_col_dbl, 5, LONGLONG{1}, LONGLONG{1}, LONGLONG{3}, reals.data());
  write_texts(file, 8, {"ab", "", "%41 x"});
  char flags[] = {1, 0, 1};
  file.call(fits_write_col_log, 11, LONGLONG{1}, LONGLONG{1}, LONGLONG{2}, flags);
  write_integers(file, 13, {0, 1, 255});
  write_integers(file, 15, {1, 1LL << 60, -1});
  file.close();
}

TEST(DataTables, BinaryTableOfAnotherProgram) {
  TemporaryFolder folder;
  const auto path = folder / "a.fits";
  write_foreign_columns(path);
  const DataTable table = read_data_table(path);
  EXPECT_EQ(table.name, "FOREIGN");
  Texts names;
  for (const DataColumn& column : table.columns) names.push_back(column.name);
  // Arrays, complex numbers, bits and columns of width 0 are left out.
  ASSERT_EQ(names, (Texts{"c1", "c2", "c3", "c4", "c5", "c8", "c11", "c13", "c15"}));
  EXPECT_EQ(table.columns[0].unit, "mag");
  EXPECT_EQ(table.columns[0].description, "first");
  expect_reals(table.columns[0], {1, nan_value, 3});
  expect_values(table.columns[1], Integers{0, 40000, 65535});
  expect_reals(table.columns[2], {11, nan_value, 8});
  expect_values(table.columns[3], Integers{-5, 6, 2147483647});
  expect_reals(table.columns[4], {1.5, nan_value, positive_infinity});
  expect_values(table.columns[5], Texts{"ab", "", "%41 x"});
  // The third flag was never written.
  expect_reals(table.columns[6], {1, 0, nan_value});
  expect_values(table.columns[7], Integers{0, 1, 255});
  expect_values(table.columns[8], Integers{1, 1LL << 60, -1});
  ASSERT_EQ(table.cards.size(), 1U);
  EXPECT_EQ(table.cards[0].key, "ANSWER");
}

TEST(DataTables, AsciiTable) {
  TemporaryFolder folder;
  const auto path = folder / "a.fits";
  {
    FitsFile file = foreign_table(path, ASCII_TBL, 3, {{"I6"}, {"F9.3", "deg"}, {"A5"}, {"E15.7"}});
    file.call(fits_write_key_str, "TNULL1", "   -99", nullptr);
    file.call(fits_set_hdustruc);
    write_integers(file, 1, {1, -99, 30});
    Reals reals = {1.5, -2.25, 0};
    file.call(fits_write_col_dbl, 2, LONGLONG{1}, LONGLONG{1}, LONGLONG{3}, reals.data());
    write_texts(file, 3, {"ab", "y y y", ""});
    file.call(fits_write_col_dbl, 4, LONGLONG{1}, LONGLONG{1}, LONGLONG{3}, reals.data());
    file.close();
  }
  const DataTable table = read_data_table(path, "1");
  ASSERT_EQ(table.columns.size(), 4U);
  expect_reals(table.columns[0], {1, nan_value, 30});
  expect_reals(table.columns[1], {1.5, -2.25, 0});
  EXPECT_EQ(table.columns[1].unit, "deg");
  expect_values(table.columns[2], Texts{"ab", "y y y", ""});
  expect_reals(table.columns[3], {1.5, -2.25, 0});
}

TEST(DataTables, ManyRows) {
  TemporaryFolder folder;
  DataTable written = {"MANY", {{"i", "", "", Integers()}, {"x", "", "", Reals()}}, {}};
  for (int i = 0; i < 100000; ++i) {
    std::get<Integers>(written.columns[0].values).push_back(i);
    std::get<Reals>(written.columns[1].values).push_back(i / 7.0);
  }
  write_image_with(folder / "a.fits", {written});
  const DataTable table = read_data_table(folder / "a.fits", "MANY");
  EXPECT_TRUE(table.columns[0].values == written.columns[0].values);
  EXPECT_TRUE(table.columns[1].values == written.columns[1].values);
}

TEST(DataTables, ColumnsOfOneLength) {
  TemporaryFolder folder;
  const DataTable bad = {"BAD", {{"a", "", "", Reals{1}}, {"b", "", "", Reals{}}}, {}};
  EXPECT_THROW(write_image_with(folder / "a.fits", {bad}), std::invalid_argument);
  EXPECT_THROW(write_ecsv(folder / "a.ecsv", bad), std::invalid_argument);
  EXPECT_EQ(folder.file_count(), 0U);
}

std::string read_error(const std::filesystem::path& path, const std::string& hdu = {}) {
  try {
    read_data_table(path, hdu);
  } catch (const InputError& error) {
    const std::string text = error.what();
    return text.substr(text.rfind('/') + 1);
  }
  return "no error";
}

TEST(DataTables, WrongFilesAreInputErrors) {
  TemporaryFolder folder;
  const auto path = folder / "a.fits";
  EXPECT_EQ(read_error(path).substr(0, 8), "a.fits: ");
  DataTable large = {"TRUTH", {{"x", "", "", Reals(100000)}}, {}};
  write_image_with(path, {large});
  EXPECT_EQ(read_error(path, "TRUTH"), "no error");
  EXPECT_EQ(read_error(path, "TRUT"), "a.fits: no HDU 'TRUT' in it; did you mean 'TRUTH'?");
  EXPECT_EQ(read_error(path, "3"), "a.fits: no HDU 3 in it; the last one is 2");
  EXPECT_EQ(read_error(path, "0"), "a.fits: HDU '0' is an image, not a table");
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_EQ(read_error(path, "TRUTH").substr(0, 8), "a.fits: ");

  const OutputOptions image{folder / "b.fits", -32, ImageLayout::cube, false};
  write_test_image(image, test_header(4, 4, {5500}));
  EXPECT_EQ(read_error(image.path), "b.fits: no table in it");
  // A compressed image is stored as a table, but is none.
  const OutputOptions packed{folder / "c.fits.fz", -32, ImageLayout::cube, false};
  write_test_image(packed, test_header(4, 4, {5500}));
  EXPECT_EQ(read_error(packed.path), "c.fits.fz: no table in it");
  std::ofstream(folder / "text.fits") << "not a FITS file";
  EXPECT_EQ(read_error(folder / "text.fits").substr(0, 11), "text.fits: ");
  EXPECT_THROW(read_data_table(folder.path()), InputError);
}

/// The header promises more rows than any memory holds.
TEST(DataTables, HugeTableIsAnInputError) {
  TemporaryFolder folder;
  const auto path = folder / "a.fits";
  std::string bytes;
  const auto card = [&bytes](std::string text) {
    text.resize(80, ' ');
    bytes += text;
  };
  const auto fill = [&bytes] { bytes.resize((bytes.size() + 2879) / 2880 * 2880, ' '); };
  card("SIMPLE  =                    T");
  card("BITPIX  =                    8");
  card("NAXIS   =                    0");
  card("END");
  fill();
  card("XTENSION= 'BINTABLE'");
  card("BITPIX  =                    8");
  card("NAXIS   =                    2");
  card("NAXIS1  =         100000000008");
  card("NAXIS2  =        1000000000000");
  card("PCOUNT  =                    0");
  card("GCOUNT  =                    1");
  card("TFIELDS =                    2");
  card("TFORM1  = '1D      '");
  card("TFORM2  = '100000000000A'");
  card("END");
  fill();
  std::ofstream(path) << bytes << std::string(2880, '\0');
  EXPECT_EQ(read_error(path).substr(0, 8), "a.fits: ");
}

// ---- Header text -------------------------------------------------------------------------------

TEST(HeaderText, FirstImageOrTheOneAskedFor) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(6, 4, {4400, 5500});
  for (const char* name : {"a.fits", "b.fits.fz"}) {
    const auto path = folder / name;
    write_test_image({path, -32, ImageLayout::extensions, false}, header);
    const std::string first = header_text(path);
    ASSERT_EQ(first.size() % 81, 0U);
    for (std::size_t i = 80; i < first.size(); i += 81) EXPECT_EQ(first[i], '\n');
    EXPECT_NE(first.find("EXTNAME = '4400A"), std::string::npos) << name;
    EXPECT_NE(first.find("NAXIS1  =                    6 "), std::string::npos) << name;
    EXPECT_NE(first.find("CTYPE1  = 'LINEAR"), std::string::npos) << name;
    EXPECT_EQ(first.find("ZNAXIS1"), std::string::npos) << name;
    for (const char* hdu : {"[2]", "[5500A]"}) {
      const std::string second = header_text(path.string() + hdu);
      EXPECT_NE(second.find("EXTNAME = '5500A"), std::string::npos) << name << hdu;
    }
  }
  // A file whose name has these brackets comes before the HDU of another file.
  write_test_image({folder / "a.fits[1].fits", -32, ImageLayout::cube, false}, header);
  std::filesystem::rename(folder / "a.fits[1].fits", folder / "a.fits[1]");
  EXPECT_NE(header_text(folder / "a.fits[1]").find("SIMPLE"), std::string::npos);
}

TEST(HeaderText, WrongFilesAreInputErrors) {
  TemporaryFolder folder;
  const auto error = [&folder](const std::string& name) -> std::string {
    try {
      header_text(folder / name);
    } catch (const InputError& input_error) {
      const std::string text = input_error.what();
      return text.substr(text.rfind('/') + 1);
    }
    return "no error";
  };
  EXPECT_EQ(error("missing.fits").substr(0, 14), "missing.fits: ");
  EXPECT_EQ(error("missing.fits[1]").substr(0, 14), "missing.fits: ");
  write_image_with(folder / "a.fits", {});
  EXPECT_EQ(error("a.fits"), "no error");
  EXPECT_EQ(error("a.fits[SCENE]"), "a.fits: HDU 'SCENE' holds no image of two axes");
  EXPECT_EQ(error("a.fits[SCEN]"), "a.fits: no HDU 'SCEN' in it; did you mean 'SCENE'?");
  EXPECT_EQ(error("a.fits[9]"), "a.fits: no HDU 9 in it; the last one is 1");
  {
    FitsFile file = foreign_table(folder / "b.fits", BINARY_TBL, 1, {{"1D"}});
    file.close();
  }
  EXPECT_EQ(error("b.fits"), "b.fits: no image of two axes in it");
  std::ofstream(folder / "c.fits") << file_bytes(folder / "a.fits").substr(0, 1000);
  EXPECT_EQ(error("c.fits").substr(0, 8), "c.fits: ");
}

// ---- ECSV --------------------------------------------------------------------------------------

TEST(Ecsv, Text) {
  TemporaryFolder folder;
  const DataTable table = {
      "T",
      {{"x", "deg", "a \"b\" \\", Reals{0.1, nan_value, -positive_infinity, 1e300}},
       {"n", "", "", Integers{1, -2, 3, 4}},
       {"the name", "", "", Texts{"a", "b c", "", "\"\n"}}},
      {{"SEED", 5LL, ""}, {"SMALL", 1e-7, ""}, {"YES", true, ""}}};
  write_ecsv(folder / "a.ecsv", table);
  EXPECT_EQ(folder.file_count(), 1U);
  EXPECT_EQ(
      file_bytes(folder / "a.ecsv"),
      "# %ECSV 1.0\n"
      "# ---\n"
      "# datatype:\n"
      "# - {name: \"x\", unit: \"deg\", datatype: float64, description: \"a \\\"b\\\" \\\\\"}\n"
      "# - {name: \"n\", datatype: int64}\n"
      "# - {name: \"the name\", datatype: string}\n"
      "# meta: !!omap\n"
      "# - {EXTNAME: \"T\"}\n"
      "# - {\"SEED\": 5}\n"
      "# - {\"SMALL\": 1.0E-07}\n"
      "# - {\"YES\": true}\n"
      "# schema: astropy-2.0\n"
      "x n \"the name\"\n"
      "0.1 1 a\n"
      "nan -2 \"b c\"\n"
      "-inf 3 \"\"\n"
      "1e+300 4 \"\"\"%0A\"\n");
}

TEST(Ecsv, AstropyReadsIt) {
  if (astropy_python().empty()) GTEST_SKIP() << "no Python with Astropy";
  TemporaryFolder folder;
  DataTable table = test_table();
  // Astropy removes blanks at the end of a word.
  std::get<Texts>(table.columns[2].values)[3] = "Sérsic\n%41";
  write_ecsv(folder / "a.ecsv", table);
  write_ecsv(folder / "none.ecsv", {"NONE", {{"x", "nJy", "", Reals{}}}, {}});
  std::ofstream(folder / "read.py")
      << "import sys\n"
         "from astropy.table import Table\n"
         "t = Table.read(sys.argv[1], format='ascii.ecsv')\n"
         "print([(c.name, str(c.unit), c.dtype.kind) for c in t.itercols()])\n"
         "print(t['ra'].description, len(t['name'].description))\n"
         "print([repr(float(x)) for x in t['ra']], [int(i) for i in t['id']])\n"
         "print([str(x) for x in t['name'].filled('')] if hasattr(t['name'], 'filled') else "
         "[str(x) for x in t['name']])\n"
         "print(dict(t.meta))\n"
         "print(len(Table.read(sys.argv[2], format='ascii.ecsv')))\n";
  const CommandResult result =
      run_command(astropy_python() + " '" + (folder / "read.py").string() + "' '" +
                  (folder / "a.ecsv").string() + "' '" + (folder / "none.ecsv").string() + "'");
  EXPECT_EQ(result.output,
            "[('ra', 'deg', 'f'), ('id', 'None', 'i'), ('name', 'None', 'U'), "
            "('flux_sdss_g', 'nJy', 'f')]\n"
            "right ascension: \"the\" angle 100\n"
            "['0.1', 'nan', '-1e-310', 'inf', '0.3333333333333333'] "
            "[1, -2, 9223372036854775807, -9223372036854775808, 0]\n"
            "['plain', 'two words', '', 'Sérsic%0A%41', '\\'\"#,']\n"
            "{'EXTNAME': 'TRUTH', 'GAMERVER': 1, 'NOTE': 'about \\\\ it'}\n"
            "0\n");
}

TEST(Ecsv, FolderThatIsNotThereIsARunError) {
  TemporaryFolder folder;
  EXPECT_THROW(write_ecsv(folder / "no/a.ecsv", test_table()), RunError);
}

}  // namespace
}  // namespace gamer::data_table_test
