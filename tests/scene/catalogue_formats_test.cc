// A catalogue gives an identical scene in every format; bad files of each format end in errors.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "gamer/image/data_table.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/scene.h"
#include "image/damage.h"
#include "image/image_test_util.h"
#include "scene/scene_checks.h"

namespace gamer::catalogue_formats_test {
namespace {

using test::message_of;
using test::parameters_of;

const char* const galaxy = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";
const std::string view =
    "[image]\nsize = 100\n[spectrum]\nwavelengths = [5500]\n"
    "[camera]\nprojection = \"sky\"\ncenter = [150, 2]\npixel_scale = 1\n"
    "[catalogue]\ngalaxy = \"=smooth\"\n";

Scene read(const Catalogue& catalogue, const std::string& more = "") {
  const RenderParameters p = parameters_of(view + more);
  Resources data = Resources::from_record({{"galaxies/smooth", "galaxies/smooth.toml", galaxy}});
  return read_scene(catalogue, p, load_spectrum(p, data), Camera(p), data);
}

Catalogue parse(std::string_view text) {
  return Catalogue::parse(text, "c", CatalogueFormat::automatic);
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The second row of the catalogue lies outside the image.
DataTable table() {
  return {"OBJECTS",
          {{"NAME", "", "", std::vector<std::string>{"NGC", "no", "007"}},
           {"RAJ2000", "deg", "", std::vector<double>{150, 120, 150.00125}},
           {"DEJ2000", "deg", "", std::vector<double>{2, 2, 2.0025}},
           {"size_arcsec", "arcsec", "", std::vector<double>{2, 2, 3.5}},
           {"zphot", "", "", std::vector<double>{0.25, 0.5, 0.75}},
           {"Mass", "", "", std::vector<double>{1e9, 2e9, nan}},
           {"flags", "", "", std::vector<std::int64_t>{1, 2, 3}},
           {"Size", "", "", std::vector<std::string>{"large", "-", "small"}}},
          {}};
}

const std::string rows_of_blanks =
    "NGC 150 2 2 0.25 1e9 1 large\nno 120 2 2 0.5 2e9 2 -\n007 150.00125 2.0025 3.5 0.75 - 3 "
    "small\n";
const std::string names = "NAME RAJ2000 DEJ2000 size_arcsec zphot Mass flags Size";
const std::string csv =
    "NAME,RAJ2000,DEJ2000,size_arcsec,zphot,Mass,flags,Size\nNGC,150,2,2,0.25,1e9,1,large\n"
    "\"no\", 120, 2, 2, 0.5, 2e9, 2, \n007,+150.00125,2.0025,3.5,0.75,,3,small\n";
const std::string votable =
    "<?xml version='1.0'?>\n<!-- made by hand -->\n"
    "<v:VOTABLE xmlns:v='http://www.ivoa.net/xml/VOTable/v1.3'><v:RESOURCE>\n"
    "<v:TABLE name='OBJECTS'>\n<v:DESCRIPTION>a &lt; b</v:DESCRIPTION>\n"
    "<v:FIELD name='NAME' datatype='char' arraysize='*'/>\n"
    "<v:FIELD name='RAJ2000' datatype='double' unit='deg'/>\n"
    "<v:FIELD name='DEJ2000' datatype='double' unit='deg'/>\n"
    "<v:FIELD name='size_arcsec' datatype='double' unit='arcsec'/>\n"
    "<v:FIELD name='zphot' datatype='double'/>\n"
    "<v:FIELD name='cut' datatype='double' arraysize='2'/>\n"
    "<v:FIELD name='Mass' datatype='double'/>\n"
    "<v:FIELD name='flags' datatype='int'><v:VALUES null='-1'/></v:FIELD>\n"
    "<v:FIELD name='Size' datatype='char' arraysize='*'/>\n"
    "<v:DATA><v:TABLEDATA>\n"
    "<v:TR><v:TD>NGC</v:TD><v:TD>150</v:TD><v:TD> 2 </v:TD><v:TD>2</v:TD><v:TD>0.25</v:TD>"
    "<v:TD>1 2</v:TD><v:TD>1e9</v:TD><v:TD>1</v:TD><v:TD>large</v:TD></v:TR>\n"
    "<v:TR><v:TD>no</v:TD><v:TD>120</v:TD><v:TD>2</v:TD><v:TD>2</v:TD><v:TD>0.5</v:TD><v:TD/>"
    "<v:TD>2e9</v:TD><v:TD>2</v:TD><v:TD/></v:TR>\n"
    "<v:TR><v:TD>0<![CDATA[07]]></v:TD><v:TD>+150.00125</v:TD><v:TD>2.0025</v:TD><v:TD>3.5</v:TD>"
    "<v:TD>0.75</v:TD><v:TD/><v:TD>NaN</v:TD><v:TD>3</v:TD><v:TD>small</v:TD></v:TR>\n"
    "</v:TABLEDATA></v:DATA></v:TABLE></v:RESOURCE></v:VOTABLE>\n";

/// Values of a column as text, so that NaN equals NaN.
std::string text_of(const DataColumn& column) {
  return ecsv_text({"", {{column.name, "", "", column.values}}, {}});
}

void expect_same(const Scene& a, const Scene& b, const std::string& what) {
  EXPECT_EQ(a.list.str(), b.list.str()) << what;
  EXPECT_EQ(a.kept, b.kept) << what;
  ASSERT_EQ(a.others.columns.size(), b.others.columns.size()) << what;
  for (std::size_t c = 0; c < a.others.columns.size(); ++c) {
    EXPECT_EQ(text_of(a.others.columns[c]), text_of(b.others.columns[c])) << what;
  }
}

TEST(CatalogueFormats, MakeTheIdenticalScene) {
  const Scene expected = read(Catalogue::from_table(table(), "c"));
  ASSERT_EQ(expected.galaxies.size(), 2u);
  EXPECT_EQ(expected.kept, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(expected.list,
            "galaxy ra dec size_arcsec redshift id\nsmooth 150 2 2 0.25 NGC\n"
            "smooth 150.00125 2.0025 3.5 0.75 007\n");
  const std::string ecsv = ecsv_text(table());
  for (const auto& [text, format] :
       {std::pair{names + "\n" + rows_of_blanks, CatalogueFormat::list},
        {"# " + names + "\n" + rows_of_blanks, CatalogueFormat::list},
        {"# a remark\n#" + names + "\n" + rows_of_blanks, CatalogueFormat::list},
        {csv, CatalogueFormat::csv},
        {"# a remark, with a comma\n" + csv, CatalogueFormat::csv},
        {votable, CatalogueFormat::votable},
        {"\xef\xbb\xbf\n" + votable.substr(votable.find("<!--")), CatalogueFormat::votable},
        {ecsv, CatalogueFormat::ecsv}}) {
    const Catalogue catalogue = parse(text);
    EXPECT_EQ(catalogue.format(), format) << text;
    // Lists keep the plus sign of the file, which the expected list lacks.
    Scene scene = read(catalogue);
    std::string list = scene.list;
    if (const auto plus = list.find('+'); plus != std::string::npos) list.erase(plus, 1);
    scene.list = list;
    expect_same(scene, expected, text);
  }
  const TemporaryFolder folder;
  write_fits_table(folder / "c.fits", table(), {});
  expect_same(read(Catalogue::from_table(read_data_table(folder / "c.fits"), "c")), expected,
              "FITS");
}

TEST(CatalogueFormats, OtherColumnsKeepTheirTypes) {
  const Scene scene = read(parse(csv));
  std::vector<std::string> found;
  for (const DataColumn& column : scene.others.columns) found.push_back(column.name);
  // A scene has a column `size`, so that the catalogue's column is renamed.
  EXPECT_EQ(found, (std::vector<std::string>{"row", "Mass", "flags", "cat_Size"}));
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(scene.others.columns[0].values),
            (std::vector<std::int64_t>{1, 3}));
  const auto& mass = std::get<std::vector<double>>(scene.others.columns[1].values);
  EXPECT_EQ(mass[0], 1e9);
  EXPECT_TRUE(std::isnan(mass[1]));
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(scene.others.columns[2].values),
            (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(std::get<std::vector<std::string>>(scene.others.columns[3].values),
            (std::vector<std::string>{"large", "small"}));
}

TEST(CatalogueFormats, OtherColumnsOfWords) {
  const std::string head = "ra,dec,size_arcsec,a b,A_B,code,long,row,none\n";
  const Scene scene =
      read(parse(head + "150,2,1,1,1.5,007,12345678901234567890,4,\n150,2,1,,2,12,3,5,\n"));
  const auto& columns = scene.others.columns;
  std::vector<std::string> found;
  for (const DataColumn& column : columns) found.push_back(column.name);
  EXPECT_EQ(found,
            (std::vector<std::string>{"row", "a_b", "cat_A_B", "code", "long", "cat_row", "none"}));
  EXPECT_EQ(std::get<std::vector<double>>(columns[1].values)[0], 1);
  EXPECT_EQ(std::get<std::vector<double>>(columns[2].values)[0], 1.5);
  EXPECT_EQ(std::get<std::vector<std::string>>(columns[3].values)[0], "007");
  EXPECT_EQ(std::get<std::vector<std::string>>(columns[4].values)[0], "12345678901234567890");
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(columns[5].values)[1], 5);
  EXPECT_EQ(std::get<std::vector<std::string>>(columns[6].values)[0], "");
}

TEST(CatalogueFormats, QuotedWordsOfPlainTables) {
  const Catalogue catalogue = parse("ra dec name\n1 2 \"a b\"\n3 4 \"\"\n");
  ASSERT_EQ(catalogue.rows(), 2u);
  EXPECT_EQ(std::get<std::vector<std::string_view>>(catalogue.columns()[2].cells)[0], "a b");
  EXPECT_EQ(std::get<std::vector<std::string_view>>(catalogue.columns()[2].cells)[1], "-");
}

TEST(CatalogueFormats, KnowPlaces) {
  const Catalogue catalogue = parse("#ra,dec\n1,\"2\"\n");
  EXPECT_EQ(catalogue.columns()[1].where.text(), "c:1:5");
  EXPECT_EQ(catalogue.where(0, 1).text(), "c:2:3");
  EXPECT_EQ(parse(votable).where(1, 2).text(), "c:17");
}

TEST(CatalogueFormats, BadCsv) {
  const auto error = [](const std::string& text) { return message_of([&] { parse(text); }); };
  EXPECT_EQ(error("ra,dec\n1,2,3\n"), "c:2:5: the row has 3 values for 2 columns");
  EXPECT_EQ(error("ra,dec\n1,\"2\n"), "c:2:3: this quote is not closed on its line");
  EXPECT_EQ(message_of([&] { Catalogue::parse("\n", "c", CatalogueFormat::csv); }),
            "c: there is no header row with the names of the columns");
}

TEST(Votable, TableByNameOrNumber) {
  const std::string two =
      "<VOTABLE><RESOURCE><TABLE ID='a'><FIELD name='x'/></TABLE><TABLE name='B'>"
      "<FIELD name='y'/></TABLE></RESOURCE></VOTABLE>";
  const auto first_name = [&](const std::string& name) {
    return Catalogue::parse(two, "c", CatalogueFormat::automatic, name).columns()[0].name;
  };
  EXPECT_EQ(first_name(""), "x");
  EXPECT_EQ(first_name("A"), "x");
  EXPECT_EQ(first_name("b"), "y");
  EXPECT_EQ(first_name("2"), "y");
  EXPECT_EQ(message_of([&] { first_name("C"); }), "c: there is no TABLE 'C' in it");
}

TEST(Votable, LogicalsAndNulls) {
  const Catalogue catalogue = parse(
      "<VOTABLE><TABLE><FIELD name='b' datatype='boolean'/><FIELD name='i' datatype='short'>"
      "<VALUES null='-9'/></FIELD><DATA><TABLEDATA><TR><TD>T</TD><TD>-9</TD></TR>"
      "<TR><TD>false</TD><TD>4</TD></TR></TABLEDATA></DATA></TABLE></VOTABLE>");
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(catalogue.columns()[0].cells),
            (std::vector<std::int64_t>{1, 0}));
  EXPECT_TRUE(std::isnan(std::get<std::vector<double>>(catalogue.columns()[1].cells)[0]));
  EXPECT_EQ(std::get<std::vector<double>>(catalogue.columns()[1].cells)[1], 4);
}

TEST(Votable, BadFiles) {
  const auto error = [](const std::string& text) { return message_of([&] { parse(text); }); };
  const std::string begin = "<VOTABLE><TABLE><FIELD name='n' datatype='int'/><DATA>";
  const std::string end = "</DATA></TABLE></VOTABLE>";
  EXPECT_EQ(error("<html>\n"), "c:2:1: this is not XML: no element found");
  EXPECT_EQ(error("<html/>"), "c: there is no TABLE of a VOTable in it");
  EXPECT_EQ(error("<VOTABLE><a></b>"), "c:1:15: this is not XML: mismatched tag");
  EXPECT_EQ(error("<VOTABLE><TABLE><FIELD datatype='int'/></TABLE></VOTABLE>"),
            "c:1:17: the FIELD has no name");
  EXPECT_EQ(error(begin + "<BINARY2/>" + end),
            "c:1:55: the rows of this table are BINARY2; only those of TABLEDATA can be read: save "
            "it with format=\"tabledata\"");
  EXPECT_EQ(error(begin + "<TABLEDATA><TR>\n<TD>1.5</TD></TR></TABLEDATA>" + end),
            "c:2:8: column 'n': '1.5' is not an integer");
  EXPECT_EQ(error(begin + "<TABLEDATA>\n<TR></TR></TABLEDATA>" + end),
            "c:2:5: the row has 0 values for 1 columns");
  EXPECT_EQ(error(begin + "<TABLEDATA>\n<TR><TD>1</TD><TD>2</TD></TR></TABLEDATA>" + end),
            "c:2:15: the row has more values than the 1 columns");
  // Nested entities grow without bound.
  std::string bomb = "<!DOCTYPE v [<!ENTITY a0 \"" + std::string(100, 'x') + "\">";
  for (int i = 0; i < 12; ++i) {
    bomb += "<!ENTITY a" + std::to_string(i + 1) + " \"";
    for (int k = 0; k < 10; ++k) bomb += "&a" + std::to_string(i) + ";";
    bomb += "\">";
  }
  EXPECT_NE(error(bomb + "]><VOTABLE>&a12;</VOTABLE>").find("this is not XML: limit on input"),
            std::string::npos);
}

class DamagedFormats : public testing::Test {
 protected:
  void expect_errors(const std::string& name, const std::string& good) {
    const auto path = folder_ / name;
    EXPECT_EQ(read(Catalogue::parse(good, "good", CatalogueFormat::automatic)).galaxies.size(), 2u);
    expect_errors_that_name(
        path, [&](Damage& damage, unsigned) { return damage.of_text(good); },
        [&] {
          const std::string text = file_bytes(path);
          read(Catalogue::parse(text, path.string(), CatalogueFormat::automatic));
        });
  }
  TemporaryFolder folder_;
};

TEST_F(DamagedFormats, Csv) { expect_errors("damaged.csv", csv); }
TEST_F(DamagedFormats, Votable) { expect_errors("damaged.xml", votable); }
TEST_F(DamagedFormats, Plain) { expect_errors("damaged.txt", names + "\n" + rows_of_blanks); }

}  // namespace
}  // namespace gamer::catalogue_formats_test
