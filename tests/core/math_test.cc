#include <gtest/gtest.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/math_test.cc"
#include "hwy/foreach_target.h"

#include "core/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void ExpOf(const float* HWY_RESTRICT x, std::size_t size, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(Exp(d, hn::LoadU(d, x + i)), d, out + i);
  }
}

void Exp2Of(const float* HWY_RESTRICT x, std::size_t size, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(Exp2(d, hn::LoadU(d, x + i)), d, out + i);
  }
}

void LogOf(const float* HWY_RESTRICT x, std::size_t size, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(Log(d, hn::LoadU(d, x + i)), d, out + i);
  }
}

void PowOf(const float* HWY_RESTRICT x, float p, std::size_t size, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(Pow(d, hn::LoadU(d, x + i), hn::Set(d, p)), d, out + i);
  }
}

void SinCosOf(const float* HWY_RESTRICT x, std::size_t size, float* HWY_RESTRICT sine,
              float* HWY_RESTRICT cosine) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto s = hn::Zero(d);
    auto c = hn::Zero(d);
    SinCos(d, hn::LoadU(d, x + i), s, c);
    hn::StoreU(s, d, sine + i);
    hn::StoreU(c, d, cosine + i);
  }
}

void Atan2Of(const float* HWY_RESTRICT y, const float* HWY_RESTRICT x, std::size_t size,
             float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(Atan2(d, hn::LoadU(d, y + i), hn::LoadU(d, x + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/each_simd_target.h"
#include "gamer/core/batch.h"
#include "gamer/core/random.h"

namespace gamer {

HWY_EXPORT(ExpOf);
HWY_EXPORT(Exp2Of);
HWY_EXPORT(LogOf);
HWY_EXPORT(PowOf);
HWY_EXPORT(SinCosOf);
HWY_EXPORT(Atan2Of);

namespace {

constexpr double pi = std::numbers::pi;
constexpr std::size_t sample_count = padded(400000);
constexpr float smallest_normal = std::numeric_limits<float>::min();
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Numbers from low to high, both included, evenly spread with a jitter that varies all last bits.
std::vector<float> spread(double low, double high) {
  std::vector<float> x(sample_count);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u =
        (static_cast<double>(i) + to_unit(mix64(i + 1))) / static_cast<double>(x.size());
    x[i] = static_cast<float>(low + (high - low) * u);
  }
  x.front() = static_cast<float>(low);
  x.back() = static_cast<float>(high);
  return x;
}

/// Numbers from low to high, evenly spread in the logarithm.
std::vector<float> spread_logarithm(double low, double high) {
  std::vector<float> x = spread(std::log(low), std::log(high));
  for (float& value : x) value = static_cast<float>(std::exp(double{value}));
  x.front() = static_cast<float>(low);
  x.back() = static_cast<float>(high);
  return x;
}

/// `x` followed by `filler` up to whole vectors of any target.
std::vector<float> padded_with(std::vector<float> x, float filler) {
  x.resize(padded(x.size()), filler);
  return x;
}

std::vector<float> exp_of(const std::vector<float>& x) {
  std::vector<float> y(x.size());
  HWY_DYNAMIC_DISPATCH(ExpOf)(x.data(), x.size(), y.data());
  return y;
}

std::vector<float> exp2_of(const std::vector<float>& x) {
  std::vector<float> y(x.size());
  HWY_DYNAMIC_DISPATCH(Exp2Of)(x.data(), x.size(), y.data());
  return y;
}

std::vector<float> log_of(const std::vector<float>& x) {
  std::vector<float> y(x.size());
  HWY_DYNAMIC_DISPATCH(LogOf)(x.data(), x.size(), y.data());
  return y;
}

std::vector<float> pow_of(const std::vector<float>& x, float p) {
  std::vector<float> y(x.size());
  HWY_DYNAMIC_DISPATCH(PowOf)(x.data(), p, x.size(), y.data());
  return y;
}

std::vector<float> atan2_of(const std::vector<float>& y, const std::vector<float>& x) {
  std::vector<float> angle(x.size());
  HWY_DYNAMIC_DISPATCH(Atan2Of)(y.data(), x.data(), x.size(), angle.data());
  return angle;
}

/// The largest relative error of `found` against `exact`.
double worst_relative(const std::vector<float>& found, const std::vector<double>& exact) {
  double worst = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    worst = std::max(worst, std::abs(found[i] / exact[i] - 1));
  }
  return worst;
}

/// `function` of every element, in double precision.
template <typename Function>
std::vector<double> exact_values(const std::vector<float>& x, Function&& function) {
  std::vector<double> y;
  for (const float value : x) y.push_back(function(double{value}));
  return y;
}

TEST(Math, Exp) {
  const std::vector<float> x = spread(-87, 88);
  const std::vector<double> exact = exact_values(x, [](double v) { return std::exp(v); });
  for_each_simd_target([&] { EXPECT_LT(worst_relative(exp_of(x), exact), 2e-7); });
}

TEST(Math, ExpStopsAtItsEnds) {
  const std::vector<float> below = {-87.5f, -1000.0f, -1e30f, -infinity};
  const std::vector<float> above = {88.5f, 1000.0f, 1e30f, infinity};
  for_each_simd_target([&] {
    for (const float y : exp_of(padded_with(below, -100)))
      EXPECT_NEAR(y / std::exp(-87.0), 1, 2e-7);
    for (const float y : exp_of(padded_with(above, 100))) EXPECT_NEAR(y / std::exp(88.0), 1, 2e-7);
  });
}

TEST(Math, ExpOfZeroIsOne) {
  for_each_simd_target([] {
    for (const float y : exp_of(padded_with({0.0f, -0.0f}, 0))) EXPECT_EQ(y, 1.0f);
  });
}

TEST(Math, Exp2) {
  const std::vector<float> x = spread(-126, 127.9);
  const std::vector<double> exact = exact_values(x, [](double v) { return std::exp2(v); });
  for_each_simd_target([&] {
    EXPECT_LT(worst_relative(exp2_of(x), exact), 2e-7);
    for (const float y : exp2_of(padded_with({0.0f, -0.0f}, 0))) EXPECT_EQ(y, 1.0f);
    for (const float y : exp2_of(padded_with({-126.5f, -1e30f, -infinity}, -200))) {
      EXPECT_EQ(y, smallest_normal);
    }
  });
}

TEST(Math, Log) {
  const float largest = std::numeric_limits<float>::max();
  for (const std::vector<float>& x :
       {spread_logarithm(smallest_normal, largest), spread(0.5, 2), spread(0.9999, 1.0001)}) {
    const std::vector<double> exact = exact_values(x, [](double v) { return std::log(v); });
    for_each_simd_target([&] {
      const std::vector<float> found = log_of(x);
      double worst = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        if (x[i] == 1) {
          EXPECT_EQ(found[i], 0.0f);
        } else {
          worst = std::max(worst, std::abs(found[i] / exact[i] - 1));
        }
      }
      EXPECT_LT(worst, 1.5e-7);
    });
  }
}

TEST(Math, LogOfZeroIsThatOfTheSmallestNormal) {
  for_each_simd_target([] {
    for (const float y : log_of(padded_with({0.0f, -0.0f, 1e-40f, -1.0f}, 0))) {
      EXPECT_NEAR(y, std::log(double{smallest_normal}), 1e-5);
    }
  });
}

TEST(Math, Pow) {
  const std::vector<float> x = spread_logarithm(1e-4, 1e3);
  const std::vector<double> logarithm = exact_values(x, [](double v) { return std::log(v); });
  for_each_simd_target([&] {
    double worst = 0;
    for (const float p : {-12.5f, -8.0f, -1.3f, -0.5f, 0.25f, 0.855f, 1.0f, 2.5f, 7.7f, 12.0f}) {
      const std::vector<float> found = pow_of(x, p);
      for (std::size_t i = 0; i < x.size(); ++i) {
        const double exponent = p * logarithm[i];
        if (exponent < -87 || exponent > 88) continue;
        const double error = std::abs(found[i] / std::exp(exponent) - 1);
        worst = std::max(worst, error / (1 + std::abs(exponent)));
      }
    }
    EXPECT_LT(worst, 2e-7);
  });
}

TEST(Math, PowOfZero) {
  for_each_simd_target([] {
    for (const float p : {0.1f, 1.0f, 7.5f}) {
      for (const float y : pow_of(padded_with({0.0f, -0.0f}, 0), p)) EXPECT_EQ(y, 0.0f);
    }
    for (const float y : pow_of(padded_with({0.0f}, 0), 0)) EXPECT_EQ(y, 1.0f);
  });
}

TEST(Math, SinCos) {
  for (const double end : {4.0, 100.0, 8192.0}) {
    const std::vector<float> x = spread(-end, end);
    for_each_simd_target([&] {
      std::vector<float> sine(x.size());
      std::vector<float> cosine(x.size());
      HWY_DYNAMIC_DISPATCH(SinCosOf)(x.data(), x.size(), sine.data(), cosine.data());
      double worst = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        worst = std::max({worst, std::abs(sine[i] - std::sin(double{x[i]})),
                          std::abs(cosine[i] - std::cos(double{x[i]}))});
      }
      EXPECT_LT(worst, 1.5e-7);
    });
  }
}

TEST(Math, Atan2) {
  // The points lie in all directions at all distances.
  const std::vector<float> angle = spread(-pi, pi);
  std::vector<float> x(angle.size());
  std::vector<float> y(angle.size());
  for (std::size_t i = 0; i < angle.size(); ++i) {
    const double length = std::pow(10, -30 + 60 * to_unit(mix64(i + 1)));
    x[i] = static_cast<float>(length * std::cos(double{angle[i]}));
    y[i] = static_cast<float>(length * std::sin(double{angle[i]}));
  }
  for_each_simd_target([&] {
    const std::vector<float> found = atan2_of(y, x);
    double worst = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      worst = std::max(worst, std::abs(found[i] - std::atan2(double{y[i]}, double{x[i]})));
    }
    EXPECT_LT(worst, 4e-7);
  });
}

TEST(Math, Atan2OnTheAxes) {
  const std::vector<float> x = padded_with({1, 0, -1, 0, 0, 2, -2, -2, 2}, 1);
  const std::vector<float> y = padded_with({0, 1, 0, -1, 0, 2, 2, -2, -2}, 0);
  const std::vector<double> exact = {0,      pi / 2,     pi,          -pi / 2, 0,
                                     pi / 4, pi * 3 / 4, -pi * 3 / 4, -pi / 4};
  for_each_simd_target([&] {
    const std::vector<float> found = atan2_of(y, x);
    for (std::size_t i = 0; i < exact.size(); ++i) EXPECT_NEAR(found[i], exact[i], 1.2e-7) << i;
  });
}

}  // namespace
}  // namespace gamer
#endif
