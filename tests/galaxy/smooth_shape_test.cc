#include "gamer/galaxy/kinds/smooth_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "new_component/gaussian.h"

namespace gamer::smooth_shape_test {
namespace {

// The tests of this program that cover all kinds cover this one, too.
const bool is_registered = [] {
  register_component_kind(gaussian_kind());
  return true;
}();

TEST(SmoothShape, QuadratureOfAGaussian) {
  EXPECT_TRUE(is_registered);
  for (const double sigma : {0.02, 0.1, 0.15}) {
    for (const double q : {0.1, 1.0}) {
      const SmoothShape shape(
          [=](double x, double y, double z) {
            return std::exp(-(x * x + y * y + z * z / (q * q)) / (2 * sigma * sigma));
          },
          sigma * q);
      const double line = sigma * std::sqrt(2 * std::numbers::pi);
      EXPECT_NEAR(shape.face_on_column() / (line * q), 1, 1e-6);
      EXPECT_NEAR(shape.envelope_integral() / (std::pow(line, 3) * q), 1, 1e-5);
    }
  }
}

TEST(SmoothShape, ScaleIsALengthInTheBall) {
  const auto one = [](double, double, double) { return 1.0; };
  for (const double scale : {0.0, -1.0, 1.1, HUGE_VAL, std::nan("")}) {
    EXPECT_THROW(SmoothShape(one, scale), std::invalid_argument);
  }
}

TEST(ComponentKinds, AreRegisteredOnce) {
  EXPECT_THROW(register_component_kind(gaussian_kind()), std::invalid_argument);
  EXPECT_EQ(component_kinds().back().name, "gaussian");
}

}  // namespace
}  // namespace gamer::smooth_shape_test
