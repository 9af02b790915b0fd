#include "gamer/scene/catalogue.h"

#include <gtest/gtest.h>

#include <numbers>

#include "scene/scene_checks.h"

namespace gamer::catalogue_test {
namespace {

using test::message_of;

Catalogue parse(std::string_view text, CatalogueFormat format = CatalogueFormat::automatic) {
  return Catalogue::parse(text, "t.cat", format);
}

std::string error_of(const std::string& text, CatalogueFormat format = CatalogueFormat::automatic) {
  return message_of([&] { parse(text, format); });
}

std::vector<std::string> names(const Catalogue& catalogue) {
  std::vector<std::string> result;
  for (const auto& column : catalogue.columns()) result.push_back(column.name);
  return result;
}

/// The words of a column, whether the catalogue owns or views them.
std::vector<std::string> words(const Catalogue& catalogue, std::size_t column) {
  const auto& cells = catalogue.columns()[column].cells;
  if (const auto* views = std::get_if<std::vector<std::string_view>>(&cells)) {
    return {views->begin(), views->end()};
  }
  return std::get<std::vector<std::string>>(cells);
}

using Strings = std::vector<std::string>;

TEST(CatalogueList, SplitsAtBlanksAndSkipsComments) {
  const std::string text =
      "\xef\xbb\xbf# a comment\n\n  a\tb   c # the columns\r\n1 2 3\n   # nothing\n"
      "\t\xc3\xa9t\xc3\xa9 5\t\t6#7 # end";
  const Catalogue catalogue = parse(text);
  EXPECT_EQ(catalogue.format(), CatalogueFormat::list);
  EXPECT_EQ(names(catalogue), (Strings{"a", "b", "c"}));
  EXPECT_EQ(catalogue.columns()[1].where.text(), "t.cat:3:5");
  ASSERT_EQ(catalogue.rows(), 2u);
  EXPECT_EQ(words(catalogue, 0), (Strings{"1", "\xc3\xa9t\xc3\xa9"}));
  EXPECT_EQ(words(catalogue, 2), (Strings{"3", "6#7"}));
  EXPECT_EQ(catalogue.where(1, 0).text(), "t.cat:6:2");
  EXPECT_EQ(catalogue.where(1, 1).text(), "t.cat:6:6");
  EXPECT_EQ(catalogue.where(1, 2).text(), "t.cat:6:9");
}

TEST(CatalogueList, BadLists) {
  EXPECT_EQ(error_of("# only a comment\n"),
            "t.cat: there is no header row with the names of the columns");
  EXPECT_EQ(error_of("a b c\n1 2\n"), "t.cat:2:3: the row has 2 values for 3 columns");
  EXPECT_EQ(error_of("a b\n1 2 3 4\n"), "t.cat:2:5: the row has 4 values for 2 columns");
  std::string wide;
  for (int i = 0; i <= 10000; ++i) wide += "a ";
  EXPECT_EQ(error_of(wide), "t.cat:1:20001: there are more than 10000 columns");
  EXPECT_EQ(error_of("a\n", CatalogueFormat::fits), "t.cat: this is a text, not a FITS table");
}

TEST(CatalogueList, CommentsThatLookLikeOtherFormats) {
  EXPECT_EQ(parse("# 1 GALAXY only\ngalaxy x\nE 1\n").format(), CatalogueFormat::list);
  EXPECT_EQ(parse("# %ECSV is another format\na\n1\n", CatalogueFormat::list).rows(), 1u);
  EXPECT_EQ(parse("100 200\n1 2\n").format(), CatalogueFormat::list);
}

// Astropy 5.2.1 writes this text for one table with either delimiter.
const std::string ecsv_head =
    "# %ECSV 1.0\n"
    "# ---\n"
    "# datatype:\n"
    "# - {name: galaxy, datatype: string}\n"
    "# - {name: ra, unit: deg, datatype: float64}\n"
    "# - {name: dec, unit: deg, datatype: float64}\n"
    "# - {name: size_kpc, unit: kpc, datatype: float64, description: radius of the ball}\n"
    "# - {name: apparent_magnitude, unit: mag(AB), datatype: float32}\n"
    "# - {name: seed, datatype: int64}\n";
const std::string ecsv_meta =
    "# meta: !!omap\n"
    "# - {comment: made by hand}\n"
    "# - nested:\n"
    "#     a:\n"
    "#     - 1\n"
    "#     - 2\n"
    "#     - {b: 'c: d'}\n"
    "# schema: astropy-2.0\n";
const std::string ecsv_spaces = ecsv_head + ecsv_meta +
                                "galaxy ra dec size_kpc apparent_magnitude seed\n"
                                "ngc4321 150.1 2.2 10.5 21.5 1\n"
                                "\"say \"\"hi\"\", you\" 150.25 -2.5 \"\" 22.0 2\n"
                                "\"\" 3e-05 0.0 12.0 23.0 3\n";
const std::string ecsv_commas = ecsv_head + "# delimiter: ','\n" + ecsv_meta +
                                "galaxy,ra,dec,size_kpc,apparent_magnitude,seed\n"
                                "ngc4321,150.1,2.2,10.5,21.5,1\n"
                                "\"say \"\"hi\"\", you\",150.25,-2.5,,22.0,2\n"
                                ",3e-05,0.0,12.0,23.0,3\n";

TEST(CatalogueEcsv, ReadsWhatAstropyWrites) {
  for (const std::string& text : {ecsv_spaces, ecsv_commas}) {
    const Catalogue catalogue = parse(text);
    EXPECT_EQ(catalogue.format(), CatalogueFormat::ecsv);
    EXPECT_EQ(names(catalogue),
              (Strings{"galaxy", "ra", "dec", "size_kpc", "apparent_magnitude", "seed"}));
    Strings units;
    for (const auto& column : catalogue.columns()) units.push_back(column.unit);
    EXPECT_EQ(units, (Strings{"", "deg", "deg", "kpc", "mag(AB)", ""}));
    ASSERT_EQ(catalogue.rows(), 3u);
    EXPECT_EQ(words(catalogue, 0), (Strings{"ngc4321", "say \"hi\", you", "-"}));
    EXPECT_EQ(words(catalogue, 1), (Strings{"150.1", "150.25", "3e-05"}));
    EXPECT_EQ(words(catalogue, 3), (Strings{"10.5", "-", "12.0"}));
    EXPECT_EQ(words(catalogue, 5), (Strings{"1", "2", "3"}));
  }
}

TEST(CatalogueEcsv, KnowsPlaces) {
  const Catalogue spaces = parse(ecsv_spaces);
  EXPECT_EQ(spaces.columns()[1].where.text(), "t.cat:18:8");
  EXPECT_EQ(spaces.where(1, 0).text(), "t.cat:20:1");
  EXPECT_EQ(spaces.where(1, 1).text(), "t.cat:20:19");
  EXPECT_EQ(spaces.where(1, 4).text(), "t.cat:20:34");
  const Catalogue commas = parse(ecsv_commas);
  EXPECT_EQ(commas.where(1, 3).text(), "t.cat:21:31");
  EXPECT_EQ(commas.where(2, 1).text(), "t.cat:22:2");
}

TEST(CatalogueEcsv, TakesBlockStyleCommentsAndSpaces) {
  const Catalogue catalogue = parse(
      "# %ECSV 0.9\r\n# ---\r\n# delimiter: ','\r\n# datatype:\r\n# -\r\n#   name: a b\r\n"
      "#   unit: km / s\r\n#   datatype: int32\r\n# - name: 'c'\r\n\r\n \"a b\" , c\r\n"
      "# comment\r\n 1 , \"x, y\" \r\n\r\n");
  EXPECT_EQ(names(catalogue), (Strings{"a b", "c"}));
  EXPECT_EQ(catalogue.columns()[0].unit, "km / s");
  EXPECT_EQ(words(catalogue, 0), Strings{"1"});
  EXPECT_EQ(words(catalogue, 1), Strings{"x, y"});
}

TEST(CatalogueEcsv, BadFiles) {
  const std::string open = "# %ECSV 1.0\n# ---\n";
  const std::string two = open + "# datatype:\n# - {name: a}\n# - {name: b}\n";
  EXPECT_EQ(error_of("a b\n1 2\n", CatalogueFormat::ecsv),
            "t.cat:1:1: an ECSV file begins with '# %ECSV 1.0'");
  EXPECT_EQ(error_of("# %ECSV 2.0\n"), "t.cat:1:1: ECSV of version '2.0' is not known; 1.0 is");
  EXPECT_EQ(error_of(open + "# datatype: [1\na\n1\n"),
            "t.cat:3:3: the head is not YAML: end of sequence flow not found");
  EXPECT_EQ(error_of(open + "# meta: {}\na\n1\n"),
            "t.cat:3:3: the head has no 'datatype', the list of columns");
  EXPECT_EQ(error_of(open + "# datatype: {name: a}\na\n1\n"),
            "t.cat:3:13: 'datatype' must be a list of columns");
  EXPECT_EQ(error_of(open + "# datatype:\n# - a\na\n1\n"),
            "t.cat:4:5: a column must be a map like {name: ra}");
  EXPECT_EQ(error_of(open + "# datatype:\n# - {unit: m}\na\n1\n"),
            "t.cat:4:5: the column has no name");
  EXPECT_EQ(error_of(open + "# datatype:\n# - {name: [a]}\na\n1\n"),
            "t.cat:4:12: 'name' must be a text");
  EXPECT_EQ(error_of(open + "# datatype: [{name: a}]\n# delimiter: '|'\na\n1\n"),
            "t.cat:4:14: the delimiter '|' is neither a space nor a comma");
  EXPECT_EQ(error_of("# %ECSV 1.0\n"), "t.cat:1: the head must be a YAML map with a 'datatype'");
  EXPECT_EQ(error_of(two), "t.cat: there is no row with the names of the columns below the head");
  EXPECT_EQ(error_of(two + "a c\n1 2\n"),
            "t.cat:6:3: this name is 'c', but column 2 of the head is 'b'");
  EXPECT_EQ(error_of(two + "a\n1\n"),
            "t.cat:6:1: the row of names has 1 value for the 2 columns of the head");
  EXPECT_EQ(error_of(two + "a b\n1 2\n1\n"), "t.cat:8:1: the row has 1 value for 2 columns");
  EXPECT_EQ(error_of(two + "a b\n1 \"2\n"), "t.cat:7:3: this quote is not closed on its line");
  EXPECT_EQ(error_of(two + "a b\n\"1\"2 3\n"),
            "t.cat:7:4: a quoted value must end at its closing quote; a quote inside is doubled");
  EXPECT_EQ(error_of(two + "# delimiter: ','\na,b\n\"1\" 2,3\n"),
            "t.cat:8:5: expected a comma behind the quoted value");
  EXPECT_EQ(error_of(open + "# x: " + std::string(100000, '[') + "\n"),
            "t.cat:3:3: the head is nested too deeply");
  EXPECT_EQ(error_of(open + "# x: \"" + std::string(std::size_t{1} << 20, 'x') + "\"\n"),
            "t.cat:3:1: the head is larger than 1048576 bytes");
}

// SExtractor 2.25 writes this text with CATALOG_TYPE ASCII_HEAD and three apertures.
const std::string sextractor_head =
    "#   1 NUMBER                 Running object number                                     \n"
    "#   2 X_IMAGE                Object position along x                                    "
    "[pixel]\n"
    "#   3 MAG_AUTO               Kron-like elliptical aperture magnitude                    "
    "[mag]\n"
    "#   4 FLUX_APER              Flux vector within fixed circular aperture(s)              "
    "[count]\n"
    "#   7 ALPHA_J2000            Right ascension of barycenter (J2000)                      "
    "[deg]\n"
    "#   8 DELTA_J2000            Declination of barycenter (J2000)                          "
    "[deg]\n"
    "#   9 THETA_J2000            Position angle (east of north) (J2000)                     "
    "[deg]\n"
    "#  10 ISOAREA_IMAGE          Isophotal area above Analysis threshold                    "
    "[pixel**2]\n"
    "#  11 MAG_APER               Fixed aperture magnitude vector                            "
    "[mag]\n";
const std::string sextractor = sextractor_head +
                               "         1     31.2005 -10.7309     3196.931     7630.216     "
                               "14054.61 150.0010451  +1.9995393 "
                               "-85.42       244  -8.7618  -9.7063 -10.3695\n"
                               "         2     71.0012 -10.7303     3201.219     7628.683      "
                               "14064.9 149.9988326  +1.9984168 "
                               "-31.57       240  -8.7633  -9.7061 -10.3703\n";

TEST(CatalogueSextractor, ReadsWhatSextractorWrites) {
  const Catalogue catalogue = parse(sextractor);
  EXPECT_EQ(catalogue.format(), CatalogueFormat::sextractor);
  EXPECT_EQ(names(catalogue), (Strings{"NUMBER", "X_IMAGE", "MAG_AUTO", "FLUX_APER", "FLUX_APER_1",
                                       "FLUX_APER_2", "ALPHA_J2000", "DELTA_J2000", "THETA_J2000",
                                       "ISOAREA_IMAGE", "MAG_APER", "MAG_APER_1", "MAG_APER_2"}));
  EXPECT_EQ(catalogue.columns()[0].unit, "");
  EXPECT_EQ(catalogue.columns()[1].unit, "pixel");
  EXPECT_EQ(catalogue.columns()[5].unit, "count");
  EXPECT_EQ(catalogue.columns()[9].unit, "pixel**2");
  EXPECT_EQ(catalogue.columns()[6].where.text(), "t.cat:5:7");
  ASSERT_EQ(catalogue.rows(), 2u);
  EXPECT_EQ(words(catalogue, 7), (Strings{"+1.9995393", "+1.9984168"}));
  EXPECT_EQ(words(catalogue, 12), (Strings{"-10.3695", "-10.3703"}));
  EXPECT_EQ(catalogue.where(1, 2).text(), "t.cat:11:24");
}

TEST(CatalogueSextractor, TakesNoRows) {
  const Catalogue catalogue = parse(sextractor_head);
  EXPECT_EQ(catalogue.format(), CatalogueFormat::sextractor);
  EXPECT_EQ(catalogue.rows(), 0u);
  EXPECT_EQ(catalogue.columns().size(), 11u);
}

TEST(CatalogueSextractor, BadFiles) {
  const auto format = CatalogueFormat::sextractor;
  EXPECT_EQ(error_of("1 2 3\n", format),
            "t.cat: there is no head with lines like '#   1 NUMBER   comment   [unit]'");
  EXPECT_EQ(error_of("#  2 X_IMAGE\n1 2\n", format),
            "t.cat:1:4: the first column is number 2, not 1");
  EXPECT_EQ(error_of("# 1 A\n# 3 B\n# 2 C\n1 2 3\n"), "t.cat:3:3: column 2 stands below column 3");
  EXPECT_EQ(error_of("# 1 A\n# 99999999999999999999999 B\n1 2\n"),
            "t.cat:2:3: columns are numbered from 1 to 10000");
  EXPECT_EQ(error_of("# 1 A\n# 9999 B\n1 2\n"), "t.cat:3:3: the row has 2 values for 9999 columns");
  EXPECT_EQ(error_of("# 1 A\n# 2 B\n1 2 3\n1 2\n"),
            "t.cat:4:3: the row has 2 values for 3 columns");
}

TEST(CatalogueFits, TakesTheTable) {
  DataTable table;
  table.columns = {{"ra", "deg", "", std::vector<double>{1.5, 2.5}},
                   {"seed", "", "", std::vector<std::int64_t>{3, 4}},
                   {"galaxy", "", "", std::vector<std::string>{"barred", ""}}};
  const Catalogue catalogue = Catalogue::from_table(std::move(table), "c.fits");
  EXPECT_EQ(catalogue.format(), CatalogueFormat::fits);
  EXPECT_EQ(names(catalogue), (Strings{"ra", "seed", "galaxy"}));
  EXPECT_EQ(catalogue.columns()[0].unit, "deg");
  ASSERT_EQ(catalogue.rows(), 2u);
  EXPECT_EQ(std::get<std::vector<double>>(catalogue.columns()[0].cells)[1], 2.5);
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(catalogue.columns()[1].cells)[1], 4);
  EXPECT_EQ(words(catalogue, 2), (Strings{"barred", "-"}));
  EXPECT_EQ(catalogue.where(1, 0).text(), "c.fits, row 2");
}

TEST(UnitFactor, ConvertsWithinADimension) {
  EXPECT_EQ(unit_factor("deg", "deg"), 1.0);
  EXPECT_EQ(unit_factor("arcsec", "deg"), 1.0 / 3600);
  EXPECT_EQ(unit_factor("deg", "arcsec"), 3600.0);
  EXPECT_EQ(unit_factor("mas", "arcsec"), 1e-3);
  EXPECT_EQ(unit_factor("arcmin", "arcsec"), 60.0);
  EXPECT_EQ(unit_factor("hourangle", "deg"), 15.0);
  EXPECT_DOUBLE_EQ(*unit_factor("rad", "deg"), 180 / std::numbers::pi);
  EXPECT_EQ(unit_factor("pc", "kpc"), 1e-3);
  EXPECT_EQ(unit_factor("Mpc", "kpc"), 1e3);
  EXPECT_EQ(unit_factor("um", "Angstrom"), 1e4);
  EXPECT_EQ(unit_factor("nm", "Angstrom"), 10.0);
  EXPECT_EQ(unit_factor("mag(AB)", "mag"), 1.0);
  EXPECT_EQ(unit_factor("pixel", "pix"), 1.0);
  EXPECT_EQ(unit_factor("", ""), 1.0);
}

TEST(UnitFactor, RefusesOthers) {
  for (const auto& [from, to] : {std::pair{"deg", "kpc"},
                                 {"", "deg"},
                                 {"deg", ""},
                                 {"Deg", "deg"},
                                 {"mpc", "Mpc"},
                                 {"mag", ""},
                                 {"deg**2", "deg"},
                                 {"furlong", "furlong"},
                                 {"um", "kpc"}}) {
    EXPECT_FALSE(unit_factor(from, to)) << from << " " << to;
  }
}

}  // namespace
}  // namespace gamer::catalogue_test
