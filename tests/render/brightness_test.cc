// Whole renders have the given magnitudes: sums of pixels, units of pixels, stars, and dust in
// front.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "gamer/sed/extinction.h"
#include "render/render_text.h"

namespace gamer::brightness_test {
namespace {

// Largest error of the sum of a galaxy's pixels.
constexpr double promised = 0.002;  // mag

constexpr double arcsecond = std::numbers::pi / (180 * 3600);

constexpr const char* disk = R"([[component]]
class = "disk"
sed = "E"
z0 = 0.02
rh = 0.1
arm_width = 0
noise = false
)";
constexpr const char* bulge = R"([[component]]
class = "bulge"
sed = "E"
effective_radius = 0.1
)";
// Magnified, the dust is a sheet that is uniform over the width of a small disk.
constexpr const char* dust = R"([[component]]
class = "dust"
z0 = 0.01
rh = 1
arm_width = 0
optical_depth = 1
noise = false
)";

/// Shipped SEDs and bandpasses, the galaxies above, and a list and parameters.
Image render(const std::string& list, const std::string& toml) {
  const RenderParameters parameters = RenderParameters::read(parse_toml(toml, "render.par"));
  Resources resources({GAMER_TEST_SOURCE_DIR});
  resources.add({"galaxies/disk", "disk.toml", disk});
  resources.add({"galaxies/bulge", "bulge.toml", bulge});
  resources.add({"galaxies/dust", "dust.toml", dust});
  return image_of(measured_job(parameters, list, "scene.lst", resources));
}

double magnitude_of(double nanojansky) { return 31.4 - 2.5 * std::log10(nanojansky); }

const std::string r_band = "[spectrum]\nbands = [\"sdss_r\"]\n";
const std::string sky_view =
    "[camera]\nprojection = \"sky\"\ncenter = [30, -20]\npixel_scale = 0.1\n";

std::string sky(int size, const std::string& more = r_band) {
  return fmt::format("[image]\nsize = {}\n", size) + sky_view + more;
}

// Galaxies from the size of the image to that of a pixel.
TEST(Brightness, ApparentMagnitudeOnTheSky) {
  for (const char* type : {"disk", "bulge"}) {
    for (const double size : {1.6, 0.4, 0.05}) {
      const Image image =
          render(fmt::format("galaxy px py size_arcsec inclination pa apparent_magnitude redshift\n"
                             "{} 20.3 20.9 {} 50 30 22.5 0.5\n",
                             type, size),
                 sky(40));
      EXPECT_NEAR(magnitude_of(sum_of(image)), 22.5, promised) << type << ' ' << size;
    }
  }
}

// docs/facts.md section 4: m = M + distance modulus + K_rr of E.
TEST(Brightness, AbsoluteMagnitudeOnTheSky) {
  const double table[][3] = {
      {0.1, 38.3152, 0.126}, {0.5, 42.2612, 1.035}, {1, 44.1002, 2.551}, {2, 45.9572, 4.934}};
  for (const auto& [z, modulus, k] : table) {
    const Image image = render(
        fmt::format("galaxy dx dy size_kpc inclination magnitude redshift\ndisk 0 0 10 40 -21 {}\n",
                    z),
        sky(z < 0.3 ? 120 : 40));
    EXPECT_NEAR(magnitude_of(sum_of(image)), -21 + modulus + k, promised) << z;
  }
}

// 1000 Mpc: distance modulus 40.
TEST(Brightness, MagnitudesInAPerspectiveViewWithUnits) {
  const std::string parameters =
      "[image]\nsize = 32\n[camera]\nposition = [0, -1e6, 0]\nfov = 0.0025\n[scene]\nunit = "
      "\"kpc\"\n" +
      r_band;
  const Image absolute =
      render("galaxy x y z size inclination magnitude\ndisk 0 0 0 18 35 -20\n", parameters);
  EXPECT_NEAR(magnitude_of(sum_of(absolute)), 20, promised);
  const Image apparent =
      render("galaxy x y z size inclination apparent_magnitude\ndisk 0 0 0 18 35 23\n", parameters);
  EXPECT_NEAR(magnitude_of(sum_of(apparent)), 23, promised);
}

TEST(Brightness, MagnitudesInAnOrthographicView) {
  const std::string parameters =
      "[image]\nsize = 32\n[camera]\nprojection = \"orthographic\"\nwidth = 2.2\n" + r_band;
  const Image absolute =
      render("galaxy x y z inclination magnitude redshift\ndisk 0 0 0 35 -21 0.5\n", parameters);
  EXPECT_NEAR(magnitude_of(sum_of(absolute)), -21 + 42.2612 + 1.035, promised);
  const Image apparent =
      render("galaxy x y z inclination apparent_magnitude\ndisk 0 0 0 35 23\n", parameters);
  EXPECT_NEAR(magnitude_of(sum_of(apparent)), 23, promised);
}

// Colours of docs/facts.md section 2: g - r and r - i of E.
TEST(Brightness, ColoursAreThoseOfTheSpectrum) {
  const Image image = render("galaxy dx dy size_arcsec apparent_magnitude\ndisk 0 0 1.6 20\n",
                             sky(40, "[spectrum]\nbands = [\"sdss_g\", \"sdss_r\", \"sdss_i\"]\n"));
  EXPECT_NEAR(magnitude_of(sum_of(image, 1)), 20, promised);
  EXPECT_NEAR(magnitude_of(sum_of(image, 0)) - magnitude_of(sum_of(image, 1)), 0.739, 0.002);
  EXPECT_NEAR(magnitude_of(sum_of(image, 1)) - magnitude_of(sum_of(image, 2)), 0.366, 0.002);
}

TEST(Brightness, UnitsOfPixelsAgree) {
  const std::string list =
      "galaxy dx dy size_arcsec inclination apparent_magnitude\ndisk 0 0 1.2 30 20\n";
  const auto in_unit = [&](const std::string& unit) {
    return render(list, "[image]\nsize = 16\nunit = \"" + unit + "\"\n" + sky_view + r_band +
                            "[photometry]\narea = 4\nthroughput = 0.5\n");
  };
  const Image flux = in_unit("nJy"), mega = in_unit("MJy/sr"), mag = in_unit("mag/arcsec^2"),
              density = in_unit("erg/s/cm^2/A/arcsec^2"), electrons = in_unit("electron/s");
  // SDSS r by the trapezoid rule on docs/facts.md section 3's rows, fine between them.
  constexpr double rows[][2] = {{5400, 0},    {5500, .248}, {5600, .655}, {5700, .844},
                                {5800, .915}, {6000, .937}, {6200, .992}, {6400, .995},
                                {6600, .994}, {6800, .975}, {6900, .695}, {7000, .181},
                                {7100, .033}, {7200, 0}};
  double log_width = 0, moment = 0;
  for (std::size_t i = 0; i + 1 < std::size(rows); ++i) {
    const double width = rows[i + 1][0] - rows[i][0];
    constexpr int steps = 1000;
    for (int k = 0; k < steps; ++k) {
      const double t = (k + 0.5) / steps, wavelength = rows[i][0] + t * width;
      const double response = rows[i][1] + t * (rows[i + 1][1] - rows[i][1]);
      log_width += response / wavelength * width / steps;
      moment += response * wavelength * width / steps;
    }
  }
  const double pivot2 = moment / log_width;
  constexpr double solid_angle = 0.01 * arcsecond * arcsecond;
  int bright = 0;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const double f = flux.at(x, y);
      if (!(f > 0)) {
        EXPECT_TRUE(std::isnan(mag.at(x, y)));
        continue;
      }
      ++bright;
      EXPECT_NEAR(mega.at(x, y) / (f * 1e-15 / solid_angle), 1, 1e-6);
      // A pixel is 0.01 arcsec^2: 5 mag.
      EXPECT_NEAR(mag.at(x, y), magnitude_of(f) - 5, 1e-6);
      EXPECT_NEAR(density.at(x, y) / (f * 1e-32 * 2.99792458e18 / pivot2 / 0.01), 1, 1e-6);
      // docs/facts.md section 4: photons per m^2 of an AB magnitude.
      const double rate = 5.47954e10 * std::pow(10, -0.4 * 31.4) * log_width;
      EXPECT_NEAR(electrons.at(x, y) / (f * rate * 4 * 0.5), 1, 3e-6);
    }
  }
  EXPECT_GT(bright, 100);
  // docs/facts.md section 4: 1 MJy/sr = 20.4721 mag/arcsec^2.
  EXPECT_NEAR(mag.at(8, 8) + 2.5 * std::log10(mega.at(8, 8)), 20.4721, 5e-5);
}

TEST(Brightness, StarsHaveTheirFluxAndPlace) {
  for (const auto& [x, y] : {std::pair(10.0, 12.0), {7.25, 9.5}, {11.9, 4.01}}) {
    const Image image =
        render(fmt::format("galaxy px py apparent_magnitude\nstar {} {} 21\n", x, y), sky(20));
    double sum = 0, sum_x = 0, sum_y = 0;
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) {
        sum += image.at(i, j);
        sum_x += image.at(i, j) * (i + 1);
        sum_y += image.at(i, j) * (j + 1);
      }
    }
    EXPECT_NEAR(magnitude_of(sum), 21, 1e-6);
    EXPECT_NEAR(sum_x / sum, x, 1e-6);
    EXPECT_NEAR(sum_y / sum, y, 1e-6);
  }
}

// Dust at z = 2 is in front of light at z = 3, and dims it as dust does at 3000 Angstrom. The
// angular-diameter distance falls beyond z = 1.6, and must not decide this.
TEST(Brightness, FartherIsBehindAtHighRedshift) {
  const auto light = [&](const std::string& rows) {
    return sum_of(render("galaxy dx dy size_arcsec redshift apparent_magnitude\n" + rows,
                         sky(16,
                             "[spectrum]\nwavelengths = [9000]\n[photometry]\n"
                             "reference_band = \"sdss_z\"\n")));
  };
  const double behind = light("disk 0 0 0.8 3 20\ndust 0 0 4000 2 -\n");
  const double clear = light("disk 0 0 0.8 3 20\n");
  EXPECT_NEAR(std::log(clear / behind), Ccm89(3.1).relative(3000), 1e-3);
  const double before = light("disk 0 0 0.8 2 20\ndust 0 0 4000 3 -\n");
  EXPECT_NEAR(before / light("disk 0 0 0.8 2 20\n"), 1, 1e-3);
}

}  // namespace
}  // namespace gamer::brightness_test
