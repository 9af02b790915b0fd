#include "image/convolution/psf.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::psf_test {
namespace {

using std::numbers::pi;

Psf moffat(double fwhm, double beta) { return Psf({PsfKind::moffat, fwhm, beta}); }

Psf airy(double fwhm, double obscuration) {
  PsfModel model{PsfKind::airy, fwhm};
  model.obscuration = obscuration;
  return Psf(model);
}

/// An Airy pattern in units of lambda/D.
Psf airy(double obscuration) { return airy(airy_fwhm(obscuration), obscuration); }

/// Every model, with a width for which a small stamp has core and wings.
std::vector<Psf> models(double fwhm) {
  return {Psf({PsfKind::gaussian, fwhm}),
          moffat(fwhm, 2.5),
          moffat(fwhm, 4.765),
          airy(fwhm, 0),
          airy(fwhm, 0.33),
          Psf({PsfKind::kolmogorov, fwhm})};
}

TEST(PsfModels, HalfOfThePeakAtHalfTheWidth) {
  for (const Psf& psf : models(3.7)) {
    EXPECT_NEAR(psf.density(3.7 / 2) / psf.density(0), 0.5, 1e-12);
  }
}

/// The flux within a radius is the integral of the density (Simpson's rule).
TEST(PsfModels, EnergyIsTheIntegralOfTheDensity) {
  for (const Psf& psf : models(2)) {
    constexpr int step_count = 4000;
    constexpr double true_radius = 30;
    double sum = 0;
    for (int i = 0; i <= step_count; ++i) {
      const double r = true_radius * i / step_count;
      const double weight = i == 0 || i == step_count ? 1 : i % 2 == 1 ? 4 : 2;
      sum += weight * 2 * pi * r * psf.density(r);
    }
    sum *= true_radius / step_count / 3;
    EXPECT_NEAR(psf.encircled_energy(true_radius), sum, 1e-9);
    EXPECT_EQ(psf.encircled_energy(0), 0);
  }
}

/// Expects half of the flux within `radius`, to this error.
void expect_half_light(const Psf& psf, double radius, double error) {
  EXPECT_LT(psf.encircled_energy(radius - error), 0.5);
  EXPECT_GT(psf.encircled_energy(radius + error), 0.5);
}

TEST(PsfModels, Gaussian) {
  // FWHM = 2.354820 sigma, r50 = 1.177410 sigma.
  const Psf psf({PsfKind::gaussian, 2.354820045});
  expect_half_light(psf, 1.177410, 5e-7);
  EXPECT_NEAR(psf.density(0), 1 / (2 * pi), 1e-9);
  EXPECT_NEAR(psf.density(1) / psf.density(0), std::exp(-0.5), 1e-9);
}

TEST(PsfModels, Moffat) {
  struct Row {
    double beta, alpha, half_light, energy;  // widths in FWHM; energy within 3 FWHM
  };
  for (const Row& row :
       {Row{2.5, .884564, .677948, .97738}, Row{3, .980730, .631192, .99068},
        Row{3.5, 1.068401, .603914, .99575}, Row{4.765, 1.263582, .568106, .99920}}) {
    const Psf psf = moffat(1, row.beta);
    expect_half_light(psf, row.half_light, 5e-7);
    EXPECT_NEAR(psf.encircled_energy(3), row.energy, 5e-6);
    EXPECT_NEAR(psf.density(0), (row.beta - 1) / (pi * row.alpha * row.alpha), 2e-6);
    EXPECT_NEAR(psf.density(row.alpha) / psf.density(0), std::pow(2, -row.beta), 1e-6);
  }
  // 1 % of the flux lies beyond 4.0 FWHM.
  EXPECT_NEAR(1 - moffat(1, 2.5).encircled_energy(4.0), 0.01, 2e-4);
}

TEST(PsfModels, Airy) {
  struct Row {
    double obscuration, fwhm, minimum, minimum_error, energy;
  };
  for (const Row& row :
       {Row{0, 1.02899, 1.21967, 5e-6, .8378}, Row{.33, .97198, 1.0977, 5e-5, .6565},
        Row{.5, .91167, 1.0009, 5e-5, .4930}}) {
    EXPECT_NEAR(airy_fwhm(row.obscuration), row.fwhm, 5e-6);
    const Psf psf = airy(row.obscuration);
    double minimum = 0.8;
    for (double r = 0.8; r < 1.4; r += 1e-6) {
      if (psf.density(r) < psf.density(minimum)) minimum = r;
    }
    EXPECT_NEAR(minimum, row.minimum, row.minimum_error);
    EXPECT_NEAR(psf.encircled_energy(1.22), row.energy, 1e-4);
    EXPECT_NEAR(psf.density(0), pi / 4 * (1 - row.obscuration * row.obscuration), 1e-12);
  }
}

TEST(PsfModels, Kolmogorov) {
  const Psf psf({PsfKind::kolmogorov, 1});
  expect_half_light(psf, .5685, 5e-5);
  EXPECT_NEAR(psf.density(0), .74794, 5e-6);
  EXPECT_NEAR(psf.density(1) / psf.density(0), .0891, 5e-5);
  EXPECT_NEAR(psf.density(2) / psf.density(0), 3.83e-3, 5e-6);
  EXPECT_NEAR(psf.density(3) / psf.density(0), 6.95e-4, 5e-7);
  // The values are from 40000 Gauss-Legendre nodes in frequency with SciPy, and from the tail's
  // series.
  struct Row {
    double radius, density, energy;
  };
  for (const Row& row :
       {Row{.25, 6.256142318016e-01, .134452398749}, Row{.5, 3.739710401186e-01, .421757904255},
        Row{1, 6.662040771900e-02, .824045567740}, Row{3, 5.196809818107e-04, .984070519588},
        Row{7, 1.990917310605e-05, .996407384631}, Row{20, 4.078278373844e-07, .999387472223}}) {
    EXPECT_NEAR(psf.density(row.radius) / row.density, 1, 2e-9) << row.radius;
    EXPECT_NEAR(psf.encircled_energy(row.radius), row.energy, 2e-10) << row.radius;
  }
}

/// FWHM = 0.97586 lambda/r0. The density must give the optical transfer function: int 2 pi r I J0(2
/// pi f r) dr = exp(-3.4419 f^(5/3)).
TEST(PsfModels, KolmogorovTransferFunction) {
  const Psf psf({PsfKind::kolmogorov, 0.97586});
  const double f = 0.3;
  double sum = 0;
  constexpr double step_size = 2e-3, end_record = 100;
  for (int i = 1; i * step_size < end_record; ++i) {
    const double r = i * step_size;
    sum += step_size * 2 * pi * r * psf.density(r) * std::cyl_bessel_j(0, 2 * pi * f * r);
  }
  EXPECT_NEAR(sum, std::exp(-3.4419 * std::pow(f, 5.0 / 3)), 4e-6);
}

TEST(PsfModels, OutsideTheirIntervals) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double fwhm : {0.0, -1.0, nan}) {
    EXPECT_THROW(Psf({PsfKind::gaussian, fwhm}), std::invalid_argument);
  }
  EXPECT_THROW(moffat(1, 1), std::invalid_argument);
  EXPECT_THROW(airy(1, 1), std::invalid_argument);
  PsfModel model;
  model.axis_ratio = 0;
  EXPECT_THROW(Psf{model}, std::invalid_argument);
  model.axis_ratio = 1.1;
  EXPECT_THROW(Psf{model}, std::invalid_argument);
}

/// Expected values are integrals over pixels with 8 x 8 subpixels of 24 x 24 Gauss-Legendre nodes,
/// by NumPy.
TEST(Stamps, PixelsAreIntegrals) {
  struct Pixel {
    int x, y;
    double value;
  };
  struct Case {
    PsfModel model;
    std::vector<Pixel> pixels;
  };
  const std::vector<Case> cases = {{{PsfKind::moffat, 1.7, 2.5, 0, .6, 30},
                                    {{0, 0, 1.752106302839e-01},
                                     {1, 0, 6.866891576500e-02},
                                     {0, 1, 9.174827613907e-02},
                                     {2, -1, 1.435171016136e-02},
                                     {5, 7, 1.241294437289e-05},
                                     {-20, 3, 2.710982425608e-07}}},
                                   {{PsfKind::gaussian, 1.2, 3, 0, .5, 40},
                                    {{0, 0, 4.320550715587e-01},
                                     {1, 0, 8.185596589432e-02},
                                     {0, 1, 1.059683934123e-01},
                                     {2, -1, 1.844324249504e-03}}},
                                   {{PsfKind::airy, 2.2, 3, .33, .8, -20},
                                    {{0, 0, 1.247789741283e-01},
                                     {1, 0, 6.651869340379e-02},
                                     {0, 1, 7.932023514601e-02},
                                     {2, -1, 2.216771323008e-03},
                                     {5, 7, 1.970584695386e-04},
                                     {-20, 3, 8.967614731059e-06}}}};
  StampOptions options;
  options.size = 41;
  options.keep_missing_flux = true;
  for (const Case& c : cases) {
    const Stamp stamp = make_stamp(Psf(c.model), options);
    for (const Pixel& p : c.pixels) {
      EXPECT_NEAR(stamp.at(p.x, p.y) / p.value, 1, 1e-8) << p.x << ' ' << p.y;
      EXPECT_EQ(stamp.at(p.x, p.y), stamp.at(-p.x, -p.y));
    }
  }
}

/// For a Gaussian along the axes, the error function agrees with the quadrature that is used for a
/// Gaussian turned by a negligible angle.
TEST(Stamps, GaussianByErrorFunction) {
  for (const double fwhm : {0.15, 0.8, 3.0}) {
    for (const double angle : {0.0, 90.0, -90.0, 180.0}) {
      PsfModel model{PsfKind::gaussian, fwhm, 3, 0, .7, angle};
      StampOptions options;
      options.size = 11;
      options.keep_missing_flux = true;
      const Stamp exact = make_stamp(Psf(model), options);
      model.position_angle += 1e-9;
      const Stamp summed = make_stamp(Psf(model), options);
      for (int y = -5; y <= 5; ++y) {
        for (int x = -5; x <= 5; ++x) EXPECT_NEAR(exact.at(x, y), summed.at(x, y), 1e-9);
      }
    }
  }
}

/// The quadrature finds all flux of narrow PSFs.
TEST(Stamps, NarrowCores) {
  StampOptions options;
  options.size = 501;
  options.keep_missing_flux = true;
  for (const double fwhm : {0.1, 0.3, 1.0}) {
    for (const double ratio : {1.0, 0.1}) {
      const Stamp stamp = make_stamp(Psf({PsfKind::moffat, fwhm, 3.5, 0, ratio, 27}), options);
      EXPECT_NEAR(stamp.sum(), 1, 1e-8) << fwhm << ' ' << ratio;
    }
  }
}

/// Widths and angle of an elliptical stamp follow from its second moments.
TEST(Stamps, Ellipse) {
  const double fwhm = 9, ratio = 0.6, angle = 25;
  StampOptions options;
  options.size = 81;
  const Stamp stamp = make_stamp(Psf({PsfKind::gaussian, fwhm, 3, 0, ratio, angle}), options);
  double xx = 0, xy = 0, yy = 0;
  for (int y = -40; y <= 40; ++y) {
    for (int x = -40; x <= 40; ++x) {
      xx += stamp.at(x, y) * x * x;
      xy += stamp.at(x, y) * x * y;
      yy += stamp.at(x, y) * y * y;
    }
  }
  const double sigma2 = fwhm * fwhm / (8 * std::log(2)), pixel = 1.0 / 12;
  const double mean = (xx + yy) / 2, half = std::hypot((xx - yy) / 2, xy);
  EXPECT_NEAR(mean + half - pixel, sigma2 / ratio, 1e-7);
  EXPECT_NEAR(mean - half - pixel, sigma2 * ratio, 1e-7);
  // The angle counts from +y towards -x.
  EXPECT_NEAR(0.5 * std::atan2(-2 * xy, yy - xx) * 180 / pi, angle, 1e-7);
}

TEST(Stamps, SumIsOneOrTheFluxThatTheyHold) {
  for (const Psf& psf : models(2.4)) {
    StampOptions options;
    options.size = 33;
    EXPECT_NEAR(make_stamp(psf, options).sum(), 1, 1e-14);
    options.keep_missing_flux = true;
    const double sum = make_stamp(psf, options).sum();
    // The sum lies between the fluxes within the inscribed and the circumscribed circle.
    EXPECT_GT(sum, psf.encircled_energy(16.5) - 1e-12);
    EXPECT_LT(sum, psf.encircled_energy(16.5 * std::numbers::sqrt2) + 1e-12);
  }
}

TEST(Stamps, PointSampling) {
  StampOptions options;
  options.size = 7;
  options.integrated = false;
  options.keep_missing_flux = true;
  const Psf psf({PsfKind::moffat, 2, 3, 0, .5, 70});
  const Stamp stamp = make_stamp(psf, options);
  for (int y = -3; y <= 3; ++y) {
    for (int x = -3; x <= 3; ++x) EXPECT_NEAR(stamp.at(x, y), psf.density(x, y), 1e-15);
  }
}

TEST(Stamps, SizeFollowsFromTheEnergy) {
  for (const Psf& psf : models(1.5)) {
    for (const double energy : {0.5, 0.9, 0.99}) {
      const int size = stamp_size(psf, energy);
      EXPECT_EQ(size % 2, 1);
      EXPECT_GE(psf.encircled_energy(size / 2.0), energy);
      if (size > 1) {
        EXPECT_LT(psf.encircled_energy(size / 2.0 - 1), energy);
      }
    }
  }
  EXPECT_EQ(stamp_size(airy(40, 0), 0.9999), largest_chosen_stamp);
  const Psf round({PsfKind::gaussian, 10}), flat({PsfKind::gaussian, 10, 3, 0, .25, 0});
  EXPECT_NEAR(stamp_size(flat, 0.999), 2 * stamp_size(round, 0.999), 2);
  EXPECT_EQ(make_stamp(round).width, stamp_size(round, 0.999));
}

TEST(Stamps, WrongOptions) {
  const Psf psf({PsfKind::gaussian, 2});
  for (const int size : {-1, 2, largest_stamp + 2}) {
    StampOptions options;
    options.size = size;
    EXPECT_THROW(make_stamp(psf, options), std::invalid_argument);
  }
  for (const double energy : {0.0, 1.0})
    EXPECT_THROW(stamp_size(psf, energy), std::invalid_argument);
}

std::string error_of(int width, int height, std::vector<double> values) {
  try {
    read_stamp(MemoryPlane(width, height, std::move(values)), "psf.fits");
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(Stamps, FromImages) {
  const MemoryPlane image(3, 1, {1, 5, 2});
  const Stamp stamp = read_stamp(image, "psf.fits");
  EXPECT_EQ(stamp.width, 3);
  EXPECT_EQ(stamp.height, 1);
  EXPECT_EQ(stamp.at(-1, 0), 0.125);
  EXPECT_EQ(stamp.at(0, 0), 0.625);
  EXPECT_EQ(stamp.at(1, 0), 0.25);
  EXPECT_EQ(read_stamp(image, "psf.fits", true).at(0, 0), 5);

  EXPECT_EQ(error_of(2, 1, {1, 1}),
            "psf.fits: a PSF of 2 x 1 pixels has no middle pixel to be centred on; crop or pad it "
            "to odd sides");
  EXPECT_EQ(error_of(3, 1, {1, 1, std::numeric_limits<double>::quiet_NaN()}),
            "psf.fits: pixel (3, 1) of the PSF is nan; a PSF must be finite");
  EXPECT_EQ(error_of(1, 3, {1, -2, 1}),
            "psf.fits: the PSF's pixels sum to 0; the sum must be positive");
  EXPECT_EQ(error_of(1, 1, {-2}), "psf.fits: the PSF's pixels sum to -2; the sum must be positive");
}

}  // namespace
}  // namespace gamer::psf_test
