#include "processing/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "image/synthetic_image.h"

namespace gamer::geometry_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

/// Expects parts of a plane, of any size, to equal the whole plane.
void expect_same_in_parts(const PlanePtr& plane) {
  const Image whole = evaluate(*plane, 3);
  for (const int width : {1, 7, plane->width()}) {
    for (const int height : {1, 5, plane->height()}) {
      for (int y = 0; y + height <= plane->height(); y += height + 2) {
        for (int x = 0; x + width <= plane->width(); x += width + 1) {
          const std::ptrdiff_t stride = width + 3;
          std::vector<double> out(static_cast<std::size_t>(stride) * height, -1);
          plane->read({x, y, width, height}, out.data(), stride);
          for (int j = 0; j < height; ++j) {
            for (int i = 0; i < stride; ++i) {
              const double expected = i < width ? whole.at(x + i, y + j) : -1;
              ASSERT_EQ(out[static_cast<std::size_t>(j * stride + i)], expected);
            }
          }
        }
      }
    }
  }
}

TEST(Geometry, Flip) {
  const PlanePtr source = noise_plane(13, 8);
  const Image old = evaluate(*source);
  for (const FlipAxis axis : {FlipAxis::x, FlipAxis::y, FlipAxis::both}) {
    const PlanePtr flipped = flip(source, axis);
    const Image image = evaluate(*flipped);
    const PixelMap map = flip_map(13, 8, axis);
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 13; ++x) {
        const int u = axis == FlipAxis::y ? x : 12 - x, v = axis == FlipAxis::x ? y : 7 - y;
        EXPECT_EQ(image.at(u, v), old.at(x, y));
        const PixelPosition to = map({x + 1.0, y + 1.0});
        EXPECT_EQ(to.x, u + 1);
        EXPECT_EQ(to.y, v + 1);
      }
    }
    expect_same_in_parts(flipped);
  }
}

TEST(Geometry, CropAndPad) {
  const PlanePtr source = noise_plane(13, 8);
  const Image old = evaluate(*source);
  const Area box = {3, 1, 7, 6};
  const PlanePtr cropped = crop(source, box);
  const Image part = evaluate(*cropped);
  ASSERT_EQ(part.width(), 7);
  ASSERT_EQ(part.height(), 6);
  EXPECT_EQ(part.at(2, 3), old.at(5, 4));
  EXPECT_EQ(crop_map(box)({6, 5}).x, 3);
  EXPECT_EQ(crop_map(box)({6, 5}).y, 4);
  expect_same_in_parts(cropped);

  const Margins margins = {2, 1, 4, 3};
  const PlanePtr padded = pad(source, margins, 7);
  const Image wide = evaluate(*padded);
  ASSERT_EQ(wide.width(), 16);
  ASSERT_EQ(wide.height(), 15);
  for (int y = 0; y < 15; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool is_inside = x >= 2 && x < 15 && y >= 4 && y < 12;
      EXPECT_EQ(wide.at(x, y), is_inside ? old.at(x - 2, y - 4) : 7);
    }
  }
  expect_same_in_parts(padded);
  EXPECT_TRUE(std::isnan(evaluate(*pad(source, margins, nan_value)).at(0, 0)));
  EXPECT_EQ(difference(evaluate(*crop(padded, {2, 4, 13, 8})), old), 0);

  EXPECT_THROW(crop(source, {0, 0, 14, 8}), std::invalid_argument);
  EXPECT_THROW(crop(source, {-1, 0, 4, 4}), std::invalid_argument);
  EXPECT_THROW(crop(source, {0, 0, 4, 0}), std::invalid_argument);
  EXPECT_THROW(pad(source, {-1, 0, 0, 0}, 0), std::invalid_argument);
  EXPECT_THROW(pad(source, {0, std::numeric_limits<int>::max(), 0, 0}, 0), std::invalid_argument);
}

TEST(Geometry, QuarterTurns) {
  const PlanePtr source = noise_plane(600, 17);
  const Image old = evaluate(*source);
  const PlanePtr turned = quarter_turns(source, 1);
  const Image image = evaluate(*turned, 2);
  ASSERT_EQ(image.width(), 17);
  ASSERT_EQ(image.height(), 600);
  // The turn takes +x to +y, and +y to -x.
  EXPECT_EQ(image.at(16, 0), old.at(0, 0));
  EXPECT_EQ(image.at(16, 599), old.at(599, 0));
  EXPECT_EQ(image.at(0, 0), old.at(0, 16));
  for (int count = -5; count <= 5; ++count) {
    const Image one = evaluate(*quarter_turns(source, count));
    const PixelMap map = quarter_turns_map(600, 17, count);
    for (const auto& [x, y] : {std::pair(1, 1), {600, 17}, {37, 5}}) {
      const PixelPosition to = map({static_cast<double>(x), static_cast<double>(y)});
      ASSERT_EQ(one.at(static_cast<int>(to.x) - 1, static_cast<int>(to.y) - 1),
                old.at(x - 1, y - 1));
    }
  }
  PlanePtr plane = source;
  for (int i = 0; i < 4; ++i) plane = quarter_turns(plane, 1);
  EXPECT_EQ(difference(evaluate(*plane), old), 0);
  EXPECT_EQ(difference(evaluate(*quarter_turns(quarter_turns(source, 3), 1)), old), 0);
  expect_same_in_parts(quarter_turns(noise_plane(13, 8), 1));
  expect_same_in_parts(quarter_turns(noise_plane(13, 8), 3));
  EXPECT_EQ(evaluate(*quarter_turns(noise_plane(1, 1), 1)).at(0, 0),
            evaluate(*noise_plane(1, 1)).at(0, 0));
}

TEST(Geometry, Bin) {
  const PlanePtr source = noise_plane(13, 8);
  const Image old = evaluate(*source);
  const PlanePtr sums = bin(source, 3, 2, PixelValues::flux);
  const Image flux = evaluate(*sums);
  const Image mean = evaluate(*bin(source, 3, 2, PixelValues::brightness));
  ASSERT_EQ(flux.width(), 4);
  ASSERT_EQ(flux.height(), 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      double sum = 0;
      for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 3; ++i) sum += old.at(3 * x + i, 2 * y + j);
      }
      EXPECT_NEAR(flux.at(x, y), sum, 4e-16 * 6);
      EXPECT_NEAR(mean.at(x, y), sum / 6, 4e-16);
    }
  }
  expect_same_in_parts(sums);
  // The image's corner is a block's corner: pixels 1 to 3 become pixel 1.
  EXPECT_NEAR(bin_map(3, 2)({2, 1.5}).x, 1, 1e-15);
  EXPECT_EQ(bin_map(3, 2)({2, 1.5}).y, 1);
  EXPECT_THROW(bin(source, 14, 1, PixelValues::flux), std::invalid_argument);
  EXPECT_THROW(bin(source, 1, 0, PixelValues::flux), std::invalid_argument);
  // These blocks are read in several pieces.
  const PlanePtr large = noise_plane(400, 400);
  const double total = moments_of(evaluate(*large)).sum;
  EXPECT_NEAR(evaluate(*bin(large, 400, 400, PixelValues::flux)).at(0, 0), total, 1e-13 * total);
  EXPECT_EQ(evaluate(*bin(noise_plane(1, 1), 1, 1, PixelValues::flux)).at(0, 0),
            evaluate(*noise_plane(1, 1)).at(0, 0));
}

/// A block is missing if a quarter of it is missing; with less missing, the other pixels stand for
/// all.
TEST(Geometry, BinMissing) {
  for (int missing = 0; missing <= 9; ++missing) {
    const PlanePtr source = make_plane(
        3, 3, [&](int x, int y) { return 3 * y + x < missing ? nan_value : 5.0 + 0 * x; });
    const double flux = evaluate(*bin(source, 3, 3, PixelValues::flux)).at(0, 0);
    const double mean = evaluate(*bin(source, 3, 3, PixelValues::brightness)).at(0, 0);
    if (missing <= 2) {
      EXPECT_NEAR(flux, 45, 1e-13);
      EXPECT_NEAR(mean, 5, 1e-14);
    } else {
      EXPECT_TRUE(std::isnan(flux) && std::isnan(mean)) << missing;
    }
  }
  const PlanePtr one =
      make_plane(4, 4, [](int x, int y) { return x == 1 && y == 1 ? nan_value : 1.0; });
  const Image image = evaluate(*bin(one, 2, 2, PixelValues::flux));
  EXPECT_TRUE(std::isnan(image.at(0, 0)));
  EXPECT_EQ(image.at(1, 0), 4);
}

/// A window has the image's pixels where the image has any.
TEST(Geometry, WindowReachesOverEdges) {
  constexpr int width = 7, height = 5;
  const PlanePtr source = make_plane(width, height, [](int x, int y) { return 10.0 * y + x; });
  for (const Area& box : {Area{1, 1, 4, 3}, Area{-2, -1, 5, 4}, Area{5, 3, 9, 6},
                          Area{-3, -3, 20, 20}, Area{6, 4, 1, 1}}) {
    const Image image = evaluate(*window(source, box, -1));
    ASSERT_EQ(image.width(), box.width);
    ASSERT_EQ(image.height(), box.height);
    for (int y = 0; y < box.height; ++y) {
      for (int x = 0; x < box.width; ++x) {
        const int from_x = x + box.x, from_y = y + box.y;
        const bool is_inside = from_x >= 0 && from_x < width && from_y >= 0 && from_y < height;
        EXPECT_EQ(image.at(x, y), is_inside ? 10.0 * from_y + from_x : -1.0);
      }
    }
  }
  EXPECT_THROW(window(source, {7, 0, 2, 2}, 0), std::invalid_argument);
  EXPECT_THROW(window(source, {0, -3, 2, 3}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace gamer::geometry_test
