#include "gamer/scene/sphere_projection.h"

#include <chealpix.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <string>

#include "gamer/scene/camera.h"
#include "image/healpix_writer.h"
#include "scene/scene_checks.h"

namespace gamer::sphere_projection_test {
namespace {

using std::numbers::pi;
using test::distance;

constexpr double rounding = 1e-14;

struct Kind {
  std::string name;
  std::function<std::unique_ptr<SphereProjection>()> make;
  double sphere;     ///< solid angle of all pixels
  double tolerance;  ///< its relative error
};

void PrintTo(const Kind& kind, std::ostream* stream) { *stream << kind.name; }

/// The solid angle of a small square of the image, from the halves of its two middle lines.
double patch(const SphereProjection& projection, double x, double y, double side) {
  const double reach = side / 4;
  const auto left = projection.direction(x - reach, y), right = projection.direction(x + reach, y);
  const auto below = projection.direction(x, y - reach), above = projection.direction(x, y + reach);
  if (!left || !right || !below || !above) return 0;
  return 4 * glm::length(glm::cross(*right - *left, *above - *below));
}

class EveryProjection : public testing::TestWithParam<Kind> {
 protected:
  template <class Take>
  void for_pixels(const SphereProjection& projection, Take take) const {
    for (int y = 0; y < projection.height(); ++y) {
      for (int x = 0; x < projection.width(); ++x) take(x, y);
    }
  }
};

TEST_P(EveryProjection, DirectionsHaveLengthOneAndComeBack) {
  const auto projection = GetParam().make();
  for_pixels(*projection, [&](int px, int py) {
    const double x = px + 0.31, y = py - 0.27;
    const auto way = projection->direction(x, y);
    if (!way) return;
    ASSERT_NEAR(glm::length(*way), 1, rounding);
    const auto pixel = projection->pixel(*way);
    ASSERT_TRUE(pixel.has_value()) << x << ' ' << y;
    ASSERT_NEAR(pixel->x, x, 1e-9) << x << ' ' << y;
    ASSERT_NEAR(pixel->y, y, 1e-9) << x << ' ' << y;
  });
}

TEST_P(EveryProjection, SolidAnglesAreIntegrals) {
  const auto projection = GetParam().make();
  constexpr int parts = 24;
  for (const double share_x : {0.02, 0.3, 0.5, 0.83}) {
    for (const double share_y : {0.02, 0.2, 0.31, 0.5, 0.97}) {
      const double x = std::floor(share_x * projection->width());
      const double y = std::floor(share_y * projection->height());
      double sum = 0;
      bool is_whole = true;
      for (int j = 0; j < parts; ++j) {
        for (int i = 0; i < parts; ++i) {
          const double part = patch(*projection, x + (i + 0.5) / parts - 0.5,
                                    y + (j + 0.5) / parts - 0.5, 1.0 / parts);
          is_whole = is_whole && part > 0;
          sum += part;
        }
      }
      if (!is_whole) continue;
      // The sum over parts has an error of second order.
      EXPECT_NEAR(projection->solid_angle(x, y) / sum, 1, 2e-5) << x << ' ' << y;
    }
  }
}

TEST_P(EveryProjection, PixelsFillWhatIsShown) {
  const auto projection = GetParam().make();
  double sum = 0;
  for_pixels(*projection, [&](int x, int y) { sum += projection->solid_angle(x, y); });
  EXPECT_NEAR(sum / GetParam().sphere, 1, GetParam().tolerance);
}

TEST_P(EveryProjection, NoPixelIsLongerThanSaid) {
  const auto projection = GetParam().make();
  double longest = 0;
  for_pixels(*projection, [&](int x, int y) {
    const auto right = projection->direction(x + 0.499, y),
               left = projection->direction(x - 0.499, y);
    const auto above = projection->direction(x, y + 0.499),
               below = projection->direction(x, y - 0.499);
    if (left && right) longest = std::max(longest, distance(*left, *right) / 0.998);
    if (below && above) longest = std::max(longest, distance(*below, *above) / 0.998);
  });
  // HEALPix pixels at the borders of the base pixels around the poles are elongated.
  EXPECT_LT(longest, 1.25 * projection->pixel_angle());
  EXPECT_GT(longest, 0.85 * projection->pixel_angle());
}

// A star's light goes into four pixels, which are adjacent on the sphere, too.
TEST_P(EveryProjection, NeighboursAreNear) {
  const auto projection = GetParam().make();
  for (double y = -0.5; y < projection->height() - 0.5; y += 0.25) {
    for (double x = -0.5; x < projection->width() - 0.5; x += 0.25) {
      const auto here = projection->direction(x, y);
      if (!here) continue;
      for (const int j : {0, 1}) {
        for (const int i : {0, 1}) {
          const glm::ivec2 place = projection->neighbour(
              {x, y}, static_cast<int>(std::floor(x)) + i, static_cast<int>(std::floor(y)) + j);
          const auto there = projection->direction(place.x, place.y);
          // No pixel lies beyond the edge of a dome.
          const bool is_inside = place.x >= 0 && place.x < projection->width() && place.y >= 0 &&
                                 place.y < projection->height();
          ASSERT_TRUE(is_inside || (GetParam().sphere < 4 * pi)) << x << ' ' << y;
          if (there) {
            ASSERT_LT(distance(*here, *there), 2.5 * projection->pixel_angle())
                << x << ' ' << y << " to " << place.x << ' ' << place.y;
          }
        }
      }
    }
  }
}

// A place some pixels beyond a seam is equally far away on the sphere, on the other side of the
// seam. A place far from seams has no such neighbours.
TEST_P(EveryProjection, SeamsJoin) {
  const auto projection = GetParam().make();
  constexpr int far = 3;
  const double pixel = projection->pixel_angle();
  int beyond = 0;
  for_pixels(*projection, [&](int x, int y) {
    const auto here = projection->direction(x, y);
    if (!here) return;
    bool has_other = false;
    for (int j = -far; j <= far; ++j) {
      for (int i = -far; i <= far; ++i) {
        const glm::ivec2 place = projection->neighbour({x, y}, x + i, y + j);
        if (place == glm::ivec2(x + i, y + j)) continue;
        has_other = true;
        ++beyond;
        const auto there = projection->direction(place.x, place.y);
        ASSERT_TRUE(there.has_value()) << x << ' ' << y << ": " << i << ' ' << j;
        // The way has pixels along two sides, and a diagonal where three faces meet.
        ASSERT_LT(distance(*here, *there), (std::abs(i) + std::abs(j) + 1) * pixel)
            << x << ' ' << y << ": " << i << ' ' << j;
      }
    }
    if (has_other) {
      ASSERT_TRUE(projection->is_near_seam({x, y}, far + 0.5)) << x << ' ' << y;
    }
  });
  EXPECT_EQ(beyond > 0, GetParam().sphere > 3.99 * pi);
}

// Edges of faces are joined pixel by pixel: the neighbour's neighbour is the pixel itself, and both
// are near each other on the sphere.
TEST(SphereProjection, NeighboursAreMutual) {
  for (const auto& projection : {make_cubemap(8), make_healpix(8)}) {
    const int rows = projection->face_rows();
    for (int y = 0; y < projection->height(); ++y) {
      for (int x = 0; x < rows; ++x) {
        for (const glm::ivec2 step : {glm::ivec2(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
          const glm::ivec2 there = projection->neighbour({x, y}, x + step.x, y + step.y);
          int back = 0;
          for (const glm::ivec2 other : {glm::ivec2(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
            back += projection->neighbour(there, there.x + other.x, there.y + other.y) ==
                            glm::ivec2(x, y)
                        ? 1
                        : 0;
          }
          ASSERT_EQ(back, 1) << x << ' ' << y;
          ASSERT_LT(
              distance(*projection->direction(x, y), *projection->direction(there.x, there.y)),
              1.25 * projection->pixel_angle());
        }
      }
    }
  }
}

TEST_P(EveryProjection, DensitiesAreThoseOfSmallSquares) {
  const auto projection = GetParam().make();
  for_pixels(*projection, [&](int x, int y) {
    constexpr double side = 1e-3;
    const double small = patch(*projection, x + 0.2, y - 0.3, side);
    if (small > 0) {
      ASSERT_NEAR(projection->density(x + 0.2, y - 0.3) * side * side / small, 1, 1e-5);
    }
  });
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, EveryProjection,
    testing::Values(Kind{"dome", [] { return make_fisheye(128, 128, pi); }, 2 * pi, 2e-3},
                    Kind{"wide", [] { return make_fisheye(96, 128, 1.5 * pi); },
                         4 * pi*(0.5 + std::sqrt(0.125)), 1e-3},
                    Kind{"everything", [] { return make_fisheye(128, 128, 2 * pi); }, 4 * pi, 5e-4},
                    Kind{"equirectangular", [] { return make_equirectangular(96, 48); }, 4 * pi,
                         1e-13},
                    Kind{"oblong", [] { return make_equirectangular(50, 40); }, 4 * pi, 1e-13},
                    Kind{"cubemap", [] { return make_cubemap(20); }, 4 * pi, 1e-13},
                    Kind{"odd_cubemap", [] { return make_cubemap(7); }, 4 * pi, 1e-13},
                    Kind{"healpix", [] { return make_healpix(16); }, 4 * pi, 1e-13}),
    [](const auto& test) { return test.param.name; });

TEST(SphereProjection, TheTargetIsInTheMiddle) {
  EXPECT_LT(distance(*make_fisheye(9, 9, pi)->direction(4, 4), {0, 0, 1}), rounding);
  EXPECT_LT(distance(*make_equirectangular(9, 5)->direction(4, 2), {0, 0, 1}), rounding);
  EXPECT_LT(distance(*make_cubemap(9)->direction(4, 9 + 4), {0, 0, 1}), rounding);
}

// The view is from inside: the camera's right is in the right half of the image.
TEST(SphereProjection, RightIsRightAndUpIsUp) {
  const auto fisheye = make_fisheye(101, 101, pi);
  EXPECT_LT(distance(*fisheye->direction(100.5, 50), {1, 0, 0}), rounding);
  EXPECT_LT(distance(*fisheye->direction(50, 100.5), {0, 1, 0}), rounding);
  EXPECT_FALSE(fisheye->direction(100.6, 50).has_value());
  EXPECT_FALSE(fisheye->pixel({0, 0, -1}).has_value());
  const auto map = make_equirectangular(360, 180);
  EXPECT_LT(distance(*map->direction(179.5 + 90, 89.5), {1, 0, 0}), rounding);
  EXPECT_LT(distance(*map->direction(33, 179.5), {0, 1, 0}), rounding);
  EXPECT_LT(distance(*map->direction(-0.5, 89.5), {0, 0, -1}), rounding);
}

// The front face joins the four faces around it.
TEST(SphereProjection, SidesOfTheCubeJoin) {
  const auto cube = make_cubemap(8);
  enum { up, front, left, back, right, down };
  const auto at = [&](int face, double x, double y) {
    return *cube->direction(x, face * 8 + std::min(y, 7.5 - 1e-13));
  };
  for (double s = -0.5; s < 7.5; s += 0.5) {
    EXPECT_LT(distance(at(front, 7.5, s), at(right, -0.5, s)), 1e-12);
    EXPECT_LT(distance(at(front, -0.5, s), at(left, 7.5, s)), 1e-12);
    EXPECT_LT(distance(at(right, 7.5, s), at(back, -0.5, s)), 1e-12);
    EXPECT_LT(distance(at(back, 7.5, s), at(left, -0.5, s)), 1e-12);
    EXPECT_LT(distance(at(front, s, 7.5), at(up, s, -0.5)), 1e-12);
    EXPECT_LT(distance(at(front, s, -0.5), at(down, s, 7.5)), 1e-12);
  }
}

// The centres of pixels are those of the HEALPix library.
TEST(SphereProjection, HealpixPixelsAreThoseOfTheLibrary) {
  for (const int nside : {1, 2, 16}) {
    const auto projection = make_healpix(nside);
    for (long pixel = 0; pixel < 12L * nside * nside; ++pixel) {
      for (const bool is_nested : {false, true}) {
        double vector[3];
        if (is_nested) {
          pix2vec_nest(nside, pixel, vector);
        } else {
          pix2vec_ring(nside, pixel, vector);
        }
        const HealpixPlace place = healpix_place(nside, is_nested, pixel);
        // x points to longitude 0 and y to longitude 90 degrees, which is to the left.
        ASSERT_LT(
            distance(*projection->direction(place.x, place.y), {-vector[1], vector[2], vector[0]}),
            2 * rounding)
            << nside << ' ' << is_nested << ' ' << pixel;
      }
    }
  }
  EXPECT_THROW(make_healpix(12), std::invalid_argument);
}

// For the library, places within a pixel belong to this pixel.
TEST(SphereProjection, HealpixPixelsEndWhereTheLibrarySays) {
  constexpr int nside = 4;
  const auto projection = make_healpix(nside);
  for (long pixel = 0; pixel < 12L * nside * nside; ++pixel) {
    const HealpixPlace place = healpix_place(nside, true, pixel);
    for (const double x : {-0.499, 0.3, 0.499}) {
      for (const double y : {-0.499, -0.2, 0.499}) {
        const glm::dvec3 way = *projection->direction(place.x + x, place.y + y);
        const double vector[3] = {way.z, -way.x, way.y};
        long found = -1;
        vec2pix_nest(nside, vector, &found);
        ASSERT_EQ(found, pixel) << x << ' ' << y;
      }
    }
  }
}

TEST(SphereCamera, RaysFollowTheViewsAxes) {
  const Camera camera(
      test::parameters_of("[image]\nsize = [9, 5]\n[camera]\nprojection = \"equirectangular\"\n"
                          "position = [0.5, 0, 0.1]\ntarget = [0, 0, 0.1]\n"));
  const Ray ray = *camera.ray(4, 2);
  EXPECT_LT(distance(ray.origin, {0.5, 0, 0.1}), rounding);
  EXPECT_LT(distance(ray.direction, {-1, 0, 0}), rounding);
  // The Sun looks towards the centre at -x, North is +z, and the left is -y.
  EXPECT_LT(distance(camera.ray(4 - 9.0 / 4, 2)->direction, {0, -1, 0}), rounding);
  EXPECT_LT(distance(camera.ray(4, 4.5)->direction, {0, 0, 1}), rounding);
  EXPECT_FALSE(camera.pixel({0.5, 0, 0.1}).has_value());
  const glm::dvec2 pixel = *camera.pixel({0.5, -7, 0.1});
  EXPECT_NEAR(pixel.x, 4 - 9.0 / 4, 1e-12);
  EXPECT_NEAR(pixel.y, 2, 1e-12);
}

}  // namespace
}  // namespace gamer::sphere_projection_test
