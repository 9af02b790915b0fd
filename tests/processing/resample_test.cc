#include "processing/resample.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "image/synthetic_image.h"

namespace gamer::resample_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

/// The kernels that keep flux exactly.
const std::vector<Kernel> exact = {Kernel::area, Kernel::bilinear, Kernel::bicubic,
                                   Kernel::lanczos3, Kernel::lanczos5};

PlanePtr row_plane(const std::vector<double>& values) {
  return std::make_shared<MemoryPlane>(static_cast<int>(values.size()), 1, values);
}

/// The flux of every input pixel is kept, even at the edges, in every grid.
TEST(Resample, KeepsTheFluxOfEveryPixel) {
  for (const Kernel kernel : exact) {
    for (const double factor : {0.07, 0.3, 0.5, 0.83, 1.0, 1.1, 2.0, 3.7}) {
      for (const int pixel : {0, 1, 5, 10, 19}) {
        std::vector<double> values(20);
        values[static_cast<std::size_t>(pixel)] = 1;
        const ResampleGrid grid = grid_of_factor(20, 1, factor);
        const Image image = evaluate(*resample(row_plane(values), grid, kernel, PixelValues::flux));
        EXPECT_NEAR(moments_of(image).sum, 1, 2e-14) << factor << ' ' << pixel;
      }
    }
  }
  const PlanePtr noise = noise_plane(53, 41);
  const double flux = moments_of(evaluate(*noise)).sum;
  for (const Kernel kernel : exact) {
    const Image image =
        evaluate(*resample(noise, grid_of_size(53, 41, 31, 77), kernel, PixelValues::flux));
    EXPECT_NEAR(moments_of(image).sum / flux, 1, 1e-14);
  }
}

TEST(Resample, EvenImagesStayEven) {
  const PlanePtr source = make_plane(23, 17, [](int, int) { return 2.0; });
  for (const std::string& name : kernel_names()) {
    for (const double factor : {0.11, 0.4, 0.9, 1.0, 1.6, 4.0}) {
      const ResampleGrid grid = grid_of_factor(23, 17, factor);
      const Image mean =
          evaluate(*resample(source, grid, kernel_of(name), PixelValues::brightness));
      const Image flux = evaluate(*resample(source, grid, kernel_of(name), PixelValues::flux));
      for (int y = 0; y < grid.height; ++y) {
        for (int x = 0; x < grid.width; ++x) {
          ASSERT_NEAR(mean.at(x, y), 2, 5e-14);
          // The outermost pixels hold the light of their part within the image.
          const auto length = [](int i, double first, double step, int size) {
            return std::min(first + (i + 1) * step, static_cast<double>(size)) -
                   std::max(first + i * step, 0.0);
          };
          const double area =
              length(x, grid.first_x, grid.step_x, 23) * length(y, grid.first_y, grid.step_y, 17);
          ASSERT_NEAR(flux.at(x, y), 2 * area, 1e-13 * area + 1e-14);
        }
      }
    }
  }
}

TEST(Resample, AFactorOfOneChangesNothing) {
  const PlanePtr source = noise_plane(40, 30);
  for (const Kernel kernel :
       {Kernel::nearest, Kernel::area, Kernel::bicubic, Kernel::lanczos3, Kernel::lanczos5}) {
    const Image image =
        evaluate(*resample(source, grid_of_factor(40, 30, 1), kernel, PixelValues::flux));
    EXPECT_LT(difference(image, evaluate(*source)), 1e-14);
  }
}

TEST(Resample, AreaIsTheOverlap) {
  const PlanePtr source = noise_plane(19, 14);
  const Image old = evaluate(*source);
  const ResampleGrid grid = grid_of_factor(19, 14, 0.37);
  const Image image = evaluate(*resample(source, grid, Kernel::area, PixelValues::flux));
  const auto overlap = [](double a1, double a2, double b1, double b2) {
    return std::max(0.0, std::min(a2, b2) - std::max(a1, b1));
  };
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      double sum = 0;
      const double left = grid.first_x + x * grid.step_x, low = grid.first_y + y * grid.step_y;
      for (int j = 0; j < 14; ++j) {
        for (int i = 0; i < 19; ++i) {
          sum += overlap(left, left + grid.step_x, i, i + 1) *
                 overlap(low, low + grid.step_y, j, j + 1) * old.at(i, j);
        }
      }
      EXPECT_NEAR(image.at(x, y), sum, 1e-14);
    }
  }
  // Merging two by two pixels equals bin().
  const PlanePtr even = noise_plane(20, 14);
  EXPECT_LT(difference(evaluate(*resample(even, grid_of_factor(20, 14, 0.5), Kernel::area,
                                          PixelValues::flux)),
                       evaluate(*bin(even, 2, 2, PixelValues::flux))),
            4e-15);
}

/// The mean of cos(2 pi f x) over [a, b].
double mean_wave(double f, double a, double b) {
  const double turn = 2 * std::numbers::pi * f;
  return (std::sin(turn * b) - std::sin(turn * a)) / (turn * (b - a));
}

/// The largest error, away from the edges, of a wave with `cycles` cycles per larger pixel.
double wave_error(Kernel kernel, int from, int to, double cycles, bool is_unseen = false) {
  const double step = static_cast<double>(from) / to, f = cycles / std::max(1.0, step);
  std::vector<double> values;
  for (int x = 0; x < from; ++x) values.push_back(mean_wave(f, x, x + 1));
  const Image image = evaluate(
      *resample(row_plane(values), grid_of_size(from, 1, to, 1), kernel, PixelValues::brightness));
  double worst = 0;
  for (int x = to / 4; x < to * 3 / 4; ++x) {
    const double expected = is_unseen ? 0 : mean_wave(f, x * step, (x + 1) * step);
    worst = std::max(worst, std::abs(image.at(x, 0) - expected));
  }
  return worst;
}

/// The mean of a wave over a pixel is known. Bounds are for 600 pixels to 780, 600 and 170.
TEST(Resample, WavesAreTheirMeansOverPixels) {
  struct Case {
    Kernel kernel;
    int to;
    double at_tenth, at_fifth;
  };
  for (const Case& c : {Case{Kernel::area, 780, 0.08, 0.22},
                        {Kernel::bilinear, 780, 0.06, 0.21},
                        {Kernel::bicubic, 780, 0.013, 0.09},
                        {Kernel::lanczos3, 780, 0.005, 0.015},
                        {Kernel::lanczos5, 780, 0.005, 0.023},
                        {Kernel::lanczos3, 600, 1e-14, 1e-14},
                        {Kernel::area, 170, 0.006, 0.015},
                        {Kernel::bicubic, 170, 0.002, 0.03},
                        {Kernel::lanczos3, 170, 0.0018, 0.013},
                        {Kernel::lanczos5, 170, 0.0016, 0.0012}}) {
    const double tenth = wave_error(c.kernel, 600, c.to, 0.1);
    const double fifth = wave_error(c.kernel, 600, c.to, 0.2);
    EXPECT_LT(tenth, c.at_tenth);
    EXPECT_LT(fifth, c.at_fifth);
    if (c.to == 600) continue;
    EXPECT_GT(tenth, c.at_tenth / 2);
    EXPECT_GT(fifth, c.at_fifth / 2);
  }
}

/// Waves that the larger pixels cannot show vanish, and do not appear as other waves.
TEST(Resample, NothingAliases) {
  for (const double cycles : {0.75, 0.9, 1.1, 1.4}) {
    EXPECT_LT(wave_error(Kernel::lanczos3, 600, 170, cycles, true), 0.01) << cycles;
    EXPECT_LT(wave_error(Kernel::lanczos5, 600, 170, cycles, true), 0.01) << cycles;
  }
  EXPECT_GT(wave_error(Kernel::area, 600, 170, 0.75, true), 0.2);
}

TEST(Resample, PlacesFollow) {
  const Gaussian old = {33.4, 21.7, 4, 3, 20, 1};
  const PlanePtr source = make_plane(71, 50, {old});
  const Moments before = moments_of(evaluate(*source));
  for (const Kernel kernel : exact) {
    for (const ResampleGrid& grid : {grid_of_factor(71, 50, 0.41), grid_of_factor(71, 50, 1.63),
                                     grid_of_size(71, 50, 90, 30)}) {
      const Image image = evaluate(*resample(source, grid, kernel, PixelValues::flux));
      const PixelPosition place = resample_map(grid)(before.centroid);
      const PixelPosition centroid = moments_of(image).centroid;
      EXPECT_NEAR(centroid.x, place.x, 1e-3);
      EXPECT_NEAR(centroid.y, place.y, 1e-3);
    }
  }
}

TEST(Resample, Grids) {
  const ResampleGrid third = grid_of_factor(10, 9, 1 / 3.0);
  EXPECT_EQ(third.width, 4);
  EXPECT_EQ(third.height, 3);
  EXPECT_DOUBLE_EQ(third.first_x, -1);
  EXPECT_NEAR(third.first_y, 0, 1e-15);
  EXPECT_EQ(grid_of_factor(1, 1, 1e-5).width, 1);
  EXPECT_EQ(grid_of_factor(1, 1, 4).width, 4);
  EXPECT_THROW(grid_of_factor(1, 1, 0), std::invalid_argument);
  EXPECT_THROW(grid_of_factor(1, 1, nan_value), std::invalid_argument);
  EXPECT_THROW(grid_of_factor(1000, 1, 1e9), std::invalid_argument);
  EXPECT_THROW(grid_of_size(4, 4, 0, 1), std::invalid_argument);
  // An image of one pixel is enlarged, and an image is reduced to one pixel.
  for (const std::string& name : kernel_names()) {
    const Kernel kernel = kernel_of(name);
    const Image many =
        evaluate(*resample(row_plane({6}), grid_of_size(1, 1, 3, 2), kernel, PixelValues::flux));
    EXPECT_NEAR(many.at(1, 1), 1, 1e-14) << name;
    const Image one = evaluate(
        *resample(row_plane({1, 2, 3}), grid_of_size(3, 1, 1, 1), kernel, PixelValues::flux));
    EXPECT_NEAR(one.at(0, 0), 6, 1e-13) << name;
  }
}

/// Pixels are missing where a hole weighs a quarter, and unaffected beyond the kernel's reach.
TEST(Resample, MissingPixels) {
  const PlanePtr holed = make_plane(
      60, 45, [](int x, int y) { return x == 30 && y == 20 ? nan_value : 1 + 0.1 * x + 0.05 * y; });
  const PlanePtr whole = make_plane(60, 45, [](int x, int y) { return 1 + 0.1 * x + 0.05 * y; });
  for (const std::string& name : kernel_names()) {
    for (const double factor : {0.4, 1.0, 2.3}) {
      const ResampleGrid grid = grid_of_factor(60, 45, factor);
      const Kernel kernel = kernel_of(name);
      const Image image = evaluate(*resample(holed, grid, kernel, PixelValues::brightness));
      const Image full = evaluate(*resample(whole, grid, kernel, PixelValues::brightness));
      const PixelPosition hole = resample_map(grid)({31, 21});
      int missing = 0;
      for (int y = 0; y < grid.height; ++y) {
        for (int x = 0; x < grid.width; ++x) {
          const double reach = (kernel_radius(kernel) + 2) * std::max(1.0, factor) + 1;
          const double distance = std::max(std::abs(x + 1 - hole.x), std::abs(y + 1 - hole.y));
          if (std::isnan(image.at(x, y))) {
            ++missing;
            EXPECT_LT(distance, 1.5 * std::max(1.0, factor)) << name << factor;
          } else if (distance > reach) {
            ASSERT_EQ(image.at(x, y), full.at(x, y));
          } else {
            EXPECT_NEAR(image.at(x, y), full.at(x, y), 0.1);
          }
        }
      }
      EXPECT_GE(missing, factor >= 1 ? 1 : 0) << name << factor;
    }
  }
}

TEST(Resample, PartsAreTheWhole) {
  const PlanePtr plane = resample(noise_plane(300, 290), grid_of_factor(300, 290, 0.73),
                                  Kernel::lanczos3, PixelValues::flux);
  const Image whole = evaluate(*plane, 3);
  for (const Area& area : {Area{17, 31, 170, 3}, {218, 0, 1, 212}, {5, 5, 33, 33}}) {
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

}  // namespace
}  // namespace gamer::resample_test
