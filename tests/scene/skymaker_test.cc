// SkyMaker's lists and the galaxies made from them.

#include <gtest/gtest.h>

#include <cmath>

#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/kinds/bulge.h"
#include "gamer/galaxy/kinds/layer.h"
#include "gamer/scene/catalogue.h"
#include "scene/scene_checks.h"

namespace gamer::skymaker_test {
namespace {

using test::message_of;

Catalogue parse(std::string_view text) {
  return Catalogue::parse(text, "t.list", CatalogueFormat::automatic);
}

std::string error_of(const std::string& text) {
  return message_of([&] { Catalogue::parse(text, "t.list", CatalogueFormat::skymaker); });
}

template <typename Value>
const std::vector<Value>& cells(const Catalogue& catalogue, const std::string& name) {
  for (const auto& column : catalogue.columns()) {
    if (column.name == name) return std::get<std::vector<Value>>(column.cells);
  }
  throw InputError("no column " + name);
}

const std::string& type_of(const Catalogue& catalogue, std::size_t row = 0) {
  return cells<std::string>(catalogue, "galaxy")[row];
}

std::string row(const std::string& shape) { return "200 10 20 21.5 " + shape + "\n"; }

// The file config/sample.list of SkyMaker, with a row as SkyMaker writes it.
const std::string sample =
    "# This is a SkyMaker2 list file\n"
    "# A star at FITS coordinates (128.4,99.5) with magnitude 7.123 :\n"
    "100 128.4 99.5 7.123\n"
    "200 102.0 180.7 19.41 0.42 2.3 0.8 32.3 4.0 0.2 31.3\n"
    "200     55.0000     66.0000  20.5000 0.160     0.500 0.700  +15.00     2.000 0.500  +15.00  "
    "0.30000 +6.0      123.40\n";

TEST(Skymaker, ReadsItsSample) {
  const Catalogue catalogue = parse(sample);
  EXPECT_EQ(catalogue.format(), CatalogueFormat::skymaker);
  ASSERT_EQ(catalogue.rows(), 3u);
  EXPECT_EQ(type_of(catalogue, 0), "star");
  EXPECT_EQ(cells<double>(catalogue, "px"), (std::vector<double>{128.4, 102, 55}));
  EXPECT_EQ(cells<double>(catalogue, "py"), (std::vector<double>{99.5, 180.7, 66}));
  EXPECT_EQ(cells<double>(catalogue, "apparent_magnitude"),
            (std::vector<double>{7.123, 19.41, 20.5}));
  EXPECT_EQ(cells<std::int64_t>(catalogue, "id"), (std::vector<std::int64_t>{1, 2, 3}));
  // The taper begins at 20 effective radii of 2.3 arcsec.
  EXPECT_DOUBLE_EQ(cells<double>(catalogue, "size_arcsec")[1], 46 / 0.7);
  // An angle from x is 90 degrees less when counted from y (both counterclockwise).
  EXPECT_NEAR(cells<double>(catalogue, "pa")[1], 31.3 - 90, 1e-12);
  EXPECT_NEAR(cells<double>(catalogue, "pa")[2], 15.0 - 90, 1e-12);
  EXPECT_TRUE(std::isnan(cells<double>(catalogue, "redshift")[1]));
  EXPECT_EQ(cells<double>(catalogue, "redshift")[2], 0.3);
  for (const char* name : {"size_arcsec", "inclination", "pa", "redshift"}) {
    EXPECT_TRUE(std::isnan(cells<double>(catalogue, name)[0])) << name;
  }
  EXPECT_EQ(catalogue.where(1, 1).text(), "t.list:4:5");
  EXPECT_EQ(catalogue.where(1, 5).text(), "t.list:4:45");
}

TEST(Skymaker, GalaxiesHaveTheRadiiOfTheList) {
  const Catalogue catalogue = parse(sample);
  // Radii are 2.3 and 4 arcsec in units of 46/0.7 arcsec, and 0.5 and 2 arcsec in units of 20/0.7
  // arcsec.
  EXPECT_TRUE(type_of(catalogue, 1).starts_with("bulge+disk(0.42,0.035,"));
  EXPECT_TRUE(type_of(catalogue, 1).ends_with(",0.0608696,E,Sbc)"));
  EXPECT_TRUE(type_of(catalogue, 2).starts_with("bulge+disk(0.16,0.0175,"));
  EXPECT_TRUE(type_of(catalogue, 2).ends_with(",0.07,E,Scd)"));
}

// The expected axis ratios are numerical second moments of exp(-r/rh) sech^2(z/z0), z0 = 0.1 rh.
TEST(Skymaker, InclinationFollowsTheDisksAspect) {
  const auto inclination = [](const std::string& aspect) {
    return cells<double>(parse(row("0 0 1 0 3 " + aspect + " 0")), "inclination")[0];
  };
  EXPECT_NEAR(inclination("1"), 0, 1e-12);
  EXPECT_NEAR(inclination("0.866421023056643"), 30, 1e-10);
  EXPECT_NEAR(inclination("0.5020519570558015"), 60, 1e-10);
  EXPECT_NEAR(inclination("0.10157192066769467"), 85, 1e-9);
  EXPECT_NEAR(inclination("0.05235987"), 90, 1e-6);
  EXPECT_EQ(inclination("0.01"), 90);
}

// Flattened spheroids seen at 60 degrees have the axis ratio sqrt(cos^2 i + (c/a)^2 sin^2 i).
TEST(Skymaker, FlatteningFollowsTheBulgesAspect) {
  const auto flattening = [](const std::string& aspect) {
    const std::string type = type_of(parse(row("0.5 1 " + aspect + " 0 2 0.5020519570558015 0")));
    const std::string opening = "bulge+disk(0.5,0.035,";
    EXPECT_TRUE(type.starts_with(opening)) << type;
    return type.substr(opening.size(), type.find(',', opening.size()) - opening.size());
  };
  EXPECT_EQ(flattening("1"), "1");
  EXPECT_EQ(flattening("0.7211102550927979"), "0.6");
  EXPECT_EQ(flattening("0.5634713834792323"), "0.3");
  EXPECT_EQ(flattening("0.5074445782546111"), "0.1");
  EXPECT_EQ(flattening("0.4"), "0.1");
}

TEST(Skymaker, OneComponentAlone) {
  const Catalogue bulge = parse(row("1 2 0.6 40 9 0.3 70"));
  EXPECT_EQ(type_of(bulge), "bulge+disk(1,0.035,0.6,0,E,Sbc)");
  EXPECT_EQ(cells<double>(bulge, "inclination")[0], 90);
  EXPECT_EQ(cells<double>(bulge, "pa")[0], 40 - 90);
  EXPECT_DOUBLE_EQ(cells<double>(bulge, "size_arcsec")[0], 40 / 0.7);
  const Catalogue disk = parse(row("0 0 0 40 9 0.3 70"));
  EXPECT_EQ(type_of(disk), "bulge+disk(0,0,1,0.07,E,Sbc)");
  EXPECT_EQ(cells<double>(disk, "pa")[0], 70 - 90);
  EXPECT_DOUBLE_EQ(cells<double>(disk, "size_arcsec")[0], 90 / 0.7);
}

TEST(Skymaker, DisksHaveTheSpectrumOfTheirType) {
  const auto sed = [](const std::string& type) {
    return type_of(parse(row("0 0 1 0 3 0.5 0 0.1 " + type)));
  };
  for (const auto& [type, name] : {std::pair{"-6", "E"},
                                   {"-2", "E"},
                                   {"2", "Sbc"},
                                   {"+4.0", "Sbc"},
                                   {"6", "Scd"},
                                   {"10", "Im"}}) {
    EXPECT_EQ(sed(type), "bulge+disk(0,0,1,0.07,E," + std::string(name) + ")") << type;
  }
}

TEST(Skymaker, BadRows) {
  EXPECT_EQ(error_of("100 1 2 3\n300 1 2 3\n"),
            "t.list:2:1: the code 300 is neither 100 (a star) nor 200 (a galaxy)");
  EXPECT_EQ(error_of("galaxy x y\n"), "t.list:1:1: the code must be a finite number, not 'galaxy'");
  EXPECT_EQ(error_of("100 1 2\n"), "t.list:1:7: the row of a star has 3 values, not 4 to 14");
  EXPECT_EQ(error_of("200 1 2 3 0.5\n"),
            "t.list:1:11: the row of a galaxy has 5 values, not 11 to 14");
  EXPECT_EQ(error_of(row("0.5 1 1 0 1 1 0 0 4 9 9")),
            "t.list:1:38: the row of a galaxy has 15 values, not 11 to 14");
  EXPECT_EQ(error_of("100 1 nan 3\n"), "t.list:1:7: y must be a finite number, not 'nan'");
  EXPECT_EQ(error_of(row("1.5 1 1 0 1 1 0")),
            "t.list:1:16: the bulge's share of the light = 1.5 is outside [0, 1]");
  EXPECT_EQ(error_of(row("0.5 0 1 0 1 1 0")),
            "t.list:1:20: the bulge's effective radius = 0 is outside [1e-06, 1000000] (arcsec)");
  EXPECT_EQ(error_of(row("0.5 1 1 0 -1 1 0")),
            "t.list:1:26: the disk's scale length = -1 is outside [1e-06, 1000000] (arcsec)");
  EXPECT_EQ(error_of(row("0.5 1 1 0 1 1.2 0")),
            "t.list:1:28: the disk's aspect ratio = 1.2 is outside ]0, 1]");
}

TEST(MadeGalaxy, IsOneOfBulgeAndDisk) {
  const auto text = made_galaxy("bulge+disk(0.3,0.03,0.6,0.05,flat,blackbody(5800 K))");
  ASSERT_TRUE(text);
  const auto galaxy = parse_galaxy(*text);
  ASSERT_EQ(galaxy->components().size(), 2u);
  EXPECT_NEAR(galaxy->luminosity(0) / (galaxy->luminosity(0) + galaxy->luminosity(1)), 0.3, 1e-12);
  const auto* bulge = dynamic_cast<const Bulge*>(galaxy->components()[0].get());
  ASSERT_NE(bulge, nullptr);
  EXPECT_NEAR(bulge->effective_radius(), 0.03, 1e-15);
  const auto* disk = dynamic_cast<const Layer*>(galaxy->components()[1].get());
  ASSERT_NE(disk, nullptr);
  EXPECT_EQ(disk->shape().rh, 0.05);
  EXPECT_DOUBLE_EQ(disk->shape().z0, 0.005);
  // The bulge is flattened by 0.6; the disk is exponential, without arms.
  const auto density =
      evaluate(*galaxy, std::vector<Vector>{{0.1, 0, 0}, {0, 0, 0.06}, {0, 0.1, 0}, {0.15, 0, 0}});
  EXPECT_NEAR(density[0][1] / density[0][0], 1, 2e-6);
  EXPECT_NEAR(density[1][2] / density[1][0], 1, 2e-6);
  EXPECT_NEAR(density[1][3] / density[1][0], std::exp(-1.0), 1e-6);
}

TEST(MadeGalaxy, LeavesOutWhatHasNoLight) {
  const auto bulge = parse_galaxy(*made_galaxy("bulge+disk(1,0.03,0.6,0,flat,flat)"));
  ASSERT_EQ(bulge->components().size(), 1u);
  EXPECT_EQ(bulge->components()[0]->kind(), "bulge");
  const auto disk = parse_galaxy(*made_galaxy("bulge+disk(0,0,1,0.05,flat,flat)"));
  ASSERT_EQ(disk->components().size(), 1u);
  EXPECT_EQ(disk->components()[0]->kind(), "disk");
}

// The ratios of radii are the extremes that the reader allows.
TEST(MadeGalaxy, TinyPartsHaveFiniteLight) {
  for (const char* shape : {"0.5 1e-6 1 0 1e6 0.5 0", "0.5 1e6 1 0 1e-6 0.5 0"}) {
    std::string type = type_of(parse(row(shape)));
    const auto galaxy =
        parse_galaxy(*made_galaxy(type.substr(0, type.find(",E,")) + ",flat,flat)"));
    for (const auto& list :
         evaluate(*galaxy, std::vector<Vector>{{0, 0, 0}, {1e-7, 0, 0}, {0.5, 0, 0}})) {
      for (const float value : list) EXPECT_TRUE(std::isfinite(value)) << type;
    }
  }
}

TEST(MadeGalaxy, OtherNamesAndBadArguments) {
  EXPECT_FALSE(made_galaxy("ngc4321"));
  const auto error = [](const std::string& name) { return message_of([&] { made_galaxy(name); }); };
  EXPECT_EQ(error("bulge+disk(1,2"), "the made galaxy 'bulge+disk(1,2' must end with ')'");
  EXPECT_EQ(error("bulge+disk(1,2)"),
            "bulge+disk(...) has 6 arguments, not 2: bulge+disk(bt,re,qb,rh,bulge_sed,disk_sed)");
  EXPECT_EQ(error("bulge+disk(x,.1,1,.1,E,E)"), "bulge+disk(...): bt must be a number, not 'x'");
  EXPECT_EQ(error("bulge+disk(2,.1,1,.1,E,E)"), "bulge+disk(...): bt = 2 is outside [0, 1]");
  EXPECT_EQ(error("bulge+disk(.5,0,1,.1,E,E)"), "bulge+disk(...): re = 0 is outside ]0, 1]");
  EXPECT_EQ(error("bulge+disk(.5,.1,0,.1,E,E)"), "bulge+disk(...): qb = 0 is outside ]0, 1]");
  EXPECT_EQ(error("bulge+disk(.5,.1,1,nan,E,E)"), "bulge+disk(...): rh = nan is outside ]0, 1]");
  EXPECT_EQ(error("bulge+disk(.5,.1,1,.1,,E)"),
            "bulge+disk(...): bulge_sed must be the name of a SED, not ''");
  EXPECT_EQ(error("bulge+disk(.5,.1,1,.1,E,\"\n)"),
            "bulge+disk(...): disk_sed must be the name of a SED, not '\"\\x0a'");
}

}  // namespace
}  // namespace gamer::skymaker_test
