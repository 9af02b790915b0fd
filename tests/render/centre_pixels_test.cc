// Bulges have a cusp. Their images hold their light for any pixels and camera.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "render/render_text.h"

namespace gamer::centre_pixels_test {
namespace {

std::string bulge(const char* axis) {
  return std::string(
             "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.2\n"
             "axis = ") +
         axis + "\n";
}

TEST(CentrePixelsTest, OneRayAPixelHoldsTheLightOfACusp) {
  // The centre is in the middle of a pixel for odd sizes, and at the corner of four pixels for even
  // sizes.
  TextScene text;
  text.galaxies["bulge"] = bulge("[1, 1, 1]");
  text.scene = "galaxy x y z\nbulge 0 0 0\n";
  const auto light = [&](int size) {
    text.parameters = view_from_z(size, size, 2);
    return sum_of(render_text(text)) * std::pow(2.0 / size, 2);
  };
  const double exact = light(512);
  EXPECT_NEAR(light(64) / exact, 1, 0.012);
  EXPECT_NEAR(light(65) / exact, 1, 0.012);
  EXPECT_NEAR(light(257) / exact, 1, 0.002);
}

TEST(CentrePixelsTest, FluxOfStretchedBulgesIsThatAskedFor) {
  TextScene text;
  text.parameters =
      "[image]\nsize = 64\n[camera]\nprojection = \"sky\"\ncenter = [10, 20]\n"
      "pixel_scale = 0.2\n[spectrum]\nbands = [\"sdss_r\"]\n";
  for (const char* axis : {"[1, 1, 1]", "[1, 0.03, 1]", "[10, 0.01, 1]"}) {
    text.galaxies["bulge"] = bulge(axis);
    for (const char* inclination : {"0", "40", "85"}) {
      text.scene = std::string(
                       "galaxy px py redshift size_arcsec apparent_magnitude inclination pa\n"
                       "bulge 32.5 32.5 0.1 5 20 ") +
                   inclination + " 30\n";
      const double asked = 3631e9 * std::pow(10, -0.4 * 20);
      EXPECT_NEAR(sum_of(render_text(text)) / asked, 1, 3e-4) << axis << " at " << inclination;
    }
  }
}

}  // namespace
}  // namespace gamer::centre_pixels_test
