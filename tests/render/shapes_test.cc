// Bars, rings, breaks, flares and boxes: rays converge, and pixels of any size add up to their
// light.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "render/galaxy_rays.h"
#include "render/render_text.h"

namespace gamer::shapes_test {
namespace {

struct Shape {
  const char* name;
  std::string text;
};

std::string component(const std::string& kind, const std::string& keys) {
  return "[[component]]\nclass = \"" + kind + "\"\n" +
         (kind == "dust" ? "" : "sed = \"flat_fnu\"\n") +
         (kind == "sersic" || kind == "bar" ? "" : "noise = false\narm_width = 0\n") + keys;
}

std::vector<Shape> shapes() {
  return {
      {"flat_bar", component("bar", "decline = 0\ncut = 0.04\n")},
      {"peanut", component("bar", "index = 1\npeanut = 3\nz0 = 0.012\nansae = 1.5\n")},
      {"thin_box", component("bar",
                             "axis_ratio = 0.15\nboxiness = 4\nz0 = 0.004\ncut = 0.02\n"
                             "decline = 4\nhalf_length = 0.15\n")},
      {"ring",
       component("disk", "ring_radius = 0.5\nring_width = 0.03\nring_outer_width = 0.08\n")},
      {"nuclear_ring",
       component("disk",
                 "ring_radius = 0.04\nring_width = 0.006\nz0 = 0.005\naxis_ratio = 0.7\n"
                 "position_angle = 30\n")},
      {"thin_ring", component("disk", "ring_radius = 0.6\nring_width = 0.004\nz0 = 0.003\n")},
      {"down", component("disk",
                         "rh = 0.15\nbreak_radius = 0.4\nouter_rh = 0.05\n"
                         "break_sharpness = 100\nz0 = 0.01\n")},
      {"up", component("disk", "rh = 0.07\nbreak_radius = 0.3\nouter_rh = 0.2\nz0 = 0.01\n")},
      {"flare", component("disk", "flare = 3\nlopsidedness = 0.6\nz0 = 0.01\n")},
      {"warp", component("disk", "rh = 0.3\nz0 = 0.01\nwarp_height = 0.4\nwarp_begin = 0.2\n")},
      {"twisted_warp", component("disk",
                                 "rh = 0.3\nz0 = 0.006\nwarp_height = 0.5\nwarp_twist = 250\n"
                                 "warp_power = 1.5\nlopsidedness = 0.5\n")},
      {"tilt", component("disk", "z0 = 0.005\nwarp_height = 0.6\nwarp_power = 1\n")},
      {"warped_ring", component("disk",
                                "ring_radius = 0.5\nring_width = 0.05\nz0 = 0.008\n"
                                "warp_height = 0.6\nwarp_power = 1.2\nwarp_twist = 100\n")},
      {"box", component("sersic",
                        "effective_radius = 0.1\nindex = 2\nboxiness = 3.5\n"
                        "axis = [1, 1, 0.6]\n")},
      {"dust_ring", component("disk", "rh = 0.2\nz0 = 0.03\n") +
                        component("dust",
                                  "ring_radius = 0.4\nring_width = 0.03\nz0 = 0.008\n"
                                  "optical_depth = 3\n")},
      {"warped_dust", component("disk", "rh = 0.2\nz0 = 0.03\n") +
                          component("dust",
                                    "rh = 0.3\nz0 = 0.008\noptical_depth = 2\n"
                                    "warp_height = 0.5\nwarp_begin = 0.1\nwarp_twist = 150\n")},
  };
}

TEST(Shapes, RaysKeepTheTolerance) {
  for (const Shape& shape : shapes()) {
    for (const double inclination : {0.0, 60.0, 85.0, 89.0, 90.0}) {
      const GalaxyRays view(
          Resources::from_record({{"galaxies/own", "own.toml", shape.text}}),
          fmt::format("galaxy x y z inclination pa seed\nown 0 0 0 {} 90 1\n", inclination),
          inclination, 40);
      const std::vector<double> exact = view.uniform(1e5);
      for (const double tolerance : {1e-2, 1e-3, 1e-4, 3e-6}) {
        RenderCounts counts;
        const double error = view.rms_error(view.adaptive(tolerance, counts), exact);
        EXPECT_LT(error, std::max(tolerance, 5e-6)) << shape.name << ", " << inclination;
        EXPECT_EQ(counts.unconverged_rays, 0u) << shape.name << ", " << inclination;
        std::printf("%-12s %g degrees, tolerance %g: rms error %.2e\n", shape.name, inclination,
                    tolerance, error);
      }
    }
  }
}

/// The flux of a galaxy of 1 nJy without its dust, in an image of `size` x `size` pixels.
double flux_of(const std::string& galaxy, int size, double inclination) {
  TextScene text;
  text.galaxies["own"] = galaxy;
  text.scene = fmt::format("galaxy x y z inclination pa apparent_magnitude\nown 0 0 0 {} 20 31.4\n",
                           inclination);
  text.parameters =
      view_from_z(size, size, 2.2, "[photometry]\nattenuated = false\n[scene]\nunit = \"kpc\"\n");
  return sum_of(render_text(text));
}

TEST(Shapes, PixelsAddUpToTheLight) {
  for (const Shape& shape : shapes()) {
    if (shape.text.find("\"dust\"") != std::string::npos) continue;
    for (const double inclination : {0.0, 60.0, 88.0}) {
      for (const int size : {6, 30, 90}) {
        const double flux = flux_of(shape.text, size, inclination);
        // 31.4 mag are 1.00 nJy: 3631e9 10^(-12.56).
        EXPECT_NEAR(flux / (3631e9 * std::pow(10, -0.4 * 31.4)), 1, 5e-4)
            << shape.name << ", " << inclination << " degrees, " << size << " pixels";
        std::printf("%-12s %g degrees, %d pixels: %+.1e\n", shape.name, inclination, size,
                    flux / (3631e9 * std::pow(10, -0.4 * 31.4)) - 1);
      }
    }
  }
}

}  // namespace
}  // namespace gamer::shapes_test
