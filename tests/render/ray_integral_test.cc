#include "render/ray_integral.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/each_simd_target.h"

namespace gamer {
namespace {

/// Runs of sech^2 profiles of dust and light at equal distances, of different lengths, and what
/// comes of them.
class RunsTest : public testing::Test {
 protected:
  /// `from` in scale heights: where the run begins.
  void add(double from, int nodes, bool is_open) {
    const double step = (10 - from) / (nodes - 1);
    first_.push_back(static_cast<std::int32_t>(weight_.size()));
    count_.push_back(nodes);
    cover_.push_back(0);
    open_.push_back(is_open ? 1 : 0);
    for (int k = 0; k < nodes; ++k) {
      const double s = from + k * step;
      weight_.push_back(static_cast<float>(step));
      density_.push_back(static_cast<float>(1 / std::pow(std::cosh(s), 2)));
    }
  }

  void integrate() {
    const std::size_t stride = first_.size() + 64;
    light_.assign(2 * stride, 0);
    depth_.assign(2 * stride, 0);
    coarse_light_.assign(stride, 0);
    coarse_depth_.assign(stride, 0);
    const float* density = density_.data();
    const std::size_t steering_node = 1;
    const float flux = 2;
    integrate_runs(
        {first_.size(), first_.data(), count_.data(), cover_.data(), open_.data(), weight_.data(),
         &density, &density, 1, 1},
        {1, 2, extinction_, 1, &steering_node, &flux},
        {stride, light_.data(), depth_.data(), coarse_light_.data(), coarse_depth_.data()});
    stride_ = stride;
  }

  /// Of run i at spectral node j.
  double light(std::size_t i, std::size_t j) const { return double{light_[j * stride_ + i]}; }
  double depth(std::size_t i, std::size_t j) const { return double{depth_[j * stride_ + i]}; }

  static constexpr float extinction_[2] = {0.5f, 3};
  std::vector<std::int32_t> first_, count_, cover_;
  std::vector<std::uint8_t> open_;
  std::vector<float> weight_, density_, light_, depth_, coarse_light_, coarse_depth_;
  std::size_t stride_ = 0;
};

TEST_F(RunsTest, LightMixedWithDust) {
  // int e exp(-a int e) ds = (1 - exp(-a D))/a, D the integral of e.
  for_each_simd_target([this] {
    for (auto* v : {&first_, &count_, &cover_}) v->clear();
    open_.clear();
    weight_.clear();
    density_.clear();
    for (int i = 0; i < 19; ++i) add(-10, 41 + 10 * (i % 5), false);
    for (int i = 0; i < 5; ++i) add(0.3, 41 + 10 * i, true);
    integrate();
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const double whole = i < 19 ? 2 : 1 - std::tanh(0.3);
      for (std::size_t j = 0; j < 2; ++j) {
        const double a = double{extinction_[j]};
        EXPECT_NEAR(depth(i, j), a * whole, 1.4e-4 * a) << i;
        EXPECT_NEAR(light(i, j), (1 - std::exp(-a * whole)) / a, 1.2e-3) << i;
      }
      const double a = double{extinction_[1]};
      EXPECT_NEAR(coarse_light_[i], 2 * (1 - std::exp(-a * whole)) / a, 2e-2) << i;
      EXPECT_NEAR(coarse_depth_[i], a * whole, 2.5e-2) << i;
    }
  });
}

TEST_F(RunsTest, ARunDependsOnItselfAlone) {
  for (int i = 0; i < 40; ++i) add(-10, 21 + 2 * (i % 7), i % 3 == 0);
  integrate();
  const std::vector<float> together = light_;
  const std::size_t stride = stride_;
  for (int i = 0; i < 7; ++i) {
    for (auto* v : {&first_, &count_, &cover_}) v->clear();
    open_.clear();
    weight_.clear();
    density_.clear();
    add(-10, 21 + 2 * (i % 7), i % 3 == 0);
    integrate();
    EXPECT_EQ(light_[0], together[static_cast<std::size_t>(i)]);
    EXPECT_EQ(light_[stride_], together[stride + static_cast<std::size_t>(i)]);
  }
}

}  // namespace
}  // namespace gamer
