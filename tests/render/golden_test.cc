// A few rendered numbers are stored here, so that a change of the renderer that moves them is
// noticed.
//
// Origin: M100 (scenes/ngc4321) at 4 x 4 pixels, tolerance 1e-5, as this test prints it when
// GAMER_PRINT_GOLDEN is set; first written with the analytic, order and tolerance tests passing.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "gamer/job/job.h"
#include "gamer/job/schedule.h"
#include "render/render_text.h"

namespace gamer::golden_test {
namespace {

TEST(GoldenTest, M100) {
  const std::filesystem::path source(GAMER_TEST_SOURCE_DIR);
  JobRequest request;
  request.parameters = source / "scenes/ngc4321.par";
  request.scene = source / "scenes/ngc4321.lst";
  request.settings = {"image.size=4", "sampling.tolerance=1e-5"};
  Resources resources({source});
  const RenderJob job = load_job(request, resources);
  const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
  ThreadExecutor executor(1);
  const Image image = render_image(renderer, executor);
  std::vector<double> values;
  for (int plane = 0; plane < image.planes(); ++plane) {
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) values.push_back(image.at(x, y, plane));
    }
  }
  const std::filesystem::path golden = source / "tests/render/golden/ngc4321.txt";
  if (std::getenv("GAMER_PRINT_GOLDEN") != nullptr) {
    for (const double value : values) std::printf("%.9g\n", value);
    GTEST_SKIP() << "printed, not compared";
  }
  std::ifstream file(golden);
  std::vector<double> expected;
  for (double value = 0; file >> value;) expected.push_back(value);
  ASSERT_EQ(expected.size(), values.size()) << golden;
  const double peak = *std::max_element(expected.begin(), expected.end());
  for (std::size_t i = 0; i < values.size(); ++i) {
    // Pixels of other instruction sets differ by rounding, and by where panels were halved.
    EXPECT_NEAR(values[i], expected[i], 1e-4 * std::max(expected[i], 0.01 * peak)) << i;
  }
}

}  // namespace
}  // namespace gamer::golden_test
