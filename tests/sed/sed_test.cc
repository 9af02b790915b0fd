#include "gamer/sed/sed.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "sed/shipped.h"

namespace gamer::sed_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::string name_error(const std::string& name) {
  return error_text([&] { analytic(name); });
}

std::string sed_error(const std::string& text) {
  return error_text([&] { parse_sed(text, "x.sed", "x"); });
}

// The nodes where the shipped templates differ most from their neighbours (docs/facts.md section
// 2).
TEST(ShippedSeds, AgreeWithTheTable) {
  struct Row {
    double wavelength;
    std::array<double, 4> flux;  // E, Sbc, Scd, Im
  };
  const std::vector<Row> rows = {{900, {0.02598, 0.08015, 0.2163, 0.5215}},
                                 {1000, {0.04726, 0.6119, 1.676, 4.069}},
                                 {2300, {0.0326, 0.36, 0.7576, 1.914}},
                                 {3730, {0.3298, 0.732, 1.008, 2.131}},
                                 {4030, {0.586, 0.9487, 1.09, 1.481}},
                                 {5005, {0.9082, 1.022, 1.261, 2.168}},
                                 {5500, {1, 1, 1, 1}},
                                 {7180, {0.9134, 0.856, 0.7669, 0.7769}},
                                 {25000, {0.08526, 0.07067, 0.04537, 0.04087}}};
  const std::array<std::string, 4> names = {"E", "Sbc", "Scd", "Im"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto sed = shipped_sed(names[i]);
    EXPECT_EQ(sed->name(), names[i]);
    EXPECT_EQ(sed->range().low, 91);
    EXPECT_EQ(sed->range().high, 25000);
    for (const double wavelength : {91.0, 500.0, 899.9}) {
      EXPECT_EQ(sed->flux(wavelength), 0) << names[i] << " at " << wavelength;
    }
    for (const Row& row : rows) {
      EXPECT_EQ(sed->flux(row.wavelength), row.flux[i]) << names[i] << " at " << row.wavelength;
    }
    EXPECT_DOUBLE_EQ(sed->flux(5000),
                     sed->flux(4950) + 50.0 / 55 * (sed->flux(5005) - sed->flux(4950)));
  }
}

TEST(ParseSed, NormalisesAt5500) {
  const auto sed =
      parse_sed("# wavelength: um\n# flux: flambda\n0.5 4\n0.6 8\n0.7 0\n", "x.sed", "x");
  EXPECT_EQ(sed->flux(5500), 1);
  EXPECT_DOUBLE_EQ(sed->flux(5000), 4.0 / 6);
  EXPECT_DOUBLE_EQ(sed->flux(6500), 4.0 / 6);
  EXPECT_EQ(sed->flux(7000), 0);
  EXPECT_EQ(sed->range().low, 5000);
  EXPECT_EQ(sed->range().high, 7000);
}

// A constant f_nu or photon rate stays constant between two rows; a slope is that of the given
// quantity.
TEST(ParseSed, ConvertsFnuAndPhotons) {
  const auto fnu = parse_sed("# wavelength: nm\n# flux: fnu\n100 3\n2000 3\n", "x.sed", "x");
  const auto photons =
      parse_sed("# wavelength: nm\n# flux: fphotons\n100 3\n2000 3\n", "x.sed", "x");
  for (const double wavelength : {1000.0, 3000.0, 5500.0, 11000.0, 20000.0}) {
    const double ratio = 5500 / wavelength;
    EXPECT_DOUBLE_EQ(fnu->flux(wavelength), ratio * ratio);
    EXPECT_DOUBLE_EQ(photons->flux(wavelength), ratio);
  }
  // f_nu ~ lambda: f_lambda ~ 1/lambda; photons ~ lambda: f_lambda constant.
  const auto red_fnu = parse_sed("# wavelength: nm\n# flux: fnu\n100 1\n2000 20\n", "x.sed", "x");
  const auto red_photons =
      parse_sed("# wavelength: nm\n# flux: fphotons\n100 1\n2000 20\n", "x.sed", "x");
  for (const double wavelength : {1000.0, 3000.0, 5500.0, 11000.0, 20000.0}) {
    EXPECT_DOUBLE_EQ(red_fnu->flux(wavelength), 5500 / wavelength);
    EXPECT_DOUBLE_EQ(red_photons->flux(wavelength), 1);
  }
}

TEST(ParseSed, Errors) {
  const std::string sed_head = "# wavelength: nm\n# flux: fnu\n";
  EXPECT_EQ(sed_error(sed_head + "100 1\n200 1\n"),
            "x.sed:4:1: wavelengths 1000 to 2000 Angstrom do not cover 5500 Angstrom, where SEDs "
            "are normalised");
  EXPECT_EQ(sed_error(sed_head + "600 1\n700 1\n"),
            "x.sed:3:1: wavelengths 6000 to 7000 Angstrom do not cover 5500 Angstrom, where SEDs "
            "are normalised");
  EXPECT_EQ(sed_error(sed_head + "400 1\n500 0\n600 0\n"),
            "x.sed:5:5: no flux at 5500 Angstrom, where SEDs are normalised");
  EXPECT_EQ(sed_error(sed_head + "400 1e300\n550 1e-300\n600 1\n"),
            "x.sed:4:5: the flux at 5500 Angstrom is too small beside the largest to normalise by "
            "it");
  EXPECT_EQ(sed_error(sed_head + "1e-200 1\n550 1\n"),
            "x.sed:4:5: the flux at 5500 Angstrom is too small beside the largest to normalise by "
            "it");
  EXPECT_EQ(sed_error(sed_head + "1 0\n550 1e-320\n"),
            "x.sed:4:5: the flux at 5500 Angstrom, 1e-320, is too small to normalise by it");
  EXPECT_EQ(sed_error(""),
            "x.sed:1:1: the head does not say the wavelength; add the line "
            "'# wavelength: Angstrom' (or nm, um)");
}

TEST(AnalyticSeds, FlatAndPowerLaws) {
  for (const double wavelength : {912.0, 3000.0, 5500.0, 8000.0, 1e7}) {
    const double ratio = wavelength / 5500;
    EXPECT_EQ(analytic("flat")->flux(wavelength), 1);
    EXPECT_DOUBLE_EQ(analytic("flat_fnu")->flux(wavelength), 1 / (ratio * ratio));
    EXPECT_DOUBLE_EQ(analytic("powerlaw(-1.5)")->flux(wavelength), 1 / (ratio * std::sqrt(ratio)));
    EXPECT_DOUBLE_EQ(analytic("powerlaw( 2 )")->flux(wavelength), ratio * ratio);
  }
  EXPECT_EQ(analytic("flat_fnu")->name(), "flat_fnu");
}

// The values are ratios of Planck's law in 40-digit arithmetic, with hc/k = 0.01438776877503933 m
// K.
TEST(AnalyticSeds, Blackbody) {
  struct Case {
    std::string name;
    double wavelength;
    double flux;
  };
  const std::vector<Case> cases = {{"blackbody(5800 K)", 3000, 0.4777435421906621},
                                   {"blackbody(5800 K)", 4000, 0.8975273878784149},
                                   {"blackbody(5800K)", 10000, 0.413449645989934},
                                   {"blackbody( 5800  K )", 22000, 0.04206546273654484},
                                   {"blackbody(3000 K)", 4000, 0.1867777429243393},
                                   {"blackbody(2e4 K)", 1500, 14.90291072590762},
                                   {"blackbody(1e7 K)", 900, 1385.392597418187},
                                   {"blackbody(50 K)", 5510, 2.561129481765486},
                                   {"blackbody(40 K)", 600000, 1.708494592843149e+271},
                                   {"blackbody(5800 K)", 1e7, 1.822610581114649e-12}};
  for (const Case& c : cases) {
    // The exponent is up to 650, and its rounding grows by as much in the flux.
    EXPECT_NEAR(analytic(c.name)->flux(c.wavelength) / c.flux, 1, 1.4e-13)
        << c.name << " at " << c.wavelength;
    EXPECT_EQ(analytic(c.name)->flux(5500), 1) << c.name;
  }
}

TEST(AnalyticSeds, BlackbodyPeaksWhereWienSays) {
  constexpr double wien = 2.897771955e7;  // Angstrom K
  for (const double temperature : {100.0, 5800.0, 1e6}) {
    const auto sed = analytic("blackbody(" + std::to_string(temperature) + " K)");
    const double peak = wien / temperature;
    // The vertex of the parabola through three points around the peak, as a relative shift.
    constexpr double h = 1e-3;
    const double low = std::log(sed->flux(peak * std::exp(-h)));
    const double middle = std::log(sed->flux(peak));
    const double high = std::log(sed->flux(peak * std::exp(h)));
    const double shift = h * (high - low) / (2 * (2 * middle - low - high));
    EXPECT_NEAR(shift, 0, 3.7e-7) << temperature;
  }
}

TEST(AnalyticSeds, FiniteAtAllWavelengths) {
  for (const std::string name :
       {"flat", "flat_fnu", "powerlaw(100)", "powerlaw(-100)", "blackbody(1e-320 K)",
        "blackbody(1e-3 K)", "blackbody(2.7 K)", "blackbody(5800 K)", "blackbody(1e7 K)"}) {
    const auto sed = analytic(name);
    EXPECT_GT(sed->range().low, 0);
    EXPECT_LT(sed->range().low, 1e-300);
    EXPECT_EQ(sed->range().high, infinity);
    EXPECT_EQ(sed->flux(5500), 1) << name;
    for (const double wavelength : {sed->range().low, 1e-100, 1e-3, 1.0, 5499.0, 5501.0, 1e10,
                                    1e100, std::numeric_limits<double>::max(), infinity}) {
      EXPECT_TRUE(std::isfinite(sed->flux(wavelength))) << name << " at " << wavelength;
      EXPECT_GE(sed->flux(wavelength), 0) << name << " at " << wavelength;
    }
  }
}

TEST(FindSed, ErrorsOfArguments) {
  const std::string blackbody_form =
      " is not of the form 'blackbody(T K)', for example 'blackbody(5800 K)'";
  for (const std::string name :
       {"blackbody", "blackbody()", "blackbody(K)", "blackbody(5800)", "blackbody(5800 K",
        "blackbody(5800 k)", "blackbody(5800 K) ", "blackbody(5800 K, 2)", "blackbody(5 800 K)",
        "blackbody(five K)", "blackbody(1e999 K)"}) {
    EXPECT_EQ(name_error(name), "SED '" + name + "'" + blackbody_form);
  }
  EXPECT_EQ(name_error("powerlaw(-1.5 K)"),
            "SED 'powerlaw(-1.5 K)' is not of the form 'powerlaw(p)', for example "
            "'powerlaw(-1.5)'");
  EXPECT_EQ(name_error("flat(1)"), "SED 'flat(1)': 'flat' takes no argument");
  EXPECT_EQ(name_error("blackbody(0 K)"), "SED 'blackbody(0 K)': 0 is outside ]0, 10000000] K");
  EXPECT_EQ(name_error("blackbody(nan K)"),
            "SED 'blackbody(nan K)': nan is outside ]0, 10000000] K");
  EXPECT_EQ(name_error("powerlaw(-101)"), "SED 'powerlaw(-101)': -101 is outside [-100, 100]");
}

TEST(FindSed, UnknownNames) {
  EXPECT_EQ(name_error("flatt"), "unknown SED 'flatt'; did you mean 'flat'?");
  EXPECT_EQ(name_error("blakbody(5800 K)"),
            "unknown SED 'blakbody(5800 K)'; did you mean 'blackbody'?");
  EXPECT_EQ(name_error("quasar"), "unknown SED 'quasar'");
  const auto message = [](const std::string& name) {
    return error_text([&] { shipped_sed(name); });
  };
  EXPECT_EQ(message("Sbd"), "unknown SED 'Sbd'; did you mean 'Sbc' or 'Scd'?");
  EXPECT_EQ(message("flay"), "unknown SED 'flay'; did you mean 'flat'?");
}

TEST(FindSed, FilesOfARecord) {
  Resources resources = Resources::from_record(
      {{"seds/flap", "seds/flap.sed", "# wavelength: um\n# flux: flambda\n0.5 1\n0.6 1\n"},
       {"seds/bad", "seds/bad.sed", "# wavelength: um\n# flux: flambda\n0.5 1\n0.6 -1\n"}});
  EXPECT_EQ(find_sed("flap", "", resources)->flux(5200), 1);
  EXPECT_EQ(error_text([&] { find_sed("bad", "", resources); }),
            "seds/bad.sed:4:5: negative flux: -1");
  EXPECT_EQ(error_text([&] { find_sed("flax", "", resources); }),
            "unknown SED 'flax'; did you mean 'flat' or 'flap'?");
}

TEST(FindSed, ListsItsAnalyticNames) {
  EXPECT_EQ(analytic_sed_names(),
            (std::vector<std::string>{"flat", "flat_fnu", "blackbody(T K)", "powerlaw(p)"}));
}

}  // namespace
}  // namespace gamer::sed_test
