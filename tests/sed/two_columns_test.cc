#include "sed/two_columns.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/error_text.h"

namespace gamer::two_columns_test {
namespace {

const TwoColumnFormat sed_format = {"flux", {"flambda", "fnu", "fphotons"}};
const std::string file_head = "# wavelength: Angstrom\n# flux: flambda\n";

TwoColumns parse(const std::string& text) { return parse_two_columns(text, "x.sed", sed_format); }

std::string error(const std::string& text) {
  return error_text([&] { parse(text); });
}

TEST(TwoColumns, ReadsRowsAndHead) {
  const TwoColumns table = parse(
      "# A title, no key\r\n#Wavelength :  nm  \r\n#  source: somewhere: 1980\r\n# FLUX: Fnu\r\n"
      "\r\n  100\t+2.5e-1 # a remark: with a colon\r\n# flux: flambda\r\n\t200.5  3\r\n300 0");
  EXPECT_EQ(table.kind, "fnu");
  EXPECT_EQ(table.wavelengths, (std::vector<double>{1000, 2005, 3000}));
  EXPECT_EQ(table.values, (std::vector<double>{0.25, 3, 0}));
  EXPECT_EQ(table.where[1].text(), "x.sed:8:9");
  EXPECT_EQ(table.range().low, 1000);
  EXPECT_EQ(table.range().high, 3000);
}

TEST(TwoColumns, UnitsOfWavelength) {
  const std::vector<std::pair<std::string, double>> units = {
      {"Angstrom", 1}, {"angstrom", 1}, {"ANGSTROM", 1}, {"nm", 10}, {"um", 10000}};
  for (const auto& [unit, angstrom] : units) {
    const TwoColumns table = parse("# wavelength: " + unit + "\n# flux: fnu\n1 1\n2 1\n");
    EXPECT_EQ(table.wavelengths, (std::vector<double>{angstrom, 2 * angstrom})) << unit;
  }
}

TEST(TwoColumns, InterpolatesLinearlyAndExactlyAtTheRows) {
  const TwoColumns table = parse(file_head + "1000 0.1\n1100 0.3\n1500 0.7\n");
  EXPECT_EQ(table.interpolate(1000), 0.1);
  EXPECT_EQ(table.interpolate(1100), 0.3);
  EXPECT_EQ(table.interpolate(1500), 0.7);
  EXPECT_DOUBLE_EQ(table.interpolate(1025), 0.15);
  EXPECT_DOUBLE_EQ(table.interpolate(1400), 0.6);
  EXPECT_TRUE(table.covers(1000));
  EXPECT_TRUE(table.covers(1500));
  EXPECT_FALSE(table.covers(999.9));
  EXPECT_FALSE(table.covers(1500.1));
}

TEST(TwoColumns, OptionalNumbersOfTheHead) {
  const TwoColumnFormat format = {
      "flux",
      {"fnu"},
      {{"gain", Interval::left_open(0, 10), 1.5}, {"offset", Interval::any(), -2}}};
  const auto numbers = [&](const std::string& lines) {
    return parse_two_columns("# wavelength: nm\n# flux: fnu\n" + lines + "1 1\n2 1\n", "y", format)
        .numbers;
  };
  const auto message = [&](const std::string& lines) {
    return error_text([&] { numbers(lines); });
  };
  EXPECT_EQ(numbers(""), (std::vector<double>{1.5, -2}));
  EXPECT_EQ(numbers("# offset: +3e1\n# Gain : 10\n"), (std::vector<double>{10, 30}));
  EXPECT_EQ(message("# gain:  11\n"), "y:3:10: gain 11 is outside ]0, 10]");
  EXPECT_EQ(message("# gain: ten\n"), "y:3:9: 'ten' is not a number");
  EXPECT_EQ(message("# gain: inf\n"), "y:3:9: 'inf' is not finite");
  EXPECT_EQ(message("# gain:\n"), "y:3:8: '' is not a number");
  EXPECT_EQ(message("# gain: 1\n# gain: 1\n"), "y:4:9: 'gain' is given twice, first in line 3");
  EXPECT_EQ(parse(file_head + "1 1\n2 1\n").numbers, std::vector<double>{});
}

TEST(TwoColumns, ErrorsOfTheHead) {
  EXPECT_EQ(error("1 1\n2 2\n"),
            "x.sed:1:1: the head does not say the wavelength; add the line "
            "'# wavelength: Angstrom' (or nm, um)");
  EXPECT_EQ(error("# wavelength: nm\n1 1\n2 2\n"),
            "x.sed:1:1: the head does not say the flux; add the line "
            "'# flux: flambda' (or fnu, fphotons)");
  EXPECT_EQ(error("# wavelength: nm\n1 1\n# flux: fnu\n2 2\n"),
            "x.sed:1:1: the head does not say the flux; add the line "
            "'# flux: flambda' (or fnu, fphotons)");
  EXPECT_EQ(error("# wavelength: Angstroms\n# flux: fnu\n1 1\n2 2\n"),
            "x.sed:1:15: unknown wavelength 'Angstroms', known: Angstrom, nm, um; "
            "did you mean 'Angstrom'?");
  EXPECT_EQ(error("# wavelength:\n# flux: fnu\n1 1\n2 2\n"),
            "x.sed:1:14: unknown wavelength '', known: Angstrom, nm, um");
  EXPECT_EQ(error("# wavelength: nm\n# flux: fnuu\n1 1\n2 2\n"),
            "x.sed:2:9: unknown flux 'fnuu', known: flambda, fnu, fphotons; did you mean 'fnu'?");
  EXPECT_EQ(error("# wavelength: nm\n# flux: fnu\n# wavelength: um\n1 1\n2 2\n"),
            "x.sed:3:15: 'wavelength' is given twice, first in line 1");
  EXPECT_EQ(error_text([] {
              parse_two_columns("# wavelength: nm\n", "y", {"extinction", {"relative"}});
            }),
            "y:1:1: the head does not say the extinction; add the line '# extinction: relative'");
}

TEST(TwoColumns, ErrorsOfTheRows) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"1 1\n2\n", "4:1: 1 column where 2 are expected"},
      {"1 1\n2 1 0.1 5\n", "4:5: 4 columns where 2 are expected"},
      {"1 1\n 2,5 1\n", "4:2: '2,5' is not a number"},
      {"1 1\n2  one\n", "4:4: 'one' is not a number"},
      {"1 1\n2 1\x01\n", "4:3: '1\\x01' is not a number"},
      {"1 1\n2 +-1\n", "4:3: '+-1' is not a number"},
      {"1 1\n2 0x1p3\n", "4:3: '0x1p3' is not a number"},
      {"1 1\n2 1e999\n", "4:3: '1e999' is too large or too small for a number"},
      {"1 1\n2 nan\n", "4:3: 'nan' is not finite"},
      {"1 1\ninf 1\n", "4:1: 'inf' is not finite"},
      {"0 1\n2 1\n", "3:1: wavelength 0 Angstrom is outside ]0, inf["},
      {"-1 1\n2 1\n", "3:1: wavelength -1 Angstrom is outside ]0, inf["},
      {"1 1\n3 1\n2 1\n", "5:1: wavelengths are not ascending: 2 after 3"},
      {"1 1\n1 1\n", "4:1: wavelengths are not ascending: 1 after 1"},
      {"1 1\n2 -0.5\n", "4:3: negative flux: -0.5"},
      {"1 0\n2 0\n", "3:3: the flux is zero in all rows"},
      {"1 1\n", "3:1: 1 row where at least 2 are needed"},
      {"", "2:1: 0 rows where at least 2 are needed"},
  };
  for (const auto& [rows, message] : cases) EXPECT_EQ(error(file_head + rows), "x.sed:" + message);
}

TEST(TwoColumns, OverflowOfTheUnit) {
  EXPECT_EQ(error("# wavelength: um\n# flux: fnu\n1 1\n1e308 1\n"),
            "x.sed:4:1: wavelength 1e308 um is outside ]0, inf[");
}

}  // namespace
}  // namespace gamer::two_columns_test
