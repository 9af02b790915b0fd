#include "processing/arithmetic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "gamer/core/error.h"

namespace gamer::arithmetic_test {
namespace {

constexpr double missing_value = std::numeric_limits<double>::quiet_NaN();

PlanePtr plane(std::vector<double> values) {
  return std::make_shared<MemoryPlane>(2, 2, std::move(values));
}

std::vector<double> values_of(const PlanePtr& made) {
  std::vector<double> values(4);
  made->read(made->whole(), values.data());
  return values;
}

TEST(Combined, EveryCombination) {
  const std::vector<PlanePtr> planes = {plane({1, 2, 3, 4}), plane({5, 6, 7, 8}),
                                        plane({10, 20, 30, -40})};
  EXPECT_EQ(values_of(combined(planes, Combination::sum)), (std::vector<double>{16, 28, 40, -28}));
  EXPECT_EQ(values_of(combined(planes, Combination::difference)),
            (std::vector<double>{-14, -24, -34, 36}));
  EXPECT_EQ(values_of(combined(planes, Combination::product)),
            (std::vector<double>{50, 240, 630, -1280}));
  EXPECT_EQ(values_of(combined(planes, Combination::mean)),
            (std::vector<double>{16 / 3.0, 28 / 3.0, 40 / 3.0, -28 / 3.0}));
}

TEST(Combined, APartOfThePlanes) {
  const PlanePtr sum = combined({plane({1, 2, 3, 4}), plane({5, 6, 7, 8})}, Combination::sum);
  std::vector<double> out(3, -1);
  sum->read({1, 0, 1, 2}, out.data(), 2);
  EXPECT_EQ(out, (std::vector<double>{8, -1, 12}));
}

TEST(Combined, MissingPixels) {
  const std::vector<PlanePtr> planes = {plane({1, missing_value, 3, missing_value}),
                                        plane({5, 6, 7, missing_value})};
  const std::vector<double> strict = values_of(combined(planes, Combination::mean));
  EXPECT_EQ(strict[0], 3);
  EXPECT_TRUE(std::isnan(strict[1]));
  const std::vector<double> sum = values_of(combined(planes, Combination::sum, true));
  EXPECT_EQ(sum[1], 6);
  EXPECT_EQ(sum[2], 10);
  EXPECT_TRUE(std::isnan(sum[3]));
  const std::vector<double> mean = values_of(combined(planes, Combination::mean, true));
  EXPECT_EQ(mean[0], 3);
  EXPECT_EQ(mean[1], 6);
  EXPECT_TRUE(std::isnan(mean[3]));
}

TEST(Combined, WhatCannotBe) {
  const PlanePtr other = std::make_shared<MemoryPlane>(4, 1, std::vector<double>(4));
  EXPECT_THROW(combined({plane({1, 2, 3, 4}), other}, Combination::sum), InputError);
  EXPECT_THROW(combined({}, Combination::sum), std::invalid_argument);
  EXPECT_THROW(combined({other}, Combination::product, true), std::invalid_argument);
}

TEST(Scaled, FactorAndOffset) {
  EXPECT_EQ(values_of(scaled(plane({1, 2, 3, -4}), -2, 0.5)),
            (std::vector<double>{-1.5, -3.5, -5.5, 8.5}));
}

}  // namespace
}  // namespace gamer::arithmetic_test
