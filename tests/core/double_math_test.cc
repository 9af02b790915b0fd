#include <gtest/gtest.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/double_math_test.cc"
#include "hwy/foreach_target.h"

#include "core/double_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void ExpOf(const double* HWY_RESTRICT x, std::size_t size, double* HWY_RESTRICT out) {
  const hn::ScalableTag<double> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(ExpDouble(d, hn::LoadU(d, x + i)), d, out + i);
  }
}

void LogOf(const double* HWY_RESTRICT x, std::size_t size, double* HWY_RESTRICT out) {
  const hn::ScalableTag<double> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::StoreU(LogDouble(d, hn::LoadU(d, x + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cmath>
#include <vector>

#include "core/each_simd_target.h"

namespace gamer {

HWY_EXPORT(ExpOf);
HWY_EXPORT(LogOf);

namespace {

/// A multiple of the lanes of any target.
constexpr std::size_t size_of_side = 1 << 16;

double at(std::size_t i, double low, double high) {
  return low + (high - low) * (static_cast<double>(i) + 0.5) / size_of_side;
}

/// Returns the largest relative error, and expects equal bits on all targets.
template <class Function, class Exact>
double largest_error(const std::vector<double>& x, Function function, Exact exact) {
  std::vector<double> first;
  double largest = 0;
  for_each_simd_target([&] {
    std::vector<double> y(x.size());
    function(x.data(), x.size(), y.data());
    if (first.empty()) {
      first = y;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const long double expected = exact(static_cast<long double>(x[i]));
        const auto error = static_cast<double>(std::abs(y[i] / expected - 1));
        largest = std::max(largest, error);
      }
    }
    EXPECT_EQ(y, first);
  });
  return largest;
}

TEST(DoubleMath, ExpIsWithinItsError) {
  std::vector<double> x;
  for (std::size_t i = 0; i < size_of_side; ++i) x.push_back(at(i, -10, 0));
  for (std::size_t i = 0; i < size_of_side; ++i) x.push_back(at(i, -700, 700));
  const auto exp_of = [](auto... a) { HWY_DYNAMIC_DISPATCH(ExpOf)(a...); };
  EXPECT_LT(largest_error(x, exp_of, [](long double v) { return std::exp(v); }), 4e-16);
}

TEST(DoubleMath, LogIsWithinItsError) {
  std::vector<double> x;
  for (std::size_t i = 0; i < size_of_side; ++i) x.push_back(at(i, 0.5, 2));
  for (std::size_t i = 0; i < size_of_side; ++i) x.push_back(std::exp(at(i, -700, 700)));
  const auto log_of = [](auto... a) { HWY_DYNAMIC_DISPATCH(LogOf)(a...); };
  EXPECT_LT(largest_error(x, log_of, [](long double v) { return std::log(v); }), 2e-16);
  const std::vector<double> ones(64, 1.0);
  std::vector<double> zeros(64, -1.0);
  log_of(ones.data(), ones.size(), zeros.data());
  EXPECT_EQ(zeros, std::vector<double>(64, 0.0));
}

}  // namespace
}  // namespace gamer
#endif
