#include "scene/suspicious_values.h"

#include <gtest/gtest.h>

#include <string>

#include "scene/scene_checks.h"

namespace gamer::suspicious_values_test {
namespace {

using test::message_of;
using test::parameters_of;

/// The error about a table, and the numbers of flagged rows, as "1 3".
struct Result {
  std::string error;
  std::string rows;
};

Result check(const std::string& csv, const std::string& galaxy = "galaxy = \"=E\"\n") {
  const RenderParameters p =
      parameters_of("[camera]\nprojection = \"sky\"\n[catalogue]\n" + galaxy);
  const Catalogue catalogue = Catalogue::parse(csv, "c.csv", CatalogueFormat::csv);
  SceneRow row(catalogue, p);
  const SuspiciousValues values(catalogue, row);
  Result result{message_of([&] { values.refuse(); }), ""};
  for (std::size_t i = 0; i < catalogue.rows(); ++i) {
    if (!values.is_flagged(i)) continue;
    result.rows += (result.rows.empty() ? "" : " ") + std::to_string(i + 1);
  }
  return result;
}

const std::string skip = "; with catalogue.skip_flagged = true such rows are left out";

TEST(SuspiciousValues, NamesAllValuesWithTheirRows) {
  const Result result = check(
      "ra,dec,mag_r,zphot,r_e\n1,2,99,0.1,1\n1,2,20,-1,1\n1,2,99.0,,1\n1,-999,20,0.1,1e20\n"
      "1,2,99,nan,1\n1,2,20,0.1,\n");
  EXPECT_EQ(
      result.error,
      "c.csv:2:5: apparent_magnitude = 99 looks like a flag for a missing value (column mag_r, "
      "rows 1, 5); redshift = -1 looks like a flag for a missing value (column zphot, row 2); "
      "apparent_magnitude = 99.0 looks like a flag for a missing value (column mag_r, row 3); "
      "redshift has no value (column zphot, row 3); "
      "dec = -999 looks like a flag for a missing value (row 4); and 3 more values" +
          skip);
  EXPECT_EQ(result.rows, "1 2 3 4 5 6");
}

TEST(SuspiciousValues, FirstRowsAndTheNumberOfOthers) {
  std::string table = "ra,dec,mag_r\n1,2,20\n";
  for (int i = 0; i < 8; ++i) table += "1,2,-99\n";
  EXPECT_EQ(check(table).error,
            "c.csv:3:5: apparent_magnitude = -99 looks like a flag for a missing value (column "
            "mag_r, rows 2, 3, 4, 5, 6 and 3 more)" +
                skip);
}

TEST(SuspiciousValues, GoodValuesPass) {
  const Result result = check(
      "ra,dec,mag_r,zphot,pa,g1,size_arcsec\n99,-9,-30,0,-99,-0.1,99\n0,0,30,9,99,0,999\n"
      "-5,90,89,20,360,0.2,0.5\n");
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(result.rows, "");
}

TEST(SuspiciousValues, EachUsualFlag) {
  for (const char* flag : {"-99", "99", "-999", "999", "1e20", "-1e30", "nan", "inf", "-9999"}) {
    for (const char* column : {"mag_r", "redshift"}) {
      const std::string row = std::string("1,2,") + flag + "\n";
      EXPECT_EQ(check(std::string("ra,dec,") + column + "\n1,2,3\n" + row).rows, "2")
          << column << " = " << flag;
    }
  }
}

TEST(SuspiciousValues, AnotherColumnMayTellTheSame) {
  EXPECT_EQ(check("ra,dec,redshift,distance\n1,2,0.1,\n1,2,,400\n").error, "");
  EXPECT_EQ(check("ra,dec,redshift,distance\n1,2,0.1,\n1,2,,\n").error,
            "c.csv:3:5: redshift has no value (row 2)" + skip);
  // A column without any value counts as absent.
  EXPECT_EQ(check("ra,dec,redshift\n1,2,\n1,2,\n").error, "");
}

TEST(SuspiciousValues, StarsAndRoundGalaxiesNeedLess) {
  const std::string mapped = "galaxy = \"type\"\n";
  const std::string types = "type,ra,dec,mag_r,r_e,axis_ratio,pa\nE,1,2,20,1,0.5,10\n";
  EXPECT_EQ(check(types + "star,1,2,20,,,\n", mapped).error, "");
  EXPECT_EQ(check(types + "E,1,2,20,1,1,\n", mapped).error, "");
  EXPECT_EQ(check(types + "E,1,2,20,1,0.5,\n", mapped).error,
            "c.csv:3:16: pa has no value (row 2)" + skip);
  EXPECT_EQ(check(types + "star,1,2,,,,\n", mapped).error,
            "c.csv:3:10: apparent_magnitude has no value (column mag_r, row 2)" + skip);
}

// In a catalogue with a column `galaxy`, which is made for gamer, an empty cell means the default.
TEST(SuspiciousValues, GalaxyColumn) {
  const std::string table = "galaxy,ra,dec,magnitude,redshift\nE,1,2,-20,0.1\nE,1,2,-20,\n";
  EXPECT_EQ(check(table, "").error, "");
  EXPECT_EQ(check(table, "").rows, "");
  EXPECT_EQ(check(table + "E,1,2,,0.1\n", "").rows, "3");
  EXPECT_NE(check(table + "E,1,2,99,0.1\n", "").error, "");
}

}  // namespace
}  // namespace gamer::suspicious_values_test
