#include "processing/rotate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "image/synthetic_image.h"
#include "processing/geometry.h"

namespace gamer::rotate_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN(),
                 degree = std::numbers::pi / 180;

const std::vector<Kernel> kernels = {Kernel::nearest, Kernel::bilinear, Kernel::bicubic,
                                     Kernel::lanczos3, Kernel::lanczos5};

/// A bulge and a disk as a camera sees them, with no feature sharper than sigma = 1.6 pixels, FWHM
/// 3.8.
std::vector<Gaussian> galaxy() {
  return {{61.3, 57.2, 1.6, 1.6, 0, 10}, {61.3, 57.2, 9, 4, 35, 1}, {50.7, 70.1, 2.2, 1.7, 120, 2}};
}

TEST(Rotate, KeepsFlux) {
  const PlanePtr source = make_plane(131, 121, galaxy());
  const double flux = moments_of(evaluate(*source)).sum;
  std::map<Kernel, double> worst;
  // At 26.57 and 36.87 degrees the grids share points.
  std::vector<double> angles = {0.01, 1, 45, 89.5, 26.565051177077990, 36.869897645844021};
  for (double angle = -178; angle < 180; angle += 13.7) angles.push_back(angle);
  for (const Kernel kernel : kernels) {
    for (const double angle : angles) {
      const Image image = evaluate(*rotate(source, {angle, kernel, true, 0}), 2);
      worst[kernel] = std::max(worst[kernel], std::abs(moments_of(image).sum / flux - 1));
    }
    RecordProperty(kernel_names()[static_cast<std::size_t>(kernel)], std::to_string(worst[kernel]));
  }
  EXPECT_LT(worst[Kernel::nearest], 0.02);
  EXPECT_LT(worst[Kernel::bilinear], 1.5e-3);
  EXPECT_LT(worst[Kernel::bicubic], 1.5e-4);
  EXPECT_LT(worst[Kernel::lanczos3], 1e-4);
  EXPECT_LT(worst[Kernel::lanczos5], 7e-5);
}

TEST(Rotate, MultiplesOfARightAngleCopyPixels) {
  const PlanePtr source = noise_plane(37, 20);
  for (const Kernel kernel : kernels) {
    for (const bool full : {false, true}) {
      for (int quarters = -9; quarters <= 9; ++quarters) {
        const Rotation rotation = {90.0 * quarters, kernel, full, nan_value};
        const Image image = evaluate(*rotate(source, rotation));
        EXPECT_EQ(difference(image, evaluate(*quarter_turns(source, quarters))), 0);
        const PlaneSize size = rotated_size(37, 20, rotation);
        EXPECT_EQ(size, (PlaneSize{image.width(), image.height()}));
        EXPECT_EQ(rotation_map(37, 20, rotation)({3, 4}).x,
                  quarter_turns_map(37, 20, quarters)({3, 4}).x);
      }
    }
  }
  PlanePtr plane = source;
  for (int i = 0; i < 4; ++i) plane = rotate(plane, {90, Kernel::lanczos3, false, 0});
  EXPECT_EQ(difference(evaluate(*plane), evaluate(*source)), 0);
}

/// An image is turned and turned back; errors are relative to the peak.
TEST(Rotate, ThereAndBack) {
  const PlanePtr source = make_plane(121, 121, {{66.3, 55.2, 2, 2, 0, 1}});
  const Image old = evaluate(*source);
  const std::map<Kernel, double> bounds = {{Kernel::nearest, 0.35},
                                           {Kernel::bilinear, 0.1},
                                           {Kernel::bicubic, 0.015},
                                           {Kernel::lanczos3, 0.007},
                                           {Kernel::lanczos5, 0.006}};
  for (const auto& [kernel, bound] : bounds) {
    double worst = 0;
    for (const double angle : {1.0, 12.0, 33.0, 45.0, 70.0, 135.0, -100.0}) {
      const PlanePtr there = rotate(source, {angle, kernel, false, 0});
      const Image back = evaluate(*rotate(there, {-angle, kernel, false, 0}));
      worst = std::max(worst, difference(back, old));
    }
    EXPECT_LT(worst, bound);
    EXPECT_GT(worst, bound / 2);
  }
}

TEST(Rotate, EqualsTheTurnedGaussian) {
  constexpr int image_width = 140, image_height = 111;
  const Gaussian old = {83.4, 42.7, 5, 2.5, 20, 1};
  const PlanePtr source = make_plane(image_width, image_height, {old});
  const Moments before = moments_of(evaluate(*source));
  struct Errors {
    Kernel kernel;
    double value, place, angle, size;
  };
  for (const Errors& bound : {Errors{Kernel::nearest, 0.2, 0.3, 0.3, 1},
                              {Kernel::bilinear, 0.03, 5e-4, 0.04, 0.06},
                              {Kernel::bicubic, 0.002, 3e-5, 1e-3, 1e-3},
                              {Kernel::lanczos3, 0.0015, 3e-6, 5e-5, 4e-5},
                              {Kernel::lanczos5, 0.0012, 1.5e-5, 3e-4, 1.3e-4}}) {
    Errors worst = {bound.kernel, 0, 0, 0, 0};
    for (const double angle : {-3.0, 17.0, 40.0, 95.0, 163.0, -120.0}) {
      for (const bool full : {false, true}) {
        const Rotation rotation = {angle, bound.kernel, full, 0};
        const Image image = evaluate(*rotate(source, rotation));
        const double c = std::cos(angle * degree), s = std::sin(angle * degree);
        const double dx = old.x - (image_width - 1) / 2.0, dy = old.y - (image_height - 1) / 2.0;
        Gaussian turned = old;
        turned.x = (image.width() - 1) / 2.0 + c * dx - s * dy;
        turned.y = (image.height() - 1) / 2.0 + s * dx + c * dy;
        turned.angle += angle;
        const PlanePtr expected = make_plane(image.width(), image.height(), {turned});
        worst.value = std::max(worst.value, difference(image, evaluate(*expected)));
        const PixelPosition place =
            rotation_map(image_width, image_height, rotation)({old.x + 1, old.y + 1});
        EXPECT_NEAR(place.x, turned.x + 1, 1e-12);
        EXPECT_NEAR(place.y, turned.y + 1, 1e-12);
        const Moments after = moments_of(image);
        worst.place = std::max(worst.place,
                               std::hypot(after.centroid.x - place.x, after.centroid.y - place.y));
        worst.angle =
            std::max(worst.angle, std::abs(std::remainder(after.angle() - turned.angle, 180)));
        // The kernel of linear interpolation adds a variance of 1/6 along each axis.
        const double kernel_size = bound.kernel == Kernel::bilinear ? 2.0 / 6 : 0;
        worst.size = std::max(worst.size,
                              std::abs(after.xx + after.yy - before.xx - before.yy - kernel_size));
      }
    }
    SCOPED_TRACE(kernel_names()[static_cast<std::size_t>(bound.kernel)]);
    for (const double Errors::*error :
         {&Errors::value, &Errors::place, &Errors::angle, &Errors::size}) {
      EXPECT_LT(worst.*error, bound.*error);
      EXPECT_GT(worst.*error, bound.*error / 2);
    }
  }
}

/// Tables of kernels agree with the kernels.
TEST(Rotate, KernelTables) {
  const PlanePtr source = noise_plane(60, 50);
  const Image old = evaluate(*source);
  const double angle = 28.3, c = std::cos(angle * degree), s = std::sin(angle * degree);
  for (const Kernel kernel : kernels) {
    if (kernel == Kernel::nearest) continue;
    const Image image = evaluate(*rotate(source, {angle, kernel, false, 0}));
    const int radius = static_cast<int>(kernel_radius(kernel));
    double worst = 0;
    for (int y = 18; y < 32; ++y) {
      for (int x = 20; x < 40; ++x) {
        const double px = c * (x - 29.5) + s * (y - 24.5) + 29.5;
        const double py = c * (y - 24.5) - s * (x - 29.5) + 24.5;
        const int fx = static_cast<int>(px) - radius + 1, fy = static_cast<int>(py) - radius + 1;
        const auto wx = interpolation_weights(kernel, px, 1, fx, 2 * radius);
        const auto wy = interpolation_weights(kernel, py, 1, fy, 2 * radius);
        double sum = 0;
        for (int l = 0; l < 2 * radius; ++l) {
          for (int k = 0; k < 2 * radius; ++k) {
            sum += wx[static_cast<std::size_t>(k)] * wy[static_cast<std::size_t>(l)] *
                   old.at(fx + k, fy + l);
          }
        }
        worst = std::max(worst, std::abs(image.at(x, y) - sum));
      }
    }
    EXPECT_LT(worst, 1e-7);
  }
}

TEST(Rotate, EvenImagesStayEven) {
  const PlanePtr source = make_plane(50, 40, [](int, int) { return 3.0; });
  for (const Kernel kernel : kernels) {
    const Image image = evaluate(*rotate(source, {31, kernel, false, 0}));
    for (int x = 15; x < 35; ++x) EXPECT_NEAR(image.at(x, 20), 3, 1e-14);
    // Pixels outside count as the filled value.
    const Image filled = evaluate(*rotate(source, {31, kernel, true, 3}));
    EXPECT_LT(difference(filled, evaluate(*make_plane(filled.width(), filled.height(),
                                                      [](int, int) { return 3.0; }))),
              1e-13);
  }
}

TEST(Rotate, Canvas) {
  EXPECT_EQ(rotated_size(100, 50, {30, Kernel::bilinear, false, 0}), (PlaneSize{100, 50}));
  // 100 cos 30 + 50 sin 30 = 111.6, 100 sin 30 + 50 cos 30 = 93.3.
  EXPECT_EQ(rotated_size(100, 50, {30, Kernel::bilinear, true, 0}), (PlaneSize{112, 94}));
  EXPECT_EQ(rotated_size(100, 50, {-30, Kernel::bilinear, true, 0}), (PlaneSize{112, 94}));
  EXPECT_EQ(rotated_size(1, 1, {45, Kernel::bilinear, true, 0}), (PlaneSize{2, 2}));
  const PlanePtr source = make_plane(60, 30, [](int, int) { return 1.0; });
  const Image image = evaluate(*rotate(source, {30, Kernel::bilinear, true, nan_value}));
  int present = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (std::isnan(image.at(x, y))) continue;
      EXPECT_NEAR(image.at(x, y), 1, 1e-14);
      ++present;
    }
  }
  // The frame shrinks by up to half a pixel on each side.
  EXPECT_LE(present, 60 * 30);
  EXPECT_GE(present, 59 * 29);
  const Image one = evaluate(
      *rotate(make_plane(1, 1, [](int, int) { return 4.0; }), {45, Kernel::lanczos3, false, 0}));
  EXPECT_NEAR(one.at(0, 0), 4, 1e-15);
}

/// A pixel has equal bits whatever part of the image is computed.
TEST(Rotate, PartsAreTheWhole) {
  const PlanePtr plane = rotate(noise_plane(300, 290), {71, Kernel::bicubic, false, 0});
  const Image whole = evaluate(*plane, 3);
  for (const Area& area :
       {Area{0, 0, 300, 290}, {17, 31, 270, 3}, {299, 0, 1, 290}, {5, 5, 33, 33}}) {
    std::vector<double> out(static_cast<std::size_t>(area.width) * area.height);
    plane->read(area, out.data());
    for (int j = 0; j < area.height; ++j) {
      for (int i = 0; i < area.width; ++i) {
        ASSERT_EQ(out[static_cast<std::size_t>(j) * area.width + i],
                  whole.at(area.x + i, area.y + j));
      }
    }
  }
}

/// Missing pixels neither vanish nor spread beyond the kernel, and other pixels are right.
TEST(Rotate, MissingPixels) {
  const Gaussian light = {40, 40, 12, 12, 0, 1};
  for (const Kernel kernel : kernels) {
    for (int k = 0; k < 12; ++k) {
      const int hole_x = 30 + k, hole_y = 45 - 2 * k;
      const PlanePtr source = make_plane(81, 81, [&](int x, int y) {
        return x == hole_x && y == hole_y ? nan_value : light.at(x, y);
      });
      const Rotation rotation = {45 - 4.0 * k, kernel, false, 0};
      const Image image = evaluate(*rotate(source, rotation));
      const Image full = evaluate(*rotate(make_plane(81, 81, {light}), rotation));
      const PixelPosition hole = rotation_map(81, 81, rotation)({hole_x + 1.0, hole_y + 1.0});
      int missing = 0;
      for (int y = 0; y < 81; ++y) {
        for (int x = 0; x < 81; ++x) {
          const double distance = std::hypot(x + 1 - hole.x, y + 1 - hole.y);
          if (std::isnan(image.at(x, y))) {
            ++missing;
            EXPECT_LT(distance, 1.5);
          } else if (distance > kernel_radius(kernel) * std::numbers::sqrt2) {
            ASSERT_EQ(image.at(x, y), full.at(x, y));
          } else {
            EXPECT_NEAR(image.at(x, y), full.at(x, y), 0.05);
          }
        }
      }
      // The kernel of the nearest pixel may skip one missing pixel.
      EXPECT_GE(missing, kernel == Kernel::nearest ? 0 : 1);
      EXPECT_LE(missing, 5);
    }
  }
}

TEST(Rotate, Errors) {
  const PlanePtr source = noise_plane(4, 4);
  EXPECT_THROW(rotate(source, {10, Kernel::area, false, 0}), std::invalid_argument);
  EXPECT_THROW(rotate(source, {nan_value, Kernel::bilinear, false, 0}), std::invalid_argument);
  EXPECT_THROW(rotated_size(2000000000, 2000000000, {45, Kernel::bilinear, true, 0}),
               std::invalid_argument);
}

}  // namespace
}  // namespace gamer::rotate_test
