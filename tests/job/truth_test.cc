// Calibration over redshifts and pixel scales, light through dust compared with integrals, and the
// properties of galaxies in the truth table.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "gamer/job/attenuation.h"
#include "gamer/job/schedule.h"
#include "gamer/job/truth_table.h"
#include "gamer/render/galaxy_measure.h"
#include "gamer/sed/extinction.h"
#include "render/render_text.h"

namespace gamer::truth_test {
namespace {

constexpr double promised = 0.002;  // mag

constexpr const char* bulge = R"([[component]]
class = "bulge"
sed = "E"
effective_radius = 0.1
)";
// The bulge is so small that the ball holds all its light.
constexpr const char* compact = R"([[component]]
class = "bulge"
sed = "E"
effective_radius = 0.02
)";
constexpr const char* spiral = R"([arms]
model = "logarithmic"
pitch_angle = 15
count = 2
[[component]]
class = "disk"
sed = "Sbc"
z0 = 0.02
rh = 0.2
arm_width = 1
)";
constexpr const char* clumps = R"([arms]
model = "logarithmic"
pitch_angle = 15
count = 2
[[component]]
class = "stars"
sed = "Im"
z0 = 0.02
rh = 0.2
arm_width = 1
)";
constexpr const char* two_parts = R"([[component]]
class = "disk"
sed = "Sbc"
z0 = 0.02
rh = 0.2
arm_width = 0
fraction = 0.7
[[component]]
class = "associations"
sed = "Sbc"
z0 = 0.01
rh = 0.3
arm_width = 0
fraction = 0.3
)";
// Light and dust have one profile, so that tau(R) = tau_V a exp(-R/h) face-on, a = A(lambda)/A(V).
constexpr const char* mixed = R"([[component]]
class = "disk"
sed = "Sbc"
z0 = 0.01
rh = 0.05
arm_width = 0
noise = false
[[component]]
class = "dust"
z0 = 0.01
rh = 0.05
arm_width = 0
noise = false
optical_depth = 2
)";

/// A job whose galaxies have their brightness; measurements take two threads.
RenderJob make(const std::string& list, const std::string& toml, bool truth = false) {
  RenderParameters parameters = RenderParameters::read(parse_toml(toml, "render.par"));
  Resources resources({GAMER_TEST_SOURCE_DIR});
  resources.add({"galaxies/bulge", "bulge.toml", bulge});
  resources.add({"galaxies/compact", "compact.toml", compact});
  resources.add({"galaxies/spiral", "spiral.toml", spiral});
  resources.add({"galaxies/clumps", "clumps.toml", clumps});
  resources.add({"galaxies/parts", "parts.toml", two_parts});
  resources.add({"galaxies/mixed", "mixed.toml", mixed});
  const Camera camera(parameters);
  Spectrum spectrum = load_spectrum(parameters, resources);
  auto scene = std::make_shared<Scene>(
      read_scene(list, "scene.lst", parameters, spectrum, camera, resources));
  RenderJob::Pending pending;
  pending.attenuation = load_reference_band(parameters, resources);
  RenderJob job{std::move(parameters), camera, std::move(spectrum), std::move(scene), {}};
  pending.truth = truth;
  choose_drawn_stars(job.parameters, job.camera, *job.scene);
  choose_layers(job, false);
  apply_attenuation(job.parameters, pending, Ranks(), 2, job);
  return job;
}

GalaxyMeasure measure_alone(const PlacedGalaxy& placed, const RenderJob& made) {
  return measure(placed, made.parameters, made.camera, made.spectrum);
}

double magnitude(const RenderJob& made, int plane = 0) {
  return ab_magnitude(sum_of(image_of(made), plane));
}

std::string grid_sky(int size, double pixel_scale, const std::string& grid,
                     const std::string& more) {
  return fmt::format(
      "[image]\nsize = {}\n[camera]\nprojection = \"sky\"\ncenter = [10, 20]\npixel_scale = {}\n{}"
      "[spectrum]\nbands = [\"sdss_r\"]\n{}",
      size, pixel_scale, grid, more);
}

std::string sky(int size, double pixel_scale, const std::string& more) {
  return grid_sky(size, pixel_scale, "", more);
}

/// Whether the flux of the only galaxy is fixed, so that its pixels add up to its magnitude.
bool is_fixed(const RenderJob& made) { return made.scene->galaxies.front().has_fixed_flux; }

// Error of the sum of such pixels (mag), twice the measured error.
constexpr double rounding = 5e-9;

class Calibration : public testing::TestWithParam<double> {};

// A galaxy of 6 kpc is 270 to 5 pixels wide; its half-light radius is 100 pixels to less than one.
TEST_P(Calibration, SumOfPixelsIsTheMagnitude) {
  const double redshift = GetParam();
  const double radius = 6 * 1e-3 * (1 + redshift) / Cosmology().comoving_distance(redshift) * 180 *
                        3600 / std::numbers::pi;
  // Errors are twice those measured. Pixels of small galaxies add up exactly; larger textured disks
  // have the error of the mean of their noise.
  struct Kind {
    const char* type;
    double error;  // mag
  };
  for (const auto& [type, error] :
       {Kind{"bulge", 2.1e-4}, {"spiral", 2.3e-4}, {"clumps", 2.1e-3}}) {
    for (const double scale : {0.03, 0.1, 0.3}) {
      const int size = static_cast<int>(2.2 * radius / scale) + 6;
      const RenderJob made =
          make(fmt::format("galaxy ra dec redshift size_kpc inclination pa apparent_magnitude\n"
                           "{} 10.00001 20.00001 {} 6 40 30 22\n",
                           type, redshift),
               sky(size, scale, ""));
      EXPECT_NEAR(magnitude(made), 22, is_fixed(made) ? rounding : error) << type << ' ' << scale;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Redshifts, Calibration, testing::Values(0.1, 0.5, 1.0, 2.0));

/// The share of light of `mixed` that leaves it face-on, in a band: the mean of (1 - exp(-tau))/tau
/// over radii and wavelengths, weighted with light.
double mixed_attenuation(const Bandpass& band, double redshift) {
  Resources resources({GAMER_TEST_SOURCE_DIR});
  const auto sed = find_sed("Sbc", "", resources);
  const Ccm89 curve(3.1);
  double seen = 0, all = 0;
  const Sed::Range range = band.range();
  for (double wavelength = range.low + 1; wavelength < range.high; wavelength += 2) {
    const double light =
        wavelength * sed->flux(wavelength / (1 + redshift)) * band.response(wavelength);
    const double depth = 2 * curve.relative(wavelength / (1 + redshift));
    double part = 0, whole = 0;
    // R = h x, with the weight x e^-x dx.
    for (double x = 0.005; x < 14; x += 0.01) {
      const double tau = depth * std::exp(-x);
      part += x * std::exp(-x) * -std::expm1(-tau) / tau;
      whole += x * std::exp(-x);
    }
    seen += light * part;
    all += light * whole;
  }
  return seen / all;
}

TEST(Calibration, LightThroughDust) {
  for (const double redshift : {0.1, 1.0}) {
    const std::string list = fmt::format(
        "galaxy ra dec redshift size_arcsec apparent_magnitude\nmixed 10 20 {} 4 22\n", redshift);
    RenderJob made = make(list, sky(90, 0.1, "[photometry]\nattenuated = false\n"));
    const double lost =
        -2.5 * std::log10(mixed_attenuation(*made.spectrum.planes.front().band, redshift));
    EXPECT_GT(lost, 0.2);
    EXPECT_NEAR(magnitude(made), 22 + lost, promised);
    EXPECT_NEAR(
        -2.5 * std::log10(measure_alone(made.scene->galaxies.front(), made).attenuation.front()),
        lost, promised);
    made = make(list, sky(90, 0.1, ""));
    EXPECT_NEAR(magnitude(made), 22, promised);
  }
}

// Pixels add up to the apparent magnitude, dust included: exactly for galaxies of at most 256
// pixels, for larger ones to some thousandths, since parallel rays measure their dust.
TEST(Calibration, ApparentMagnitudesAreThoseObserved) {
  struct Kind {
    const char* type;
    double error;  // mag, at most twice what was measured
  };
  for (const auto& [type, error] :
       {Kind{"dusty_barred", 3e-3}, {"elliptical_dust", 2.7e-3}, {"m51", 3.5e-3}}) {
    const auto made = [&](int pixels, double tolerance) {
      return make(
          fmt::format("galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
                      "{} 10 20 0.1 4 60 22 7\n",
                      type),
          // The light of drawn stars would be random.
          sky(pixels, 9.0 / pixels,
              fmt::format("[sampling]\ntolerance = {}\nstars_per_pixel = 0\n", tolerance)));
    };
    for (const double tolerance : {1e-2, 1e-3}) {
      const RenderJob small = made(90, tolerance);
      ASSERT_TRUE(is_fixed(small));
      EXPECT_NEAR(magnitude(small), 22, rounding) << type << ' ' << tolerance;
      // The table of truth agrees, too.
      const PlacedGalaxy& galaxy = small.scene->galaxies.front();
      const double bare = dust_free_flux(galaxy, small.camera, small.spectrum).front();
      EXPECT_NEAR(ab_magnitude(bare * measure_alone(galaxy, small).attenuation.front()), 22,
                  rounding);
    }
    const RenderJob large = made(300, 1e-2);
    ASSERT_FALSE(is_fixed(large));
    EXPECT_NEAR(magnitude(large), 22, error) << type;
  }
}

// A flux is fixed where the galaxy has dust or texture, but not on a grid of rays.
TEST(Calibration, FluxesAreFixedWhereItHelps) {
  const auto fixes = [](const std::string& type, const std::string& grid) {
    return is_fixed(
        make("galaxy ra dec redshift size_arcsec apparent_magnitude\n" + type + " 10 20 0.1 2 22\n",
             grid_sky(20, 0.3, grid, "[sampling]\ntolerance = 1e-2\n")));
  };
  EXPECT_TRUE(fixes("mixed", ""));
  EXPECT_TRUE(fixes("clumps", ""));
  EXPECT_FALSE(fixes("bulge", ""));
  EXPECT_FALSE(fixes("mixed", "supersample = 2\n"));
}

// The brightness of a galaxy of fixed flux follows from all its light, within the image or not.
TEST(Calibration, FixedFluxesDoNotDependOnTheWindow) {
  const std::string list =
      "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
      "dusty_barred 10 20 0.1 2 60 22 7\n";
  const std::string coarse = "[sampling]\ntolerance = 1e-2\n";
  const RenderJob whole = make(list, sky(60, 0.1, coarse));
  const RenderJob part = make(list, sky(20, 0.1, coarse));
  ASSERT_TRUE(is_fixed(whole) && is_fixed(part));
  EXPECT_DOUBLE_EQ(part.scene->galaxies.front().brightness,
                   whole.scene->galaxies.front().brightness);
}

/// The rms relative error in the first plane of pixels above 1 % of the peak.
double rms_error(const Image& seen, const Image& wanted) {
  const std::size_t size = static_cast<std::size_t>(seen.width()) * seen.height();
  const std::span values(seen.plane(0), size), exact(wanted.plane(0), size);
  const double least = 0.01 * *std::ranges::max_element(exact);
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (exact[i] < least) continue;
    const double error = values[i] / exact[i] - 1;
    sum += error * error;
    ++count;
  }
  return std::sqrt(sum / count);
}

// At the default tolerance a pixel agrees to 3 % with the mean of 8 x 8 rays.
TEST(Calibration, PixelsOfFixedFluxesAreMeans) {
  for (const std::string type : {"dusty_barred", "irregular", "m51"}) {
    const auto image = [&](int rays) {
      const std::string grid = rays > 1 ? fmt::format("supersample = {}\n", rays) : "";
      const RenderJob made = make(
          fmt::format("galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
                      "{} 10 20 0.1 4 60 22 7\n",
                      type),
          grid_sky(44, 0.2, grid, "[sampling]\ntolerance = 1e-3\n"));
      EXPECT_EQ(is_fixed(made), rays == 1);
      return image_of(made);
    };
    EXPECT_LT(rms_error(image(1), image(8)), 0.03) << type;
  }
}

/// Three galaxies behind each other: a smooth galaxy between two of fixed flux.
constexpr const char* crowd =
    "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
    "dusty_barred 10 20 0.1 4 30 22 7\n"
    "bulge 10.0003 20.0001 0.2 3 0 22 1\n"
    "irregular 9.9997 20.0002 0.3 3 60 22 7\n";

std::string crowded_sky(double tolerance) {
  return grid_sky(60, 0.2, "", fmt::format("[sampling]\ntolerance = {}\n", tolerance));
}

// Layers that are kept and layers made anew give equal bits, with and without the images and the
// table of truth.
TEST(Layers, AreEqualWhetherKeptOrMadeAnew) {
  for (const double tolerance : {1e-2, 2e-3}) {
    const RenderJob kept = make(crowd, crowded_sky(tolerance));
    RenderJob anew = kept;
    ASSERT_NE(kept.layers->find(0), nullptr);
    EXPECT_EQ(kept.layers->find(1), nullptr);  // no fixed flux
    anew.layers = nullptr;
    const Image image = image_of(kept);
    const auto all = [](const Image& of) {
      return std::vector<double>(of.plane(0), of.plane(0) + of.width() * of.height());
    };
    EXPECT_EQ(all(image_of(anew)), all(image));
    TruthSettings truth;
    truth.dust_free = truth.optical_depth = truth.segmentation = true;
    for (const auto parts : {TruthSettings::Parts::objects, TruthSettings::Parts::components}) {
      truth.parts = parts;
      RenderJob with = make(crowd, crowded_sky(tolerance), true);
      with.parameters.truth = truth;
      with.layers = nullptr;
      ThreadExecutor executor(2);
      const Image more = render_image(image_renderer(with, truth), executor);
      for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
          ASSERT_EQ(more.at(x, y, 0), image.at(x, y, 0));
          double sum = 0;
          // The parts follow image, light without dust, optical depth, segmentation and share.
          for (int plane = 5; plane < more.planes(); ++plane) sum += more.at(x, y, plane);
          ASSERT_NEAR(sum, image.at(x, y, 0), 1e-12 * image.at(x, y, 0));
        }
      }
    }
  }
}

// The dimming by layers differs by some per cent from that along rays through all galaxies. At the
// limit of hidden light for a tolerance, the error of the flux is far smaller.
TEST(Layers, DimWhatIsBehindThem) {
  const RenderJob made = make(crowd, crowded_sky(4e-4));
  // Rays are finer than the limit's tolerance, so that the dimming alone makes a difference.
  Accuracy accuracy = Accuracy::from_tolerance(made.parameters.sampling.tolerance);
  const auto flux = [&](double most_dimmed) {
    accuracy.most_dimmed = most_dimmed;
    ThreadExecutor executor(2);
    const Renderer renderer(made.parameters, accuracy, made.camera, made.scene, made.spectrum, {});
    return sum_of(render_image(renderer, executor), 0);
  };
  const double whole = 3 * std::pow(10, -0.4 * (22 - ab_magnitude(1)));
  const double limit = Accuracy::from_tolerance(1e-3).most_dimmed, rays = flux(-1),
               hidden = whole - rays;
  EXPECT_GT(hidden, 0.1 * whole);
  EXPECT_NEAR(flux(1), rays, 0.06 * hidden);  // measured: 0.048
  const double seen = flux(limit);
  EXPECT_NE(seen, rays);
  EXPECT_NEAR(seen / rays, 1, 1.7e-5);  // measured: 1.1e-5
}

// A large galaxy dims the layers behind it. The flux errs by a small share of what its dust takes.
// At the limit of hidden light for a tolerance the error is far smaller. Pixels without small
// galaxies have the rays that they have anyway.
TEST(Layers, LieBehindLargeGalaxies) {
  const std::string head =
      "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n";
  const std::string front = "dusty_barred 10 20.0033 0.01 30 30 15 7\n";
  const std::string behind =
      "bulge 10.0003 20.0001 0.2 2 0 19 1\nbulge 9.9997 20.0004 0.3 2 0 19 1\n";
  std::size_t rays = 0;
  const auto image = [&](const RenderJob& job, double most_dimmed) {
    Accuracy accuracy = Accuracy::from_tolerance(job.parameters.sampling.tolerance);
    accuracy.most_dimmed = most_dimmed;
    const Renderer renderer(job.parameters, accuracy, job.camera, job.scene, job.spectrum, {});
    std::vector<double> values(60 * 60);
    RenderCounts counts;
    renderer.render_rows({0, 60}, values, counts);
    rays = counts.rays;
    return values;
  };
  const auto alone = [&](const std::string& rows) {
    return image(make(head + rows, crowded_sky(1e-3)), 1);
  };
  const RenderJob made = make(head + front + behind, crowded_sky(1e-3));
  ASSERT_FALSE(made.scene->galaxies[0].is_layer);
  ASSERT_TRUE(made.scene->galaxies[1].is_layer);
  const std::vector<double> large = alone(front), small = alone(behind);
  const std::vector<double> together = image(made, -1);
  const std::size_t rays_together = rays;
  const std::vector<double> layers = image(made, 1);
  EXPECT_LT(rays, 0.8 * rays_together);
  const std::vector<double> limited = image(made, Accuracy::from_tolerance(1e-3).most_dimmed);
  double light = 0, hidden = 0, error = 0, of_pixels = 0, at_limit = 0;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    light += small[i];
    hidden += large[i] + small[i] - together[i];
    error += layers[i] - together[i];
    of_pixels += std::abs(layers[i] - together[i]);
    at_limit += std::abs(limited[i] - together[i]);
    if (small[i] > 0) continue;
    EXPECT_NEAR(layers[i] / together[i], 1, rounding);
  }
  EXPECT_GT(hidden, 0.2 * light);
  EXPECT_NEAR(error, 0, 0.018 * hidden);      // measured: 0.0094
  EXPECT_NEAR(of_pixels, 0, 0.035 * hidden);  // measured: 0.018
  EXPECT_GT(at_limit, 0);
  EXPECT_LT(at_limit, 2.4e-5 * hidden);  // measured: 2.0e-5
}

// Stars of a small galaxy are smooth light, so that it is a layer, unless the file asks for stars.
TEST(SmallGalaxies, DrawNoStarsUnlessAsked) {
  const auto made = [](const std::string& sampling, const std::string& grid = "") {
    return make(
        "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
        "m51 10 20 0.1 4 30 22 7\n",
        grid_sky(60, 0.2, grid, "[sampling]\ntolerance = 0.05\n" + sampling));
  };
  const auto sum = [](const RenderJob& job) {
    ThreadExecutor executor(2);
    return sum_of(render_image(image_renderer(job), executor), 0);
  };
  const RenderJob smooth = made(""), none = made("stars_per_pixel = 0\n");
  EXPECT_FALSE(smooth.scene->galaxies.front().draws_stars);
  EXPECT_TRUE(smooth.scene->galaxies.front().is_layer);
  EXPECT_EQ(sum(smooth), sum(none));
  const RenderJob no_layer = made("", "supersample = 2\n");
  EXPECT_FALSE(no_layer.scene->galaxies.front().draws_stars);
  EXPECT_FALSE(no_layer.scene->galaxies.front().is_layer);
  const RenderJob drawn = made("stars_per_pixel = 1\n");
  EXPECT_TRUE(drawn.scene->galaxies.front().draws_stars);
  EXPECT_FALSE(drawn.scene->galaxies.front().is_layer);
  EXPECT_NE(sum(drawn), sum(none));
}

// Rays go through both of two galaxies that penetrate each other.
TEST(Layers, DoNotPenetrateEachOther) {
  const RenderJob made = make(
      "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
      "dusty_barred 10 20 0.1 4 30 22 7\nirregular 9.9997 20.0002 0.1 3 60 22 7\n",
      crowded_sky(0.05));
  EXPECT_EQ(Accuracy::from_tolerance(0.05).most_dimmed, 1);
  RenderCounts counts;
  std::vector<double> values(60);
  image_renderer(made).render_rows({30, 31}, values, counts);
  EXPECT_GT(counts.rays, 0u);
  const RenderJob apart = make(crowd, crowded_sky(0.05));
  counts = {};
  // Only the smooth galaxy has rays of the image; the others are layers.
  image_renderer(apart).render_rows({30, 31}, values, counts);
  EXPECT_EQ(counts.noise_evaluations, 0u);
}

// The table of truth takes from layers the values that it would measure itself.
TEST(Layers, TellTheTruth) {
  const RenderJob made = make(
      "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
      "dusty_barred 10 20 0.1 4 30 22 7\n",
      crowded_sky(1e-2), true);
  ASSERT_TRUE(made.measures.front());
  const GalaxyMeasure known = measure_for_truth(made, 0);
  const GalaxyMeasure own = measure_alone(made.scene->galaxies.front(), made);
  constexpr double rounding_of_sums = 1e-12;
  EXPECT_NEAR(known.attenuation[0], own.attenuation[0], rounding_of_sums);
  EXPECT_NEAR(known.dust_free[0], own.dust_free[0], rounding_of_sums);
  EXPECT_NEAR(known.half_light_radius / own.half_light_radius, 1, rounding_of_sums);
  EXPECT_NEAR(known.e1, own.e1, rounding_of_sums);
  EXPECT_NEAR(known.e2, own.e2, rounding_of_sums);
  EXPECT_EQ(known.optical_depth, own.optical_depth);
  EXPECT_LT(known.attenuation[0], 0.9);
}

// Rays of a galaxy of fixed flux give each component its share of the light.
TEST(Layers, GiveComponentsTheirShares) {
  RenderJob made = make(
      "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n"
      "parts 10 20 0.1 4 50 22 3\n",
      crowded_sky(1e-2));
  ASSERT_TRUE(is_fixed(made));
  EXPECT_EQ(made.scene->galaxies.front().light_factors.size(), 2u);
  TruthSettings truth;
  truth.parts = TruthSettings::Parts::components;
  const std::vector<double> shares = {0.7, 0.3};
  const double whole = std::pow(10, -0.4 * (22 - ab_magnitude(1)));
  // Kept layers have no images of parts.
  made.layers = nullptr;
  ThreadExecutor executor(2);
  const Image image = render_image(image_renderer(made, truth), executor);
  for (int e = 0; e < 2; ++e) {
    EXPECT_NEAR(sum_of(image, 1 + e) / whole, shares[static_cast<std::size_t>(e)], rounding);
  }
}

// The optical depth in the table is as exact as light, even where little light lies behind the
// dust.
TEST(Measure, OpticalDepthHasItsOwnNodes) {
  std::string rows = "galaxy ra dec redshift size_arcsec inclination apparent_magnitude seed\n";
  constexpr int galaxies = 12;
  for (int g = 0; g < galaxies; ++g) {
    rows += fmt::format("{} 10 20 0.1 4 {} 22 {}\n", g % 2 == 0 ? "ngc4321" : "elliptical_dust",
                        7 * (g + 1), g + 1);
  }
  const RenderJob made = make(rows, crowded_sky(1e-2));
  Accuracy accuracy = Accuracy::from_tolerance(made.parameters.sampling.tolerance);
  const auto depths = [&] {
    const Renderer renderer(made.parameters, accuracy, made.camera, made.scene, made.spectrum, {});
    std::vector<double> result;
    for (int g = 0; g < galaxies; ++g) {
      const glm::dvec2 centre = *made.camera.pixel(made.scene->galaxies[0].centre);
      result.push_back(renderer.optical_depth(centre.x, centre.y, g));
    }
    return result;
  };
  const std::vector<double> own = depths();
  accuracy.ray_error *= 1e-3;
  const std::vector<double> exact = depths();
  for (std::size_t g = 0; g < own.size(); ++g) {
    EXPECT_GT(exact[g], 1e-4);
    EXPECT_NEAR(own[g] / exact[g], 1, 8.8e-4) << g;  // measured: 4.4e-4
  }
}

// Absolute magnitudes are those without dust, unless the file asks for dust.
TEST(Calibration, AbsoluteMagnitudesAreThoseOfTheStars) {
  const auto seen = [](const std::string& attenuated) {
    return magnitude(make("galaxy ra dec redshift size_arcsec magnitude\nmixed 10 20 0.1 4 -20\n",
                          sky(90, 0.1, "[photometry]\n" + attenuated)));
  };
  const double stars = seen("attenuated = false\n");
  EXPECT_EQ(seen(""), stars);
  EXPECT_LT(seen("attenuated = true\n"), stars - 0.2);
}

TEST(Measure, HalfLightRadiusAndShape) {
  RenderJob made =
      make("galaxy ra dec redshift size_arcsec apparent_magnitude\nmixed 10 20 0.1 4 22\n",
           sky(90, 0.1, ""));
  // Without its dust the mixed disk is exponential: R_e = 1.678347 h (docs/facts.md section 5).
  PlacedGalaxy bare = made.scene->galaxies.front();
  Resources resources({GAMER_TEST_SOURCE_DIR});
  const std::string light = std::string(mixed).substr(0, std::string(mixed).rfind("[[component]]"));
  bare.galaxy = Galaxy::parse(light, "bare.toml", {}, resources);
  GalaxyMeasure result = measure_alone(bare, made);
  EXPECT_NEAR(result.half_light_radius / bare.radius, 1.678347 * 0.05, 6e-4);
  EXPECT_NEAR(result.e1, 0, 1e-6);
  EXPECT_EQ(result.optical_depth, 0);
  EXPECT_NEAR(result.attenuation.front() / result.dust_free.front(), 1, 1e-9);

  // At the centre of the mixed slab, face-on, tau = tau_V a.
  result = measure_alone(made.scene->galaxies.front(), made);
  const Ccm89 curve(3.1);
  EXPECT_NEAR(result.optical_depth,
              2 * curve.relative(made.spectrum.planes.front().wavelength / 1.1), 1e-3);
  EXPECT_GT(result.half_light_radius / bare.radius, 1.678347 * 0.05);

  // An inclined disk has <x'^2> = <x^2> along the node and cos^2 i <x^2> + sin^2 i <z^2> across it,
  // with the node at pa 30.
  made = make(
      "galaxy ra dec redshift size_arcsec apparent_magnitude inclination pa\n"
      "mixed 10 20 0.1 4 22 60 30\n",
      sky(90, 0.1, ""));
  bare = made.scene->galaxies.front();
  bare.galaxy = Galaxy::parse(light, "bare.toml", {}, resources);
  result = measure_alone(bare, made);
  // <x^2> = 3 h^2, <z^2> = pi^2/12 z0^2.
  const double along = 3 * 0.05 * 0.05, up = std::numbers::pi * std::numbers::pi / 12 * 1e-4;
  const double across = 0.25 * along + 0.75 * up;
  const double e = (along - across) / (along + across);
  EXPECT_NEAR(result.e1, e * std::cos(std::numbers::pi / 3), 1e-3);
  EXPECT_NEAR(result.e2, e * std::sin(std::numbers::pi / 3), 1e-3);
}

TEST(TruthTable, ObjectsOfAScene) {
  const RenderJob made = make(
      "galaxy ra dec redshift size_arcsec apparent_magnitude id\n"
      "star 10.001 20 0 - 20 s\ncompact 10 20 0.1 4 22 b\n",
      sky(90, 0.1, ""));
  const RenderJob job{made.parameters, made.camera, made.spectrum, made.scene, {}};
  ThreadExecutor executor(2);
  const DataTable table = truth_table(job, executor);
  ASSERT_EQ(table.rows(), 2u);
  const auto numbers = [&](const std::string& name) {
    for (const DataColumn& column : table.columns) {
      if (column.name == name) return std::get<std::vector<double>>(column.values);
    }
    ADD_FAILURE() << name;
    return std::vector<double>{0, 0};
  };
  EXPECT_NEAR(numbers("mag_sdss_r")[0], 20, 1e-9);
  EXPECT_NEAR(numbers("mag_sdss_r")[1], 22, 1e-9);
  EXPECT_NEAR(numbers("ra")[0], 10.001, 1e-9);
  EXPECT_NEAR(numbers("x")[1], 45.5, 1e-6);
  EXPECT_EQ(numbers("bulge_to_total")[1], 1);
  EXPECT_TRUE(std::isnan(numbers("half_light_radius")[0]));
  EXPECT_NEAR(numbers("half_light_radius")[1], 0.08, 0.001);
}

}  // namespace
}  // namespace gamer::truth_test
