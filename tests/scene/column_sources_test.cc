#include "scene/column_sources.h"

#include <gtest/gtest.h>

#include <string>

#include "core/error_text.h"
#include "gamer/core/config.h"
#include "gamer/scene/scene.h"

namespace gamer::column_sources_test {
namespace {

/// The columns that are found, each with the catalogue's name: "ra=RAJ2000 dec=DEJ2000".
std::string found(const std::string& columns, const std::string& keys = "") {
  const RenderParameters parameters = RenderParameters::read(parse_toml(
      "[camera]\nprojection = \"sky\"\n[catalogue]\ngalaxy = \"=E\"\n" + keys, "render.par"));
  std::string head = "# %ECSV 1.0\n# ---\n# datatype:\n";
  std::string names;
  for (std::size_t begin = 0; begin < columns.size();) {
    const std::size_t end = std::min(columns.find(' ', begin), columns.size());
    const std::string name = columns.substr(begin, end - begin);
    head += "# - {name: " + name + ", datatype: float64}\n";
    names += (names.empty() ? "" : " ") + name;
    begin = end + 1;
  }
  const Catalogue catalogue =
      Catalogue::parse(head + names + "\n", "c.ecsv", CatalogueFormat::ecsv);
  std::string result;
  const auto sources = find_columns(catalogue, parameters);
  for (std::size_t c = 0; c < sources.size(); ++c) {
    if (sources[c].kind != ColumnSource::Kind::catalogue) continue;
    result += (result.empty() ? "" : " ") + scene_columns()[c].name + "=" +
              catalogue.columns()[sources[c].place].name;
  }
  return result;
}

TEST(ColumnSources, NamesInAnyCase) {
  EXPECT_EQ(found("RA Dec Redshift ID"), "ra=RA dec=Dec redshift=Redshift id=ID");
  EXPECT_EQ(found("RA ra dec"), "ra=ra dec=dec");
}

TEST(ColumnSources, UsualNames) {
  EXPECT_EQ(found("RAJ2000 DEJ2000 zphot rmag"),
            "ra=RAJ2000 dec=DEJ2000 apparent_magnitude=rmag redshift=zphot");
  EXPECT_EQ(found("NUMBER ALPHA_J2000 DELTA_J2000 MAG_AUTO THETA_J2000"),
            "ra=ALPHA_J2000 dec=DELTA_J2000 pa=THETA_J2000 apparent_magnitude=MAG_AUTO id=NUMBER");
  EXPECT_EQ(found("ra dec z r_e n_sersic q"),
            "ra=ra dec=dec axis_ratio=q half_light_radius=r_e sersic_index=n_sersic redshift=z");
}

TEST(ColumnSources, TheMagnitudeIsOfTheReferenceBand) {
  const std::string columns = "ra dec mag_g mag_r mag_i mag_auto";
  const std::string place = "ra=ra dec=dec apparent_magnitude=";
  EXPECT_EQ(found(columns), place + "mag_r");
  EXPECT_EQ(found(columns, "[photometry]\nreference_band = \"lsst_i\"\n"), place + "mag_i");
  EXPECT_EQ(found(columns, "[photometry]\nreference_band = \"euclid_vis\"\n"), place + "mag_auto");
  EXPECT_EQ(found(columns, "apparent_magnitude = \"MAG_G\"\n"), place + "mag_g");
}

// One position, one size and one magnitude are enough; further usual names are not used.
TEST(ColumnSources, UsualNamesGiveWay) {
  EXPECT_EQ(found("ALPHA_J2000 DELTA_J2000 X_IMAGE Y_IMAGE"), "ra=ALPHA_J2000 dec=DELTA_J2000");
  EXPECT_EQ(found("X_IMAGE Y_IMAGE"), "px=X_IMAGE py=Y_IMAGE");
  EXPECT_EQ(found("ra dec size_arcsec r_e inclination q"),
            "ra=ra dec=dec inclination=inclination size_arcsec=size_arcsec");
}

TEST(ColumnSources, PixelsOfForeignTables) {
  EXPECT_EQ(found("x y mag_r"), "px=x py=y apparent_magnitude=mag_r");
  EXPECT_EQ(found("x y X_IMAGE Y_IMAGE"), "px=X_IMAGE py=Y_IMAGE");
  EXPECT_EQ(found("x y ra dec"), "ra=ra dec=dec");
}

TEST(ColumnSources, WindowedPositionsGiveWay) {
  EXPECT_EQ(found("ALPHA_J2000 ALPHAWIN_J2000 DELTA_J2000 DELTAWIN_J2000"),
            "ra=ALPHA_J2000 dec=DELTA_J2000");
  EXPECT_EQ(found("ALPHAWIN_J2000 DELTAWIN_J2000"), "ra=ALPHAWIN_J2000 dec=DELTAWIN_J2000");
}

TEST(ColumnSources, AmbiguousColumns) {
  EXPECT_EQ(
      error_text([] { found("ra dec zphot mass Z_SPEC"); }),
      "c.ecsv:9:19: columns 'zphot' and 'Z_SPEC' may both be 'redshift'; [catalogue] redshift "
      "= \"zphot\" chooses one");
  EXPECT_EQ(error_text([] { found("RA Ra dec"); }),
            "c.ecsv:7:4: columns 'RA' and 'Ra' may both be 'ra'; [catalogue] ra = \"RA\" chooses "
            "one");
  EXPECT_EQ(found("ra dec zphot Z_SPEC", "redshift = \"z_spec\"\n"),
            "ra=ra dec=dec redshift=Z_SPEC");
  // A column with another use is no candidate.
  EXPECT_EQ(found("ra dec zphot Z_SPEC", "distance = \"zphot\"\n"),
            "ra=ra dec=dec redshift=Z_SPEC distance=zphot");
}

TEST(ColumnSources, MappingAsText) {
  const RenderParameters parameters = RenderParameters::read(
      parse_toml("[camera]\nprojection = \"sky\"\n[catalogue]\ngalaxy = \"=E\"\n", "render.par"));
  const Catalogue catalogue = Catalogue::parse(
      "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: RA, unit: hourangle, datatype: float64}\n"
      "# - {name: Dec, unit: deg, datatype: float64}\n# - {name: r_e, datatype: float64}\n"
      "# - {name: mass, datatype: float64}\nRA Dec r_e mass\n",
      "c.ecsv", CatalogueFormat::ecsv);
  EXPECT_EQ(column_mapping(catalogue, parameters),
            "galaxy = \"E\" in every row\n"
            "ra = column RA [hourangle] times 15 to deg\n"
            "dec = column Dec [deg]\n"
            "half_light_radius = column r_e, taken as arcsec\n"
            "not used: mass\n");
}

TEST(ColumnSources, UnusedColumnsHaveUnits) {
  const RenderParameters parameters = RenderParameters::read(
      parse_toml("[camera]\nprojection = \"sky\"\n[catalogue]\ngalaxy = \"=E\"\n", "render.par"));
  const Catalogue catalogue = Catalogue::parse(
      "<VOTABLE><TABLE><FIELD name='ra' datatype='double' unit='deg'/><FIELD name='mass' "
      "datatype='double' unit='solMass'/><FIELD name='n' datatype='int'/></TABLE></VOTABLE>",
      "c.xml", CatalogueFormat::automatic);
  EXPECT_EQ(column_mapping(catalogue, parameters),
            "galaxy = \"E\" in every row\nra = column ra [deg]\nnot used: mass [solMass], n\n");
}

TEST(ColumnSources, MissingColumnsBeginWithNearNames) {
  const RenderParameters parameters =
      RenderParameters::read(parse_toml("[camera]\nprojection = \"sky\"\n", "render.par"));
  const Catalogue catalogue =
      Catalogue::parse("ra,dec,galaxi\n1,2,E\n", "c.csv", CatalogueFormat::automatic);
  EXPECT_EQ(error_text([&] { find_columns(catalogue, parameters); }),
            "c.csv:1:1: missing column 'galaxy'; did you mean 'galaxi'?; [catalogue] galaxy = "
            "\"name\", or \"=word\", says it; the columns are ra, dec, galaxi");
}

TEST(ColumnSources, ErrorsListTheColumns) {
  EXPECT_EQ(error_text([] { found("ra dec mass", "redshift = \"zed\"\n"); }),
            "render.par:5:12: missing column 'zed' in c.ecsv; its columns are ra, dec, mass");
}

}  // namespace
}  // namespace gamer::column_sources_test
