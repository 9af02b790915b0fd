#include "gamer/sed/photometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "gamer/sed/cosmology.h"
#include "gamer/sed/igm.h"
#include "sed/shipped.h"

namespace gamer::photometry_test {
namespace {

/// AB magnitude of light with F = c f_nu, f_lambda in erg/s/cm^2/Angstrom: m = -2.5 log10(f_nu) -
/// 48.60, docs/facts.md section 4.
double magnitude_cgs(double flux) { return -2.5 * std::log10(flux / 2.99792458e18) - 48.60; }

double magnitude(const Sed& sed, const std::string& band) {
  return magnitude_cgs(band_flux(sed, *shipped_band(band), 0));
}

// docs/facts.md section 2 has the colours of the full templates, and the changes by the compact
// ones. Both are rounded to 0.001; the required accuracy is 0.02.
TEST(Photometry, ColoursOfTheTemplates) {
  struct Pair {
    std::string blue, red;
  };
  const std::vector<Pair> pairs = {{"sdss_u", "sdss_g"},       {"sdss_g", "sdss_r"},
                                   {"sdss_r", "sdss_i"},       {"sdss_i", "sdss_z"},
                                   {"bessell_b", "bessell_v"}, {"bessell_v", "bessell_ic"},
                                   {"hst_f606w", "hst_f814w"}};
  struct Colours {
    std::string sed;
    std::array<double, 7> full;
    std::array<double, 7> compact_less_full;
  };
  const std::vector<Colours> rows = {
      {"E",
       {1.893, 0.739, 0.366, 0.310, 0.816, 0.771, 0.596},
       {0, -0.001, -0.001, 0.001, 0, 0, -0.001}},
      {"Sbc", {1.190, 0.471, 0.359, 0.315, 0.473, 0.663, 0.546}, {0.001, 0, 0, 0.001, 0, 0, 0}},
      {"Scd",
       {1.001, 0.351, 0.213, 0.151, 0.382, 0.415, 0.326},
       {0, 0.002, -0.001, 0.001, 0, 0, 0}},
      {"Im",
       {0.655, 0.174, 0.232, 0.218, 0.205, 0.384, 0.317},
       {0.002, -0.001, 0, 0, 0, 0, 0.001}}};
  for (const Colours& row : rows) {
    const auto sed = shipped_sed(row.sed);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_NEAR(magnitude(*sed, pairs[i].blue) - magnitude(*sed, pairs[i].red),
                  row.full[i] + row.compact_less_full[i], 0.001)
          << row.sed << ", " << pairs[i].blue << " - " << pairs[i].red;
    }
  }
}

// docs/facts.md section 4, z = 0.1, 0.5, 1, 2; the tolerance is half a unit of the last place
// given.
TEST(Photometry, KCorrections) {
  struct Row {
    std::string sed, band;
    std::array<double, 4> k;
  };
  const std::vector<Row> rows = {{"E", "sdss_r", {0.126, 1.035, 2.551, 4.934}},
                                 {"E", "sdss_i", {0.048, 0.438, 1.724, 4.474}},
                                 {"Sbc", "sdss_r", {0.057, 0.420, 1.561, 2.134}},
                                 {"Sbc", "sdss_i", {0.069, 0.255, 0.843, 2.111}},
                                 {"Scd", "sdss_r", {0.013, 0.250, 1.023, 1.175}},
                                 {"Scd", "sdss_i", {-0.008, 0.011, 0.474, 1.248}},
                                 {"Im", "sdss_r", {-0.022, -0.049, 0.390, 0.188}},
                                 {"Im", "sdss_i", {0.008, -0.110, 0.068, 0.337}}};
  const std::array<double, 4> redshifts = {0.1, 0.5, 1, 2};
  for (const Row& row : rows) {
    const auto sed = shipped_sed(row.sed);
    const auto band = shipped_band(row.band);
    EXPECT_EQ(k_correction(*sed, *band, *band, 0), 0);
    for (std::size_t i = 0; i < redshifts.size(); ++i) {
      EXPECT_NEAR(k_correction(*sed, *band, *band, redshifts[i]), row.k[i], 0.55e-3)
          << row.sed << ' ' << row.band << " at " << redshifts[i];
    }
  }
}

// docs/facts.md section 4: the spectrum of E with f_lambda(5500) = 1e-17 erg/s/cm^2/Angstrom.
TEST(Photometry, AbsoluteMagnitudes) {
  struct Row {
    std::string band;
    double magnitude;
  };
  const auto sed = shipped_sed("E");
  for (const auto& [band, expected] : std::vector<Row>{{"sdss_g", 21.8314},
                                                       {"sdss_r", 21.0932},
                                                       {"bessell_v", 21.4128},
                                                       {"hst_f814w", 20.6368}}) {
    EXPECT_NEAR(magnitude_cgs(1e-17 * band_flux(*sed, *shipped_band(band), 0)), expected, 0.55e-4)
        << band;
  }
}

// Lines of a spectrum and edges of the IGM lie between the rows of a band. Values are from NumPy:
// Gauss quadrature of order 8 on quarters of the pieces between all of these. The midpoint rule
// with 10^6 points agrees to the 1e-6 that it reaches at edges.
TEST(Photometry, BandFluxOfTemplates) {
  struct Row {
    std::string sed, band;
    double redshift;
    Igm igm;
    double flux;
  };
  const std::vector<Row> rows = {{"E", "sdss_u", 3, Igm::none, 58704.59176},
                                 {"Im", "sdss_u", 3, Igm::none, 3703823.97012},
                                 {"Sbc", "lsst_r", 1.3, Igm::none, 6079833.18605},
                                 {"Sbc", "euclid_vis", 0.7, Igm::none, 25809512.9313},
                                 {"Im", "euclid_vis", 0.7, Igm::none, 39216929.7861},
                                 {"hii", "sdss_g", 0, Igm::none, 35974677.7116},
                                 {"hii", "sdss_r", 0.27, Igm::none, 46529899.0036},
                                 {"hii", "red_halpha", 0.07, Igm::none, 44339082.9661},
                                 {"hii", "hst_f814w", 0.5, Igm::madau95, 54791265.5345},
                                 {"Im", "lsst_u", 2.2, Igm::madau95, 16212498.9347},
                                 {"Scd", "bessell_b", 2.6, Igm::madau95, 8811495.78032},
                                 {"Im", "hst_f435w", 3.9, Igm::madau95, 1930866.63178},
                                 {"Im", "sdss_i", 6, Igm::madau95, 4463154.69937}};
  for (const Row& row : rows) {
    const auto band = shipped_band(row.band);
    // The values have twelve digits; with the IGM the integrand is no polynomial.
    EXPECT_NEAR(band_flux(*shipped_sed(row.sed), *band, row.redshift, row.igm) / row.flux, 1,
                row.igm == Igm::none ? 4e-12 : 5e-10)
        << row.sed << ' ' << row.band << " at " << row.redshift;
  }
}

// The midpoint rule ignores pieces. Its error at each edge is a share of one of its steps.
TEST(Photometry, BandFluxIsTheIntegralAtAnyRedshift) {
  constexpr int steps = 40000;
  double largest = 0;
  for (const std::string name : {"Im", "hii"}) {
    const auto sed = shipped_sed(name);
    for (const std::string of : {"sdss_i", "hst_f435w", "lsst_u"}) {
      const auto band = shipped_band(of);
      const auto [low, high] = band->range();
      for (double z = 0; z < 6.5; z += 0.37) {
        double sum = 0, norm = 0;
        for (int i = 0; i < steps; ++i) {
          const double wavelength = low + (high - low) * (i + 0.5) / steps;
          const double response = band->response(wavelength);
          sum += wavelength * sed->flux(wavelength / (1 + z)) * response *
                 madau95_transmission(wavelength, z);
          norm += response / wavelength;
        }
        const double unit = band_flux(*sed, *band, z);
        const double flux = band_flux(*sed, *band, z, Igm::madau95);
        largest = std::max(largest, std::abs(flux - sum / norm / (1 + z)) / unit);
      }
    }
  }
  EXPECT_LT(largest, 9e-5);
}

// f_lambda = (lambda/5500)^p: F = (1+z)^-(1+p) int lambda^(1+p) T / 5500^p / int T/lambda, and for
// constant f_nu the average is the value at any wavelength, 5500^2 (1+z).
TEST(Photometry, PowerLaws) {
  for (const std::string& name : shipped_names("bandpasses", ".band")) {
    const auto band = shipped_band(name);
    for (const double z : {0.0, 0.3, 2.0}) {
      const auto fnu = analytic("flat_fnu");
      EXPECT_NEAR(band_flux(*fnu, *band, z) / (5500.0 * 5500 * (1 + z)), 1, 5e-15) << name;
      EXPECT_NEAR(monochromatic_flux(*fnu, 4321, z) / (5500.0 * 5500 * (1 + z)), 1, 5e-16);
      // At the pivot wavelength f_lambda corresponds to the average f_nu.
      const auto flat = analytic("flat");
      EXPECT_NEAR(band_flux(*flat, *band, z) * (1 + z) / (band->pivot() * band->pivot()), 1, 2e-15)
          << name;
      EXPECT_NEAR(monochromatic_flux(*flat, band->pivot(), z) / band_flux(*flat, *band, z), 1,
                  2e-15)
          << name;
      // K = 2.5 log10(1+z) for constant f_lambda, -2.5 log10(1+z) for constant f_nu.
      EXPECT_NEAR(k_correction(*flat, *band, *band, z), 2.5 * std::log10(1 + z), 2e-15) << name;
      EXPECT_NEAR(k_correction(*fnu, *band, *band, z), -2.5 * std::log10(1 + z), 5e-15) << name;
    }
  }
}

// At z = 0 the K correction between two bands is the colour: K_QR(0) = M_Q - M_R.
TEST(Photometry, KCorrectionAtRestIsTheColour) {
  for (const std::string& name : shipped_names("seds", ".sed")) {
    const auto sed = shipped_sed(name);
    EXPECT_NEAR(k_correction(*sed, *shipped_band("sdss_g"), *shipped_band("sdss_r"), 0),
                magnitude(*sed, "sdss_g") - magnitude(*sed, "sdss_r"), 1e-14)
        << name;
  }
}

// m = M + distance modulus + K, by hand from L_lambda: docs/facts.md section 4.
TEST(Photometry, ApparentMagnitudeOfALuminosity) {
  constexpr double z = 1;
  constexpr double luminosity = 1e40;  // erg/s/Angstrom at 5500 Angstrom
  constexpr double parsec = 3.0856775814913673e18;
  const auto area = [](double distance_pc) {
    return 4 * std::numbers::pi * std::pow(distance_pc * parsec, 2);
  };
  const Cosmology cosmology;
  const auto sed = shipped_sed("Sbc");
  const auto i = shipped_band("sdss_i");
  const auto r = shipped_band("sdss_r");
  const double apparent = magnitude_cgs(luminosity * band_flux(*sed, *i, z) /
                                        area(cosmology.luminosity_distance(z) * 1e6));
  const double absolute = magnitude_cgs(luminosity * band_flux(*sed, *r, 0) / area(10));
  EXPECT_NEAR(apparent, absolute + cosmology.distance_modulus(z) + k_correction(*sed, *i, *r, z),
              8e-15);
}

TEST(Photometry, MonochromaticFluxIsTheLimitOfANarrowBand) {
  const auto sed = shipped_sed("Im");
  for (const double wavelength : {3000.0, 4000.0, 5050.0, 8600.0}) {
    const Bandpass narrow("narrow", {wavelength - 0.1, wavelength, wavelength + 0.1}, {0, 1, 0});
    for (const Igm igm : {Igm::none, Igm::madau95}) {
      EXPECT_NEAR(
          band_flux(*sed, narrow, 1.7, igm) / monochromatic_flux(*sed, wavelength, 1.7, igm), 1,
          1.4e-9)
          << wavelength;
    }
  }
}

TEST(Photometry, IgmDimsByItsTransmission) {
  const auto sed = shipped_sed("Im");
  EXPECT_DOUBLE_EQ(monochromatic_flux(*sed, 4300, 3, Igm::madau95),
                   monochromatic_flux(*sed, 4300, 3) * madau95_transmission(4300, 3));
  for (const std::string& name : shipped_names("bandpasses", ".band")) {
    const auto band = shipped_band(name);
    for (const double z : {0.0, 1.0, 3.0}) {
      if (!covers(*sed, *band, z)) continue;
      const double ratio = band_flux(*sed, *band, z, Igm::madau95) / band_flux(*sed, *band, z);
      if (band->range().low >= 1216 * (1 + z)) {
        EXPECT_EQ(ratio, 1) << name << " at " << z;
      } else {
        EXPECT_LT(ratio, 1) << name << " at " << z;
        EXPECT_GT(ratio, 0.2) << name << " at " << z;
      }
    }
  }
}

TEST(Photometry, Covers) {
  const auto e = shipped_sed("E");
  EXPECT_TRUE(covers(*e, *shipped_band("sdss_u"), 0));
  // The templates cover 91 to 25000 Angstrom; u begins at 3050 and z ends at 11100 Angstrom.
  EXPECT_TRUE(covers(*e, *shipped_band("sdss_u"), 3050.0 / 91 - 1.001));
  EXPECT_FALSE(covers(*e, *shipped_band("sdss_u"), 3050.0 / 91 - 0.999));
  EXPECT_TRUE(covers(*analytic("flat"), *shipped_band("sdss_u"), 1000));
  const Bandpass k("k", {20000, 22000, 25001}, {0, 1, 0});
  EXPECT_FALSE(covers(*e, k, 0));
  EXPECT_TRUE(covers(*e, k, 0.001));
  // Rows without response need not be covered.
  EXPECT_TRUE(covers(*e, Bandpass("k", {20000, 22000, 24000, 26000}, {0, 1, 0, 0}), 0));
  for (const std::string& sed : shipped_names("seds", ".sed")) {
    for (const std::string& band : shipped_names("bandpasses", ".band")) {
      for (const double z : {0.0, 1.0, 3.0, 7.0}) {
        EXPECT_TRUE(covers(*shipped_sed(sed), *shipped_band(band), z)) << sed << ' ' << band;
        const double flux = band_flux(*shipped_sed(sed), *shipped_band(band), z);
        EXPECT_GE(flux, 0) << sed << ' ' << band;
        EXPECT_TRUE(std::isfinite(flux)) << sed << ' ' << band;
      }
    }
  }
}

TEST(Photometry, Constants) {
  // docs/facts.md section 4.
  EXPECT_NEAR(nanojansky(25), 363.078, 0.5e-3);
  EXPECT_NEAR(nanojansky(0) * 1e-9, 3630.78, 0.5e-2);
  EXPECT_NEAR(nanojansky(31.4), 1, 1e-15);
  for (const double m : {-27.0, 0.0, 20.5, 45.0})
    EXPECT_NEAR(ab_magnitude(nanojansky(m)), m, 8e-15);
  EXPECT_EQ(ab_magnitude(0), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(ab_magnitude(-1)));
  // 1 MJy/sr is 20.4721 mag/arcsec^2.
  constexpr double arcsec = std::numbers::pi / 180 / 3600;
  EXPECT_NEAR(ab_magnitude(1e6 * 1e9 * arcsec * arcsec), 20.4721, 0.5e-4);
  // 3.59828e-9 erg/s/cm^2/Angstrom at 5500 Angstrom is magnitude 0.
  EXPECT_NEAR(magnitude_cgs(3.59828e-9 * monochromatic_flux(*analytic("flat"), 5500, 0)), 0, 2e-6);
}

TEST(Photometry, PhotonRate) {
  for (const std::string& name : shipped_names("bandpasses", ".band")) {
    const auto band = shipped_band(name);
    const double rate = 5.47954e10 * band->log_width() * band->throughput();
    EXPECT_NEAR(nanojansky(0) * photon_rate_per_nanojansky(*band, 1, 1) / rate, 1, 6e-7) << name;
    EXPECT_NEAR(
        nanojansky(20) * photon_rate_per_nanojansky(*band, 33.2, 0.8) / (1e-8 * 33.2 * 0.8 * rate),
        1, 6e-7)
        << name;
  }
}

}  // namespace
}  // namespace gamer::photometry_test
