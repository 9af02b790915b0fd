// Whole renders without noise, at the default tolerance, agree with closed forms and with the
// tables of docs/facts.md.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>

#include "gamer/sed/extinction.h"
#include "render/render_text.h"

namespace gamer::analytic_test {
namespace {

// The default tolerance is 1e-3; no ray here errs by more than half of it.
constexpr double tolerance = 5e-4;

// For sums over pixels, which sample the bulge's cusp.
constexpr double promised = 1e-3;

// Scale length and height small enough for the taper to start 14 lengths out.
constexpr double length = 0.05;
constexpr double height = 0.01;
constexpr const char* thin_disk = R"(
[[component]]
class = "disk"
sed = "flat"
z0 = 0.01
rh = 0.05
arm_width = 0
noise = false
)";

/// Pixels at multiples of half a scale length; the centre is pixel (4, 4).
Image disk_at(double inclination) {
  TextScene text;
  text.galaxies["disk"] = thin_disk;
  // pa 90 puts the line of nodes along -x, so that the minor axis is y.
  text.scene = "galaxy x y z inclination pa\ndisk 0 0 0 " + std::to_string(inclination) + " 90\n";
  text.parameters = view_from_z(9, 9, 9 * 0.5 * length);
  return render_text(text);
}

struct InclinedDisk {
  double inclination;
  double centre, major, minor;  // at (0, 0), (1, 0) major, (0, .5) minor; h = 1, z0 = 0.2
};

class InclinedDiskTest : public testing::TestWithParam<InclinedDisk> {};

TEST_P(InclinedDiskTest, LineIntegralsAsTabulated) {
  const InclinedDisk& expected = GetParam();
  const Image image = disk_at(expected.inclination);
  EXPECT_NEAR(image.at(4, 4) / (length * expected.centre), 1, tolerance);
  EXPECT_NEAR(image.at(6, 4) / (length * expected.major), 1, tolerance);
  EXPECT_NEAR(image.at(2, 4) / (length * expected.major), 1, tolerance);
  EXPECT_NEAR(image.at(4, 5) / (length * expected.minor), 1, tolerance);
  EXPECT_NEAR(image.at(4, 3) / (length * expected.minor), 1, tolerance);
}

// docs/facts.md section 5.
INSTANTIATE_TEST_SUITE_P(Analytic, InclinedDiskTest,
                         testing::Values(InclinedDisk{30, .427294, .169005, .260717},
                                         InclinedDisk{60, .641050, .281897, .308458},
                                         InclinedDisk{80, 1.238262, .643064, .211779}));

TEST(AnalyticTest, DiskFaceOn) {
  const Image image = disk_at(0);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 9; ++x) {
      const double r = 0.5 * std::hypot(x - 4, y - 4);
      EXPECT_NEAR(image.at(x, y) / (2 * height * std::exp(-r)), 1, tolerance) << x << ' ' << y;
    }
  }
}

// Columns are 2 z0 exp(-r/rh) over the cosine, also where rays cross the thinnest possible layer
// obliquely.
TEST(AnalyticTest, ThinnestDiskInclined) {
  constexpr double least_height = 1e-5, inclination = 45;
  TextScene text;
  text.galaxies["disk"] =
      "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nz0 = 1e-5\nrh = 0.2\narm_width = 0\n"
      "noise = false\n";
  text.scene = fmt::format("galaxy x y z inclination pa\ndisk 0 0 0 {} 90\n", inclination);
  constexpr int size = 21;
  constexpr double width = 0.6;
  text.parameters = view_from_z(size, size, width);
  const Image image = render_text(text);
  const double cosine = std::cos(glm::radians(inclination));
  double squares = 0;
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) {
      const double x = width * (i - size / 2) / size, y = width * (j - size / 2) / size;
      const double column = 2 * least_height / cosine * std::exp(-std::hypot(x, y / cosine) / 0.2);
      squares += std::pow(image.at(i, j) / column - 1, 2);
    }
  }
  EXPECT_LT(std::sqrt(squares / (size * size)), 2.5e-4);
}

TEST(AnalyticTest, DiskEdgeOn) {
  TextScene text;
  text.galaxies["disk"] = thin_disk;
  text.scene = "galaxy x y z inclination pa\ndisk 0 0 0 90 90\n";
  // Pixels are a fifth of a scale length wide, which is a scale height.
  text.parameters = view_from_z(31, 31, 31 * 0.2 * length);
  const Image image = render_text(text);
  for (int y : {13, 14, 15, 16, 17}) {
    for (int x = 0; x < 31; ++x) {
      const double r = 0.2 * std::abs(x - 15);  // in scale lengths
      const double z = 0.2 * length * (y - 15) / height;
      const double sech = 1 / std::cosh(z);
      const double expected =
          2 * length * (r > 0 ? r * std::cyl_bessel_k(1.0, r) : 1.0) * sech * sech;
      EXPECT_NEAR(image.at(x, y) / expected, 1, tolerance) << x << ' ' << y;
    }
  }
}

TEST(AnalyticTest, DeVaucouleursBulge) {
  TextScene text;
  constexpr double effective_radius = 0.005;
  text.galaxies["bulge"] =
      "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.005\n"
      "intensity = 1e6\n";
  text.scene = "galaxy x y z\nbulge 0 0 0\n";
  const auto surface_brightness = [&](double radius) {
    // The pixels about the cusp hold means, and are left out.
    text.parameters = view_from_z(5, 1, 2.5 * radius * effective_radius);
    return render_text(text).at(4, 0);
  };
  const double scale = surface_brightness(1);
  // docs/facts.md section 5: R/R_e, Sigma/Sigma(R_e).
  const double table[][2] = {{.001, 609.54}, {.003, 384.24}, {.01, 198.81},
                             {.03, 90.462},  {.1, 29.009},   {.3, 7.3584},
                             {3, .088915},   {10, .0025957}, {20, .00019844}};
  for (const auto& row : table) {
    const double ratio = surface_brightness(row[0]) / scale / row[1];
    EXPECT_NEAR(ratio, 1, tolerance) << "R/R_e = " << row[0];
  }
}

TEST(AnalyticTest, BulgeThroughItsCentreIsFinite) {
  TextScene text;
  text.galaxies["bulge"] =
      "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\nradius = 1e-5\nintensity = 1\n";
  text.scene = "galaxy x y z\nbulge 0 0 0\n";
  // A pixel that is small beside the softening, 3.4e-7 galaxy radii.
  text.parameters = view_from_z(1, 1, 1e-9);
  // 2 r0 int_0^inf b^-0.855 exp(-b^(1/4)) ds, b^2 = s^2 + epsilon^2, s = epsilon sinh(u).
  const double softening = 1e-5 * 3434.12;
  double sum = 0;
  for (double u = 0.0005; u < 20; u += 0.001) {
    const double b = softening * std::cosh(u);
    sum += 0.001 * std::pow(b, 0.145) * std::exp(-std::pow(b, 0.25));
  }
  EXPECT_NEAR(render_text(text).at(0, 0) / (2e-5 * sum), 1, tolerance);
}

constexpr const char* dust_sheet = R"(
[[component]]
class = "dust"
z0 = 0.01
rh = 0.05
arm_width = 0
optical_depth = 2
noise = false
)";

TEST(AnalyticTest, DustDimsTheLightBehind) {
  TextScene text;
  text.galaxies["light"] = thin_disk;
  text.galaxies["dust"] = dust_sheet;
  const std::string wavelengths = "[spectrum]\nwavelengths = [3600, 5494.505, 9000]\n";
  text.parameters = view_from_z(5, 1, 5 * length, wavelengths);
  text.scene = "galaxy x y z\nlight 0 0 0\n";
  const Image clear = render_text(text);
  text.scene = "galaxy x y z\nlight 0 0 0\ndust 0 0 3\n";
  const Image dimmed = render_text(text);
  text.scene = "galaxy x y z\nlight 0 0 0\ndust 0 0 -3\n";
  const Image in_front = render_text(text);
  const Ccm89 curve(3.1);
  const double lambda[] = {3600, 5494.505, 9000};
  for (int w = 0; w < 3; ++w) {
    for (int x = 0; x < 5; ++x) {
      const double tau = 2 * std::exp(-std::abs(x - 2.0)) * curve.relative(lambda[w]);
      EXPECT_NEAR(dimmed.at(x, 0, w) / (clear.at(x, 0, w) * std::exp(-tau)), 1, tolerance);
      EXPECT_NEAR(in_front.at(x, 0, w) / clear.at(x, 0, w), 1, 1e-5);
    }
  }
}

TEST(AnalyticTest, MixedSlab) {
  TextScene text;
  text.galaxies["slab"] = std::string(thin_disk) + dust_sheet;
  text.scene = "galaxy x y z\nslab 0 0 0\n";
  const std::string wavelengths = "[spectrum]\nwavelengths = [3600, 5494.505, 9000]\n";
  text.parameters = view_from_z(5, 1, 5 * length, wavelengths);
  const Image image = render_text(text);
  const Ccm89 curve(3.1);
  const double lambda[] = {3600, 5494.505, 9000};
  for (int w = 0; w < 3; ++w) {
    const double a = curve.relative(lambda[w]);
    const double source = 1 / (2 / (2 * height) * a);  // S = j/kappa
    for (int x = 0; x < 5; ++x) {
      const double tau = 2 * std::exp(-std::abs(x - 2.0)) * a;
      EXPECT_NEAR(image.at(x, 0, w) / (source * -std::expm1(-tau)), 1, tolerance) << w << ' ' << x;
    }
  }
}

TEST(AnalyticTest, OpaqueSlab) {
  TextScene text;
  std::string opaque = dust_sheet;
  opaque.replace(opaque.find("optical_depth = 2"), 17, "optical_depth = 1000");
  text.galaxies["slab"] = std::string(thin_disk) + opaque;
  text.scene = "galaxy x y z\nslab 0 0 0\n";
  text.parameters = view_from_z(1, 1, length, "[spectrum]\nwavelengths = [5494.505]\n");
  // tau = 1000: S alone remains.
  EXPECT_NEAR(render_text(text).at(0, 0) / (2 * height / 1000), 1, tolerance);
}

TEST(AnalyticTest, CameraInsideSeesHalf) {
  TextScene text;
  text.galaxies["disk"] = thin_disk;
  text.scene = "galaxy x y z\ndisk 0 0 0\n";
  text.parameters =
      "[image]\nsize = 1\n[camera]\nposition = [0.05, 0, 0]\ntarget = [0.05, 0, 1]\n"
      "up = [0, 1, 0]\nfov = 1\n";
  EXPECT_NEAR(render_text(text).at(0, 0) / (height * std::exp(-1.0)), 1, tolerance);
}

TEST(AnalyticTest, BrightnessDoesNotDependOnSizeOrDistance) {
  TextScene text;
  text.galaxies["disk"] = thin_disk;
  text.scene = "galaxy x y z size\ndisk 0 0 0 1e-3\n";
  text.parameters = view_from_z(1, 1, 1e-5);
  EXPECT_NEAR(render_text(text).at(0, 0) / (2 * height), 1, tolerance);
  text.scene = "galaxy x y z size\ndisk 1e6 0 0 1e3\n";
  text.parameters =
      "[image]\nsize = 1\n[camera]\nposition = [1e6, 0, 1e7]\ntarget = [1e6, 0, 0]\n"
      "up = [0, 1, 0]\nfov = 1e-6\n";
  EXPECT_NEAR(render_text(text).at(0, 0) / (2 * height), 1, tolerance);
}

class TotalFluxTest : public testing::TestWithParam<const char*> {};

TEST_P(TotalFluxTest, IsTheLuminosityFromAnySide) {
  TextScene text;
  text.galaxies["galaxy"] = R"(
[arms]
model = "logarithmic"
pitch_angle = 20
count = 3
[[component]]
class = "bulge"
sed = "flat"
effective_radius = 0.15
axis = [1, 0.8, 0.6]
fraction = 0.3
[[component]]
class = "disk"
sed = "flat"
z0 = 0.02
rh = 0.1
arm_width = 3
inner = 0.05
fraction = 0.7
noise = false
)";
  text.scene = std::string("galaxy x y z ox oy oz pa\ngalaxy 0 0 0 ") + GetParam() + "\n";
  constexpr int size = 97;
  constexpr double width = 2.02;
  text.parameters = view_from_z(size, size, width) + "supersample = 8\n";
  const double pixel = width / size;
  // Fractions of a galaxy without intensities: the total is 1.
  EXPECT_NEAR(sum_of(render_text(text)) * pixel * pixel, 1, promised);
}

INSTANTIATE_TEST_SUITE_P(Analytic, TotalFluxTest,
                         testing::Values("0 0 1 0", "1 0 0.7 20", "1 1 0.2 -50", "0 1 0 90",
                                         "0.3 -0.5 -1 10"));

TEST(OverlapTest, OrderOfRowsDoesNotMatter) {
  TextScene text;
  text.galaxies["a"] = std::string(thin_disk) + dust_sheet;
  std::string other = thin_disk;
  other.replace(other.find("\"flat\""), 6, "\"blackbody(4000 K)\"");
  text.galaxies["b"] = other + dust_sheet;
  text.parameters = view_from_z(33, 33, 0.6, "[spectrum]\nwavelengths = [4400, 7000]\n");
  // Three that pass through each other.
  const std::string rows[] = {"a 0 0 0 1 0 0.2\n", "b 0.02 0 0.01 0.2 1 0.4\n",
                              "a -0.03 0.02 -0.02 0 0.3 1\n"};
  const std::string head = "galaxy x y z ox oy oz\n";
  text.scene = head + rows[0] + rows[1] + rows[2];
  const Image first = render_text(text);
  text.scene = head + rows[2] + rows[0] + rows[1];
  const Image second = render_text(text);
  for (int w = 0; w < 2; ++w) {
    for (int y = 0; y < 33; ++y) {
      for (int x = 0; x < 33; ++x) EXPECT_EQ(first.at(x, y, w), second.at(x, y, w));
    }
  }
}

TEST(OverlapTest, InterleavedGalaxiesAreOneSlab) {
  // Light and dust as two galaxies in one place must equal the mixed slab.
  TextScene text;
  text.galaxies["light"] = thin_disk;
  text.galaxies["dust"] = dust_sheet;
  text.scene = "galaxy x y z\nlight 0 0 0\ndust 0 0 0\n";
  text.parameters = view_from_z(5, 1, 5 * length, "[spectrum]\nwavelengths = [5494.505]\n");
  const Image image = render_text(text);
  const double source = height;  // S = j/kappa, kappa = tau_V/(2 z0)
  for (int x = 0; x < 5; ++x) {
    const double tau = 2 * std::exp(-std::abs(x - 2.0));
    EXPECT_NEAR(image.at(x, 0) / (source * -std::expm1(-tau)), 1, tolerance);
  }
}

TEST(OverlapTest, DustDimsBlueMoreThanRedByTheExtinctionLaw) {
  TextScene text;
  text.galaxies["back"] = thin_disk;
  text.galaxies["front"] = dust_sheet;
  text.parameters = view_from_z(5, 1, 5 * length, "[spectrum]\nwavelengths = [4400, 7000]\n");
  text.scene = "galaxy x y z\nback 0 0 0\n";
  const Image clear = render_text(text);
  text.scene = "galaxy x y z\nfront 0 0 2.5\nback 0 0 0\n";
  const Image dimmed = render_text(text);
  // docs/facts.md section 1: A(4400)/A(V) = 1.32452, A(7000)/A(V) = 0.75017.
  for (int x = 0; x < 5; ++x) {
    const double blue = std::log(clear.at(x, 0, 0) / dimmed.at(x, 0, 0));
    const double red = std::log(clear.at(x, 0, 1) / dimmed.at(x, 0, 1));
    EXPECT_NEAR(blue / red, 1.32452 / 0.75017, 2e-4);
  }
}

TEST(UniformSamplerTest, ErrorFallsWithTheSquareOfTheStep) {
  TextScene text;
  text.galaxies["slab"] = std::string(thin_disk) + dust_sheet;
  text.scene = "galaxy x y z inclination pa\nslab 0 0 0 40 30\n";
  const auto render = [&](const std::string& sampling) {
    text.parameters = view_from_z(5, 5, 5 * length, "[sampling]\n" + sampling);
    return render_text(text);
  };
  const Image exact = render("tolerance = 1e-6\n");
  const auto error = [&](double step) {
    const Image image = render("sampler = \"uniform\"\nstep = " + std::to_string(step) + "\n");
    double sum = 0;
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 5; ++x) {
        sum += std::pow(image.at(x, y) / exact.at(x, y) - 1, 2);
      }
    }
    return std::sqrt(sum / 25);
  };
  const double coarse = error(0.004), middle = error(0.002), fine = error(0.001);
  EXPECT_NEAR(std::log2(coarse / middle), 2, 0.25);
  EXPECT_NEAR(std::log2(middle / fine), 2, 0.1);
}

TEST(ViewTest, PerspectiveAndOrthographicAgreeFarAway) {
  TextScene text;
  text.galaxies["disk"] = std::string(thin_disk) + dust_sheet;
  text.scene = "galaxy x y z inclination pa\ndisk 0 0 0 50 20\n";
  text.parameters = view_from_z(9, 9, 0.4);
  const Image flat = render_text(text);
  // 2 atan(0.2 / 1e5) in degrees.
  text.parameters =
      "[image]\nsize = 9\n[camera]\nposition = [0, 0, 1e5]\nup = [0, 1, 0]\n"
      "fov = 2.2918311805e-4\n";
  const Image deep = render_text(text);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 9; ++x) EXPECT_NEAR(deep.at(x, y) / flat.at(x, y), 1, 3e-4);
  }
}

TEST(IntensityTest, LeastIntensityInTheLargestGalaxy) {
  TextScene text;
  const auto render = [&](const std::string& intensity, double radius) {
    text.galaxies["two"] = "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\nradius = 0.1\n" +
                           intensity + "[[component]]\nclass = \"disk\"\nsed = \"flat\"\n" +
                           "z0 = 0.02\nrh = 0.15\nnoise = false\n" + intensity;
    text.scene = fmt::format("galaxy x y z size inclination pa\ntwo 0 0 0 {} 50 20\n", radius);
    text.parameters = fmt::format(
        "[image]\nsize = 15\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, {}]\n"
        "up = [0, 1, 0]\nwidth = {}\n",
        2 * radius, 2 * radius);
    return render_text(text);
  };
  const Image usual = render("intensity = 1\n", 1), least = render("intensity = 1e-12\n", 1e15);
  double peak = 0, faintest = HUGE_VAL;
  for (int y = 0; y < 15; ++y) {
    for (int x = 0; x < 15; ++x) {
      if (usual.at(x, y) == 0) continue;
      EXPECT_NEAR(least.at(x, y) * 1e12 / usual.at(x, y), 1, 2.4e-6) << x << ' ' << y;
      peak = std::max(peak, usual.at(x, y));
      faintest = std::min(faintest, usual.at(x, y));
    }
  }
  EXPECT_LT(faintest, 1e-4 * peak);
}

}  // namespace
}  // namespace gamer::analytic_test
