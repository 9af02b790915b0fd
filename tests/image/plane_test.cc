#include "gamer/image/plane.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>

#include "gamer/core/cancellation.h"

namespace gamer::plane_test {
namespace {

std::vector<double> counted(int count) {
  std::vector<double> values(count);
  std::iota(values.begin(), values.end(), 0.0);
  return values;
}

/// A plane with the value 1000 y + x, made in tiles of the given size.
class TiledPlane final : public Plane {
 public:
  TiledPlane(int width, int height, Tile tile) : Plane(width, height), tile_(tile) {}
  using Plane::read;
  Tile tile() const override { return tile_; }
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    if (area.x < 0 || area.y < 0 || area.x + area.width > width() ||
        area.y + area.height > height()) {
      throw std::out_of_range("area");
    }
    const std::lock_guard lock(mutex_);
    widest_ = std::max(widest_, area.width);
    highest_ = std::max(highest_, area.height);
    for (int row = 0; row < area.height; ++row) {
      for (int x = 0; x < area.width; ++x) {
        out[row * stride + x] = 1000.0 * (area.y + row) + area.x + x;
      }
    }
  }
  int widest() const { return widest_; }
  int highest() const { return highest_; }

 private:
  Tile tile_;
  mutable std::mutex mutex_;
  mutable int widest_ = 0, highest_ = 0;
};

TEST(Plane, WithoutPixels) {
  EXPECT_THROW(MemoryPlane(0, 3, {}), std::invalid_argument);
  EXPECT_THROW(MemoryPlane(2, 3, counted(5)), std::invalid_argument);
}

TEST(Plane, ReadsAnArea) {
  const MemoryPlane plane(4, 3, counted(12));
  std::vector<double> out(8, -1);
  plane.read({1, 1, 2, 2}, out.data(), 4);
  EXPECT_EQ(out, (std::vector<double>{5, 6, -1, -1, 9, 10, -1, -1}));
  plane.read({3, 0, 1, 3}, out.data());
  EXPECT_EQ(out[0], 3);
  EXPECT_EQ(out[2], 11);
}

TEST(Plane, ChangedKnowsPlaces) {
  const auto source = std::make_shared<MemoryPlane>(4, 3, counted(12));
  const PlanePtr plane = changed(source, [](const Area& area, double* values) {
    for (int row = 0; row < area.height; ++row) {
      for (int i = 0; i < area.width; ++i) {
        values[row * area.width + i] -= 4.0 * (area.y + row) + area.x + i;
      }
    }
  });
  std::vector<double> out(12, -1);
  plane->read({1, 1, 2, 2}, out.data(), 5);
  EXPECT_EQ(out, (std::vector<double>{0, 0, -1, -1, -1, 0, 0, -1, -1, -1, -1, -1}));
  EXPECT_EQ(evaluate(*plane).at(3, 2), 0);
}

TEST(Plane, BandsOfTilesCoverIt) {
  for (const int threads : {1, 2, 5}) {
    for (const Plane::Tile tile : {Plane::Tile{7, 3}, {100, 4}, {40, 1}, {1, 29}, {1000, 1000}}) {
      const TiledPlane plane(40, 29, tile);
      int next = 0;
      for_each_band(plane, threads, [&](const Area& area, const double* values) {
        EXPECT_EQ(area.y, next);
        EXPECT_EQ(area.width, 40);
        for (int i = 0; i < area.height * 40; ++i) {
          ASSERT_EQ(values[i], 1000.0 * (area.y + i / 40) + i % 40);
        }
        next += area.height;
      });
      EXPECT_EQ(next, 29);
      EXPECT_LE(plane.widest(), tile.width);
      EXPECT_LE(plane.highest(), tile.height);
    }
  }
}

TEST(Plane, BandsEndWhenCancelled) {
  const TiledPlane plane(16, 1000, {16, 1});
  for (const int threads : {1, 3}) {
    Cancellation request;
    const CancellationScope scope(&request);
    int rows = 0;
    EXPECT_THROW(for_each_band(plane, threads,
                               [&](const Area& area, const double*) {
                                 rows += area.height;
                                 request.request();
                               }),
                 Cancelled);
    // The next band may already be complete.
    EXPECT_LE(rows, 2 * threads);
  }
}

TEST(Plane, ErrorsOfTilesAndTakersArrive) {
  const auto source = std::make_shared<TiledPlane>(40, 29, Plane::Tile{40, 2});
  const PlanePtr failing = changed(source, [](const Area& area, double*) {
    if (area.y >= 20) throw std::runtime_error("tile");
  });
  for (const int threads : {1, 3}) {
    EXPECT_THROW(for_each_band(*failing, threads, [](const Area&, const double*) {}),
                 std::runtime_error);
    EXPECT_THROW(for_each_band(*source, threads,
                               [](const Area&, const double*) { throw std::out_of_range("take"); }),
                 std::out_of_range);
  }
}

TEST(Plane, TheErrorIsThatOfTheFirstTile) {
  const auto source = std::make_shared<TiledPlane>(40, 29, Plane::Tile{10, 2});
  const PlanePtr failing = changed(source, [](const Area& area, double*) {
    if (area.y < 20 || area.x == 0) return;
    // The first tile that fails takes longest.
    if (area.x == 10) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    throw std::runtime_error(std::to_string(area.x) + "," + std::to_string(area.y));
  });
  for (const int threads : {1, 2, 4}) {
    try {
      evaluate(*failing, threads);
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "10,20");
    }
  }
}

}  // namespace
}  // namespace gamer::plane_test
