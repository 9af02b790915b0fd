#include "image/convolution/convolution.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "image/synthetic_image.h"

namespace gamer::convolution_test {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

/// A stamp without symmetry, whose sum is 1.
Stamp skew_stamp(int width, int height) {
  Stamp stamp{width, height, {}};
  double sum = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double v = 1 + std::sin(0.7 * x + 0.3) + 0.02 * x * y + (x == y ? 2 : 0);
      stamp.values.push_back(v);
      sum += v;
    }
  }
  for (double& v : stamp.values) v /= sum;
  return stamp;
}

/// The convolution as a sum over good pixels, divided by their share of the stamp.
Image direct_sum(const Image& image, const Stamp& stamp, EdgeMode edge) {
  const int width = image.width(), height = image.height();
  const auto place = [&](int x, int size) {
    if (edge == EdgeMode::wrap) return ((x % size) + size) % size;
    if (edge == EdgeMode::reflect) {
      while (x < 0 || x >= size) x = x < 0 ? -1 - x : 2 * size - 1 - x;
    }
    return x;
  };
  Image out(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0, lost = 0, all = 0;
      for (int j = -(stamp.height / 2); j <= stamp.height / 2; ++j) {
        for (int i = -(stamp.width / 2); i <= stamp.width / 2; ++i) {
          const double weight = stamp.at(i, j);
          all += weight;
          const int from_x = place(x - i, width), from_y = place(y - j, height);
          if (from_x < 0 || from_x >= width || from_y < 0 || from_y >= height) continue;
          const double value = image.at(from_x, from_y);
          if (std::isfinite(value)) {
            sum += weight * value;
          } else {
            lost += weight;
          }
        }
      }
      out.at(x, y) = std::isfinite(image.at(x, y)) ? sum * all / (all - lost) : missing;
    }
  }
  return out;
}

/// The largest difference; infinite where only one value is NaN.
double largest_difference(const Image& a, const Image& b) {
  double largest = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      const double p = a.at(x, y), q = b.at(x, y);
      if (std::isnan(p) != std::isnan(q)) return infinite;
      if (!std::isnan(p)) largest = std::max(largest, std::abs(p - q));
    }
  }
  return largest;
}

bool is_same(const Image& a, const Image& b) {
  return std::equal(a.plane(0), a.plane(0) + static_cast<std::ptrdiff_t>(a.width()) * a.height(),
                    b.plane(0));
}

/// The cases have transforms (0: direct sums for small stamps), images larger and smaller than the
/// stamp, all edges and both precisions.
TEST(Convolution, IsTheSum) {
  struct Case {
    int width, height, stamp_width, stamp_height, transform;
  };
  for (const Case& c :
       {Case{40, 31, 3, 5, 0}, Case{40, 31, 3, 5, 16}, Case{40, 31, 9, 7, 0},
        Case{40, 31, 9, 7, 12}, Case{40, 31, 9, 7, 9}, Case{7, 5, 13, 11, 0}, Case{1, 1, 13, 11, 0},
        Case{2, 9, 5, 5, 0}, Case{3, 50, 31, 1, 0}, Case{40, 31, 1, 1, 0}}) {
    const Image image = evaluate(*noise_plane(c.width, c.height));
    const Stamp stamp = skew_stamp(c.stamp_width, c.stamp_height);
    for (const EdgeMode edge : {EdgeMode::zero, EdgeMode::reflect, EdgeMode::wrap}) {
      const Image expected = direct_sum(image, stamp, edge);
      ConvolutionOptions options;
      options.edge = edge;
      options.transform_width = options.transform_height = c.transform;
      const auto error = [&] {
        return largest_difference(evaluate(*convolved(memory_plane(image), stamp, options)),
                                  expected);
      };
      EXPECT_LT(error(), 2e-15) << c.width << ' ' << c.stamp_width << ' ' << c.transform;
      options.is_single = true;
      EXPECT_LT(error(), 6e-7) << c.width << ' ' << c.stamp_width << ' ' << c.transform;
    }
  }
}

TEST(Convolution, TiledIsUntiled) {
  const PlanePtr image = noise_plane(300, 250);
  const Stamp stamp = skew_stamp(33, 25);
  ConvolutionOptions one;
  one.transform_width = 384;
  one.transform_height = 320;
  const Image untiled = evaluate(*convolved(image, stamp, one));
  for (const int size : {48, 64, 100}) {
    ConvolutionOptions options;
    options.transform_width = size;
    options.transform_height = 40;
    EXPECT_LT(largest_difference(evaluate(*convolved(image, stamp, options)), untiled), 2e-15);
  }
  EXPECT_LT(largest_difference(evaluate(*convolved(image, stamp)), untiled), 2e-15);
}

/// Every bit is equal for any area and number of threads.
TEST(Convolution, DoesNotDependOnAreasOrThreads) {
  for (const Stamp& stamp : {skew_stamp(3, 3), skew_stamp(15, 11)}) {
    ConvolutionOptions options;
    if (stamp.width > 3) options.transform_width = options.transform_height = 32;
    const PlanePtr plane = convolved(noise_plane(90, 70), stamp, options);
    const Image all = evaluate(*plane);
    EXPECT_TRUE(is_same(evaluate(*plane, 3), all));
    for (const Area& area : {Area{0, 0, 90, 1}, Area{13, 20, 40, 33}, Area{89, 69, 1, 1}}) {
      const std::ptrdiff_t stride = area.width + 3;
      std::vector<double> values(
          static_cast<std::size_t>(stride) * static_cast<std::size_t>(area.height), -1.0);
      plane->read(area, values.data(), stride);
      for (int y = 0; y < area.height; ++y) {
        for (int x = 0; x < stride; ++x) {
          const double expected = x < area.width ? all.at(area.x + x, area.y + y) : -1;
          EXPECT_EQ(values[static_cast<std::size_t>(y * stride + x)], expected);
        }
      }
    }
  }
}

TEST(Convolution, DeltaGivesTheStampBack) {
  for (const auto& [width, height] : {std::pair{5, 3}, std::pair{21, 17}}) {
    const Stamp stamp = skew_stamp(width, height);
    const Image out = evaluate(*convolved(
        make_plane(60, 50, [](int x, int y) { return x == 20 && y == 30 ? 1.0 : 0.0; }), stamp));
    double worst = 0;
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 60; ++x) {
        const bool is_inside = std::abs(x - 20) <= width / 2 && std::abs(y - 30) <= height / 2;
        const double expected = is_inside ? stamp.at(x - 20, y - 30) : 0;
        worst = std::max(worst, std::abs(out.at(x, y) - expected));
      }
    }
    EXPECT_LT(worst, 1e-16);
  }
}

TEST(Convolution, FluxIsKept) {
  StampOptions options;
  options.size = 41;
  const Stamp stamp = make_stamp(Psf({PsfKind::kolmogorov, 4}), options);
  const auto sum = [](const Image& image) { return moments_of(image).sum; };
  // Flux is kept far from the edges, and everywhere with edges that lose no light.
  const PlanePtr inner = make_plane(150, 130, {Gaussian{70, 60, 4, 2, 20, 3}});
  EXPECT_NEAR(sum(evaluate(*convolved(inner, stamp))) / sum(evaluate(*inner)), 1, 1e-13);
  const PlanePtr full = noise_plane(150, 130);
  for (const EdgeMode edge : {EdgeMode::reflect, EdgeMode::wrap}) {
    EXPECT_NEAR(sum(evaluate(*convolved(full, stamp, {edge}))) / sum(evaluate(*full)), 1, 1e-13);
  }
  EXPECT_NEAR(sum(evaluate(*convolved(full, stamp, {EdgeMode::wrap, true}))) / sum(evaluate(*full)),
              1, 1e-6);
  EXPECT_LT(sum(evaluate(*convolved(full, stamp))) / sum(evaluate(*full)), 0.99);
}

/// The variances of image and stamp add up.
TEST(Convolution, WidensGaussians) {
  const double fwhm = 7;
  StampOptions options;
  options.size = 61;
  const Stamp stamp = make_stamp(Psf({PsfKind::gaussian, fwhm}), options);
  const Image out =
      evaluate(*convolved(make_plane(140, 140, {Gaussian{70, 66, 6, 4, 0, 1}}), stamp));
  const Moments moments = moments_of(out);
  const double sigma2 = fwhm * fwhm / (8 * std::log(2)) + 1.0 / 12;
  EXPECT_NEAR(moments.xx, 36 + sigma2, 1e-6);
  EXPECT_NEAR(moments.yy, 16 + sigma2, 1e-6);
}

/// Flux within a circle around a pixel. In pixels cut by the circle, light follows the image's
/// gradient.
double aperture_sum(const Image& image, int x0, int y0, double radius) {
  constexpr int parts = 40;
  double sum = 0;
  for (int y = 1; y < image.height() - 1; ++y) {
    for (int x = 1; x < image.width() - 1; ++x) {
      const double distance = std::hypot(x - x0, y - y0);
      if (distance > radius + 1) continue;
      if (distance < radius - 1) {
        sum += image.at(x, y);
        continue;
      }
      const double slope_x = (image.at(x + 1, y) - image.at(x - 1, y)) / 2;
      const double slope_y = (image.at(x, y + 1) - image.at(x, y - 1)) / 2;
      for (int j = 0; j < parts; ++j) {
        for (int i = 0; i < parts; ++i) {
          const double dx = (i + 0.5) / parts - 0.5, dy = (j + 0.5) / parts - 0.5;
          if (std::hypot(x - x0 + dx, y - y0 + dy) > radius) continue;
          sum += (image.at(x, y) + slope_x * dx + slope_y * dy) / (parts * parts);
        }
      }
    }
  }
  return sum;
}

/// Encircled energies of convolved point sources agree with the tables to their last digits.
TEST(Convolution, EncircledEnergyOfPointSources) {
  struct Case {
    PsfModel model;
    double radius, energy, error;
  };
  const double fwhm = 40;
  const auto airy = [&](double obscuration, double energy) {
    PsfModel model{PsfKind::airy, fwhm};
    model.obscuration = obscuration;
    return Case{model, 1.22 * fwhm / airy_fwhm(obscuration), energy, 1e-4};
  };
  const auto moffat = [&](double beta, double half_light, double energy) {
    const PsfModel model{PsfKind::moffat, fwhm, beta};
    return std::vector{Case{model, half_light * fwhm, 0.5, 1e-5},
                       Case{model, 3 * fwhm, energy, 1e-5}};
  };
  std::vector<Case> cases = {{{PsfKind::gaussian, fwhm}, fwhm / 2, 0.5, 1e-5},
                             {{PsfKind::kolmogorov, fwhm}, .5685 * fwhm, 0.5, 1e-4},
                             airy(0, .8378),
                             airy(.33, .6565),
                             airy(.5, .4930)};
  for (const auto& two : {moffat(2.5, .677948, .97738), moffat(3, .631192, .99068),
                          moffat(3.5, .603914, .99575), moffat(4.765, .568106, .99920)}) {
    cases.insert(cases.end(), two.begin(), two.end());
  }
  const PlanePtr point =
      make_plane(280, 270, [](int x, int y) { return x == 135 && y == 133 ? 10.0 : 0.0; });
  StampOptions options;
  options.size = 251;
  options.keep_missing_flux = true;
  for (const Case& c : cases) {
    const Image out = evaluate(*convolved(point, make_stamp(Psf(c.model), options)), 2);
    EXPECT_NEAR(aperture_sum(out, 135, 133, c.radius) / 10, c.energy, c.error)
        << static_cast<int>(c.model.kind) << ' ' << c.model.beta;
  }
}

/// The width of a convolved point source at half its peak, by interpolation along the row.
TEST(Convolution, WidthOfPointSources) {
  const double fwhm = 40;
  StampOptions options;
  options.size = 101;
  options.integrated = false;
  const PlanePtr point =
      make_plane(101, 3, [](int x, int y) { return x == 50 && y == 1 ? 1.0 : 0.0; });
  for (const PsfModel& model :
       {PsfModel{PsfKind::gaussian, fwhm}, PsfModel{PsfKind::moffat, fwhm},
        PsfModel{PsfKind::airy, fwhm}, PsfModel{PsfKind::kolmogorov, fwhm}}) {
    const Image out = evaluate(*convolved(point, make_stamp(Psf(model), options)));
    const double half = out.at(50, 1) / 2;
    int x = 50;
    while (out.at(x + 1, 1) > half) ++x;
    const double at = x + (out.at(x, 1) - half) / (out.at(x, 1) - out.at(x + 1, 1));
    EXPECT_NEAR(2 * (at - 50), fwhm, 1e-3);
  }
}

TEST(Convolution, MissingPixelsStayMissingAndDoNotSpread) {
  Image image = evaluate(*noise_plane(64, 48));
  image.at(20, 20) = missing;
  image.at(21, 20) = infinite;
  image.at(0, 0) = -infinite;
  for (int y = 30; y < 40; ++y) {
    for (int x = 40; x < 60; ++x) image.at(x, y) = missing;
  }
  for (const auto& [width, height] : {std::pair{3, 3}, std::pair{11, 9}}) {
    const Stamp stamp = skew_stamp(width, height);
    for (const EdgeMode edge : {EdgeMode::zero, EdgeMode::reflect, EdgeMode::wrap}) {
      const Image expected = direct_sum(image, stamp, edge);
      ConvolutionOptions options;
      options.edge = edge;
      EXPECT_LT(
          largest_difference(evaluate(*convolved(memory_plane(image), stamp, options)), expected),
          4e-15);
      options.is_single = true;
      EXPECT_LT(
          largest_difference(evaluate(*convolved(memory_plane(image), stamp, options)), expected),
          2e-6);
    }
  }
  // Missing values change nothing beyond the stamp's reach, but for the last bits.
  const Stamp stamp = skew_stamp(11, 9);
  const Image with = evaluate(*convolved(memory_plane(image), stamp));
  for (double* v = image.plane(0); v != image.plane(0) + std::ptrdiff_t{64} * 48; ++v) {
    if (!std::isfinite(*v)) *v = 0;
  }
  const Image without = evaluate(*convolved(memory_plane(image), stamp));
  for (int y = 0; y < 48; ++y) {
    for (int x = 6; x < 15; ++x) EXPECT_EQ(with.at(x, y), without.at(x, y));
  }
}

/// A flat image stays flat around missing pixels, and an image without good pixels stays missing.
TEST(Convolution, GoodPixelsCountForMissingOnes) {
  const Stamp stamp = skew_stamp(9, 9);
  const PlanePtr flat =
      make_plane(40, 40, [](int x, int y) { return (x * 7 + y * 3) % 5 == 0 ? missing : 2.5; });
  const Image out = evaluate(*convolved(flat, stamp, {EdgeMode::reflect}));
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      if ((x * 7 + y * 3) % 5 == 0) {
        EXPECT_TRUE(std::isnan(out.at(x, y)));
      } else {
        EXPECT_NEAR(out.at(x, y), 2.5, 4e-15);
      }
    }
  }
  const Image none =
      evaluate(*convolved(make_plane(9, 9, [](int, int) { return missing; }), stamp));
  EXPECT_TRUE(
      std::all_of(none.plane(0), none.plane(0) + 81, [](double v) { return std::isnan(v); }));
}

/// Values of any size neither vanish nor lose digits.
TEST(Convolution, HugeAndTinyValues) {
  const Image image = evaluate(*noise_plane(64, 48));
  for (const auto& [width, height] : {std::pair{3, 3}, std::pair{11, 9}}) {
    const Stamp stamp = skew_stamp(width, height);
    const Image expected = direct_sum(image, stamp, EdgeMode::zero);
    for (const double scale : {0x1p-1000, 0x1p-140, 0x1p90, 0x1p127, 0x1p500, 0x1p1020}) {
      const PlanePtr scaled =
          make_plane(64, 48, [&](int x, int y) { return scale * image.at(x, y); });
      for (const bool is_single : {false, true}) {
        Image out = evaluate(*convolved(scaled, stamp, {EdgeMode::zero, is_single}));
        for (double* v = out.plane(0); v != out.plane(0) + std::ptrdiff_t{64} * 48; ++v) {
          *v /= scale;
        }
        EXPECT_LT(largest_difference(out, expected), is_single ? 6e-7 : 2e-15)
            << scale << ' ' << width << ' ' << is_single;
      }
    }
  }
}

/// A huge value does not affect pixels of other tiles, and no pixel is missing.
TEST(Convolution, HugeValueAmongSmallOnes) {
  const PlanePtr plane =
      make_plane(90, 40, [](int x, int y) { return x == 3 && y == 5 ? 1e35 : 1.0; });
  const Stamp stamp = skew_stamp(7, 7);
  ConvolutionOptions options{EdgeMode::reflect, true};
  options.transform_width = options.transform_height = 32;
  const Image out = evaluate(*convolved(plane, stamp, options));
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 90; ++x) {
      ASSERT_TRUE(std::isfinite(out.at(x, y)));
      if (x >= 30) {
        EXPECT_NEAR(out.at(x, y), 1, 2e-6);
      }
    }
  }
  for (int j = -3; j <= 3; ++j) {
    for (int i = -3; i <= 3; ++i) {
      EXPECT_NEAR(out.at(3 + i, 5 + j) / 1e35, stamp.at(i, j), 1e-7);
    }
  }
}

/// With more planes than cached kernels, each plane still gets its own stamp.
TEST(Convolution, StampsOfManyPlanes) {
  const PlanePtr image = noise_plane(50, 40);
  std::vector<PlanePtr> planes;
  std::vector<Image> expected;
  for (int i = 0; i < 7; ++i) {
    Stamp stamp = skew_stamp(9, 7);
    for (double& v : stamp.values) v *= i + 1;
    expected.push_back(direct_sum(evaluate(*image), stamp, EdgeMode::zero));
    planes.push_back(convolved(image, 9, 7, [stamp] { return stamp; }));
  }
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      EXPECT_LT(largest_difference(evaluate(*planes[i], 2), expected[i]), 2e-14);
    }
  }
}

TEST(Convolution, WrongStamps) {
  const PlanePtr image = noise_plane(5, 5);
  EXPECT_THROW(convolved(image, Stamp{2, 1, {1, 1}}), std::invalid_argument);
  EXPECT_THROW(convolved(image, Stamp{3, 1, {1, 1}}), std::invalid_argument);
  EXPECT_THROW(convolved(image, Stamp{1, 1, {missing}}), std::invalid_argument);
  ConvolutionOptions options;
  options.transform_width = 8;
  EXPECT_THROW(convolved(image, skew_stamp(9, 3), options), std::invalid_argument);
  const PlanePtr other = convolved(image, 3, 3, [] { return Stamp{}; });
  EXPECT_THROW(evaluate(*other), std::invalid_argument);
}

}  // namespace
}  // namespace gamer::convolution_test
