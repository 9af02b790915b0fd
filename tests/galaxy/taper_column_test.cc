#include "galaxy/kinds/taper_column.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gamer/galaxy/sample_batch.h"

namespace gamer::taper_column_test {
namespace {

TEST(MeanTaper, AgainstAFineSum) {
  double worst = 0;
  for (const double h : {1e-3, 0.01, 0.1, 0.4, 1.0}) {
    for (const double r : {0.0, 0.3, 0.69, 0.7, 0.71, 0.9, 0.99}) {
      constexpr int steps = 200000;
      const double end = std::min(1.0, 25 * h);
      double sum = 0;
      for (int i = 0; i < steps; ++i) {
        const double z = end * (i + 0.5) / steps;
        sum += std::pow(std::cosh(z / h), -2) * taper_at(std::hypot(r, z)) / h * end / steps;
      }
      worst = std::max(worst, std::abs(mean_taper(r, h) - sum));
    }
  }
  std::printf("largest error: %.1e\n", worst);
  EXPECT_LT(worst, 3e-13);
  EXPECT_EQ(mean_taper(1, 0.1), 0);
  EXPECT_EQ(mean_taper(0.2, 1e-3), 1);
}

TEST(MeanTaper, OfALiftedColumnAgainstAFineSum) {
  double worst = 0;
  for (const double h : {1e-3, 0.01, 0.1, 0.4}) {
    for (const double r : {0.0, 0.3, 0.69, 0.71, 0.9}) {
      for (const double lift : {0.0, -0.2, 0.5, 0.8}) {
        constexpr int steps = 200000;
        const double end = 20 * h;
        double sum = 0;
        for (int i = 0; i < steps; ++i) {
          const double z = end * (2 * (i + 0.5) / steps - 1);
          sum += std::pow(std::cosh(z / h), -2) * taper_at(std::hypot(r, z + lift));
        }
        worst = std::max(worst, std::abs(mean_taper(r, h, lift) - sum / h * end / steps));
      }
    }
  }
  std::printf("largest error: %.1e\n", worst);
  EXPECT_LT(worst, 1e-9);
  EXPECT_EQ(mean_taper(1, 0.1, 0.1), 0);
}

}  // namespace
}  // namespace gamer::taper_column_test
