// Light behind and within dust, from few spectral nodes, agrees with fine integrals over the bands.

#include "gamer/render/spectral_basis.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "gamer/sed/photometry.h"

namespace gamer::spectral_basis_test {
namespace {

Resources& shipped() {
  static Resources resources({GAMER_TEST_SOURCE_DIR});
  return resources;
}

std::shared_ptr<const Sed> sed_of(const std::string& name) { return find_sed(name, "", shipped()); }

SpectralPlane plane_of(std::shared_ptr<const Bandpass> band) {
  return {band->name(), band->pivot(), band};
}

/// 1, 5 or 30 bands: SDSS r, all of SDSS, or steps of a spectrograph from 3500 to 11000 Angstrom.
Spectrum bands_of(int count) {
  Spectrum spectrum;
  if (count == 1) {
    spectrum.planes.push_back(plane_of(find_bandpass("sdss_r", "", shipped())));
  } else if (count == 5) {
    for (const char* name : {"sdss_u", "sdss_g", "sdss_r", "sdss_i", "sdss_z"}) {
      spectrum.planes.push_back(plane_of(find_bandpass(name, "", shipped())));
    }
  } else {
    for (int k = 0; k < count; ++k) {
      const double low = 3500 + 250 * k;
      spectrum.planes.push_back(plane_of(std::make_shared<Bandpass>(
          fmt::format("b{}", k), std::vector<double>{low, low + 10, low + 240, low + 250},
          std::vector<double>{0, 1, 1, 0})));
    }
  }
  return spectrum;
}

/// The share of light that passes dust of optical depth `tau`.
using Geometry = double (*)(double tau);
double screen(double tau) { return std::exp(-tau); }
double slab(double tau) { return tau > 0 ? -std::expm1(-tau) / tau : 1; }

/// (1+z)^-1 int lambda S(lambda/(1+z)) T g(tau a) dlambda / int T dlambda/lambda by the midpoint
/// rule.
class FineIntegral {
 public:
  FineIntegral(const SpectralPlane& plane, const Sed& sed, const ExtinctionCurve& curve, double z) {
    constexpr int steps = 8000;
    const Sed::Range range = plane.range();
    double norm = 0;
    for (int i = 0; i < steps; ++i) {
      const double wavelength = range.low + (range.high - range.low) * (i + 0.5) / steps;
      const double response = plane.band->response(wavelength), rest = wavelength / (1 + z);
      light_.push_back(wavelength * sed.flux(rest) * response / (1 + z));
      extinction_.push_back(curve.relative(rest));
      norm += response / wavelength;
    }
    for (double& light : light_) light /= norm;
  }

  double flux(Geometry geometry, double tau) const {
    double sum = 0;
    for (std::size_t i = 0; i < light_.size(); ++i) {
      sum += light_[i] * geometry(tau * extinction_[i]);
    }
    return sum;
  }

 private:
  std::vector<double> light_, extinction_;
};

double flux_of(const SpectralBasis& basis, std::size_t plane, const Sed& sed,
               const ExtinctionCurve& curve, double z, Geometry geometry, double tau) {
  const std::vector<double> weights = basis.weights(sed, z);
  double sum = 0;
  for (std::size_t j = 0; j < basis.size(); ++j) {
    sum += weights[plane * basis.size() + j] *
           geometry(tau * SpectralBasis::extinction(curve, z, basis.node(j)));
  }
  return sum;
}

struct Light {
  const char* sed;
  double redshift;
  int bands;
};

std::vector<FineIntegral> fine_integrals(const Spectrum& spectrum, const Sed& sed, double z) {
  const Ccm89 curve(3.1);
  std::vector<FineIntegral> result;
  for (const SpectralPlane& plane : spectrum.planes) result.emplace_back(plane, sed, curve, z);
  return result;
}

/// Largest error over planes and depths, in units of the flux without dust.
double largest_error(const SpectralBasis& basis, const std::vector<FineIntegral>& fine,
                     const Sed& sed, double z, Geometry geometry, std::vector<double> depths) {
  const Ccm89 curve(3.1);
  double largest = 0;
  for (std::size_t p = 0; p < basis.planes(); ++p) {
    const double free = flux_of(basis, p, sed, curve, z, geometry, 0);
    const double fine_free = fine[p].flux(geometry, 0);
    for (const double tau : depths) {
      const double error = flux_of(basis, p, sed, curve, z, geometry, tau) / free -
                           fine[p].flux(geometry, tau) / fine_free;
      largest = std::max(largest, std::abs(error));
    }
  }
  return largest;
}

class DustyBands : public testing::TestWithParam<Light> {};

TEST_P(DustyBands, FluxIsThatOfTheFineIntegral) {
  const auto [name, z, bands] = GetParam();
  const auto sed = sed_of(name);
  const Ccm89 curve(3.1);
  const Spectrum spectrum = bands_of(bands);
  const std::vector<FineIntegral> fine = fine_integrals(spectrum, *sed, z);
  for (const double allowed : {1e-3, 1e-4, 1e-5}) {
    const SpectralBasis basis(spectrum, {{sed.get(), z, &curve, z}}, {}, allowed);
    const auto error = [&, z = z](Geometry geometry, const std::vector<double>& depths) {
      return largest_error(basis, fine, *sed, z, geometry, depths);
    };
    const double chosen = error(screen, {0.25, 1, 4});
    const double screens = error(screen, {0.1, 0.5, 2, 6});
    const double slabs = error(slab, {0.1, 0.5, 2, 6, 20});
    std::printf("%-3s z %g, %2d bands, error %.0e: %2zu nodes, %.1e %.1e %.1e\n", name, z, bands,
                allowed, basis.size(), chosen, screens, slabs);
    EXPECT_LT(chosen, allowed);
    // These screens and slabs did not choose the nodes.
    EXPECT_LT(screens, 1.5 * allowed);
    EXPECT_LT(slabs, allowed);
  }
}

INSTANTIATE_TEST_SUITE_P(Bands, DustyBands,
                         testing::Values(Light{"E", 0, 1}, Light{"E", 0, 5}, Light{"E", 0, 30},
                                         Light{"E", 1, 1}, Light{"E", 1, 5}, Light{"E", 1, 30},
                                         Light{"Im", 0, 1}, Light{"Im", 0, 5}, Light{"Im", 0, 30},
                                         Light{"Im", 1, 1}, Light{"Im", 1, 5}, Light{"Im", 1, 30}),
                         [](const auto& test) {
                           return fmt::format("{}_{}_{}", test.param.sed, test.param.redshift,
                                              test.param.bands);
                         });

TEST(SpectralBasis, BandSamplesAreThoseAskedFor) {
  const auto sed = sed_of("E");
  const Ccm89 curve(3.1);
  const Spectrum spectrum = bands_of(5);
  const std::vector<FineIntegral> fine = fine_integrals(spectrum, *sed, 0);
  double last = 1;
  for (const int samples : {1, 2, 3, 4}) {
    const SpectralBasis basis(spectrum, {{sed.get(), 0, &curve, 0}}, samples, 1e-3);
    EXPECT_EQ(basis.size(), static_cast<std::size_t>(5 * samples));
    for (std::size_t p = 0; p < basis.planes(); ++p) {
      const Sed::Range range = spectrum.planes[p].range();
      for (std::size_t k = 0; k < static_cast<std::size_t>(samples); ++k) {
        const double node = basis.node(p * static_cast<std::size_t>(samples) + k);
        EXPECT_TRUE(node > range.low && node < range.high);
      }
    }
    const double error = largest_error(basis, fine, *sed, 0, screen, {0.5, 2});
    std::printf("%d samples: %.1e\n", samples, error);
    EXPECT_LT(error, last);
    last = error;
  }
  EXPECT_LT(last, 2e-4);
}

TEST(SpectralBasis, WithoutDustThereIsOneNode) {
  const auto sed = sed_of("Im");
  for (const int bands : {1, 5, 30}) {
    const SpectralBasis basis(bands_of(bands), {}, {}, 1e-6);
    EXPECT_EQ(basis.size(), 1u);
    for (const double z : {0.0, 0.3, 1.0}) {
      const std::vector<double> weights = basis.weights(*sed, z);
      const std::vector<FineIntegral> fine = fine_integrals(basis.spectrum(), *sed, z);
      for (std::size_t p = 0; p < basis.planes(); ++p) {
        // The midpoint rule misses the rows of spectrum and band.
        EXPECT_NEAR(weights[p] / fine[p].flux(screen, 0), 1, 2e-6);
      }
    }
  }
}

// A single wavelength lambda is a band of no width, with the weight lambda^2 S(lambda/(1+z))/(1+z).
TEST(SpectralBasis, WavelengthsAmongBands) {
  Spectrum spectrum = bands_of(1);
  spectrum.planes.insert(spectrum.planes.begin(),
                         {{"4000A", 4000, nullptr}, {"9000A", 9000, nullptr}});
  const auto sed = sed_of("Im");
  const Ccm89 curve(3.1);
  const double z = 0.5;
  const SpectralBasis basis(spectrum, {{sed.get(), z, &curve, z}}, {}, 1e-4);
  for (const std::size_t p : {0u, 1u}) {
    const double wavelength = spectrum.planes[p].wavelength, rest = wavelength / (1 + z);
    const double free = wavelength * wavelength * sed->flux(rest) / (1 + z);
    for (const double tau : {0.5, 2.0}) {
      EXPECT_NEAR(flux_of(basis, p, *sed, curve, z, screen, tau) / free,
                  std::exp(-tau * curve.relative(rest)), 1e-4);
    }
    double sum = 0;
    for (const double value : basis.interpolation(p)) sum += value;
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LT(basis.main_node(p), basis.size());
  }
}

TEST(SpectralBasis, ManyWavelengthsShareNodes) {
  Spectrum spectrum;
  for (int k = 0; k < 200; ++k) {
    const double wavelength = 4000 + 25 * k;
    spectrum.planes.push_back({fmt::format("{}A", wavelength), wavelength, nullptr});
  }
  const auto sed = sed_of("E");
  const Ccm89 curve(3.1);
  const SpectralBasis basis(spectrum, {{sed.get(), 0, &curve, 0}}, {}, 1e-4);
  EXPECT_LT(basis.size(), 20u);
  for (std::size_t p = 0; p < basis.planes(); p += 7) {
    const double wavelength = spectrum.planes[p].wavelength;
    const double free = wavelength * wavelength * sed->flux(wavelength);
    EXPECT_NEAR(flux_of(basis, p, *sed, curve, 0, screen, 1.5) / free,
                std::exp(-1.5 * curve.relative(wavelength)), 1e-4);
  }
}

// Light that hydrogen takes away carries no weight; Madau (1995) leaves nothing below 912 (1+z).
TEST(SpectralBasis, IgmAbsorbsWithinTheBand) {
  const auto sed = sed_of("Im");
  Spectrum spectrum;
  spectrum.planes.push_back(plane_of(find_bandpass("sdss_g", "", shipped())));
  spectrum.igm = Igm::madau95;
  const SpectralBasis basis(spectrum, {}, {}, 1e-4);
  EXPECT_NEAR(
      basis.weights(*sed, 3.0)[0] / band_flux(*sed, *spectrum.planes[0].band, 3.0, Igm::madau95), 1,
      1e-12);
  EXPECT_LT(basis.weights(*sed, 3.0)[0], 0.9 * band_flux(*sed, *spectrum.planes[0].band, 3.0));
}

}  // namespace
}  // namespace gamer::spectral_basis_test
