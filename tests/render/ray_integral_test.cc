#include "render/march/ray_integral.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "core/each_simd_target.h"

namespace gamer::ray_integral_test {
namespace {

/// Segments with sech^2 profiles of dust and light, with nodes at equal distances, and their
/// integrals. Cover 0 has a second slot with three times the light.
class SegmentsTest : public testing::Test {
 protected:
  /// Adds a segment from the height `from` to the height `to`, scale heights. Cover 1 has no dust.
  /// A segment that ends before height 10 has an open end.
  void add(double from, int nodes, bool is_open, bool has_variants = false, std::int32_t cover = 0,
           double to = 10) {
    const double step = (to - from) / (nodes - 1);
    first_.push_back(static_cast<std::int32_t>(weight_.size()));
    count_.push_back(nodes);
    cover_.push_back(cover);
    open_.push_back(is_open ? 1 : 0);
    open_end_.push_back(to < 10 ? 1 : 0);
    variants_.push_back(has_variants ? 1 : 0);
    for (int k = 0; k < nodes; ++k) {
      const double s = from + k * step;
      weight_.push_back(static_cast<float>(step));
      density_.push_back(static_cast<float>(1 / std::pow(std::cosh(s), 2)));
    }
  }

  void clear() {
    for (auto* v : {&first_, &count_, &cover_}) v->clear();
    open_.clear();
    open_end_.clear();
    variants_.clear();
    weight_.clear();
    density_.clear();
  }

  void integrate(bool is_first = true) {
    std::vector<std::int32_t> segment(first_.size());
    std::iota(segment.begin(), segment.end(), 0);
    if (is_first) steered_.assign(2 * planes * segment.size(), {});
    light_.assign(4 * segment.size(), 0);
    depth_.assign(2 * segment.size(), 0);
    transmission_.assign(2 * segment.size(), 0);
    // Slots that a cover lacks hold infinities, which must not count.
    const auto times = [&](float factor, bool is_everywhere) {
      std::vector<float> values;
      for (std::size_t i = 0; i < first_.size(); ++i) {
        for (std::int32_t n = 0; n < count_[i]; ++n) {
          const float density = density_[static_cast<std::size_t>(first_[i] + n)];
          values.push_back(is_everywhere || cover_[i] == 0 ? factor * density : HUGE_VALF);
        }
      }
      return with_padding(values);
    };
    const std::vector<float> weight = with_padding(weight_);
    const std::vector<float> once = times(1, true), more = times(3, false);
    const std::vector<float> dust_once = times(1, false), dust_twice = times(2, false);
    const float* light[] = {once.data(), more.data()};
    const float* dust[] = {dust_once.data(), dust_twice.data()};
    const std::int32_t light_slots[] = {2, 1}, dust_slots[] = {1, 0};
    const float extinction[] = {extinction_[0], 0, extinction_[1], 0};
    const SegmentNodes segments{first_.size(),
                                first_.data(),
                                count_.data(),
                                cover_.data(),
                                open_.data(),
                                open_end_.data(),
                                variants_.data(),
                                weight.data(),
                                light,
                                dust,
                                1,
                                variant_weights_};
    const float flux[] = {flux_[0],   flux_[0], flux_[1],   flux_[1], flux_[2],   flux_[2],
                          second_[0], 0,        second_[1], 0,        second_[2], 0};
    const SegmentCovers covers{2, 2, steering, light_slots, dust_slots, extinction, flux};
    std::vector<std::uint32_t> order;
    order_segments(segments, covers, order);
    integrate_segments(
        segments, covers, order, is_first,
        {segment.data(), 2, light_.data(), depth_.data(), transmission_.data(), steered_.data()});
  }

  /// Light of segment i at spectral node j.
  double light(std::size_t i, std::size_t j) const { return double{light_[4 * i + j]}; }
  double depth(std::size_t i, std::size_t j) const { return double{depth_[2 * i + j]}; }
  double transmission(std::size_t i, std::size_t j) const {
    return double{transmission_[2 * i + j]};
  }

  /// The segments by every `stride`-th of their nodes.
  void thin_out(std::int32_t stride) {
    std::vector<float> weight, density;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const auto begin = static_cast<std::int32_t>(weight.size());
      for (std::int32_t n = 0; n < count_[i]; n += stride) {
        const auto at = static_cast<std::size_t>(first_[i] + n);
        weight.push_back(static_cast<float>(stride) * weight_[at]);
        density.push_back(density_[at]);
      }
      first_[i] = begin;
      count_[i] = static_cast<std::int32_t>(weight.size()) - begin;
    }
    weight_ = weight;
    density_ = density;
  }

  /// Adds infinities behind the last node, which must not count.
  static std::vector<float> with_padding(std::vector<float> values) {
    values.resize(values.size() + SegmentNodes::padding, HUGE_VALF);
    return values;
  }

  static constexpr std::size_t planes = 3;
  static constexpr std::size_t steering[planes] = {1, 0, 1};
  // Powers of 2: products with them are exact, with fused operations and without.
  static constexpr float flux_[planes] = {2, 0.5f, 1}, second_[planes] = {0.25f, 4, 8};
  static constexpr float extinction_[2] = {0.5f, 3};
  std::vector<std::int32_t> first_, count_, cover_;
  static constexpr double variant_weights_[2] = {0.75, 0.25};
  std::vector<std::uint8_t> open_, open_end_, variants_;
  std::vector<float> weight_, density_, light_, depth_, transmission_;
  std::vector<Steered> steered_;
};

TEST_F(SegmentsTest, LightMixedWithDust) {
  // int e exp(-a int e) ds = (1 - exp(-a D))/a, D the integral of e.
  for_each_simd_target([this] {
    clear();
    for (int i = 0; i < 19; ++i) add(-10, 41 + 10 * (i % 5), false);
    for (int i = 0; i < 5; ++i) add(0.3, 41 + 10 * i, true);
    for (const std::int32_t stride : {1, 2}) {
      thin_out(stride);
      integrate();
      const double light_error = stride == 1 ? 1.2e-3 : 1e-2;
      const double depth_error = stride == 1 ? 1.4e-4 : 8e-3;
      for (std::size_t i = 0; i < first_.size(); ++i) {
        const double whole = i < 19 ? 2 : 1 - std::tanh(0.3);
        for (std::size_t j = 0; j < 2; ++j) {
          const double a = double{extinction_[j]};
          EXPECT_NEAR(depth(i, j), a * whole, depth_error * a) << i;
          EXPECT_NEAR(light(i, j), (1 - std::exp(-a * whole)) / a, light_error) << i;
          EXPECT_NEAR(transmission(i, j), std::exp(-depth(i, j)), 1e-6) << i;
        }
      }
    }
  });
}

TEST_F(SegmentsTest, SteeringComparesAllNodesWithEverySecondAndFourth) {
  for_each_simd_target([this] {
    for (const bool has_dust : {true, false}) {
      clear();
      for (int i = 0; i < 37; ++i) {
        add(i % 3 == 0 ? 0.3 : -10, 33 + 2 * (i % 29), i % 3 == 0, i % 4 == 1,
            has_dust && i % 5 != 0 ? 0 : 1);
      }
      integrate();
      const std::vector<Steered> steered = steered_;
      const auto integrals = [&] {
        std::vector<float> values;
        for (std::size_t i = 0; i < first_.size(); ++i) {
          for (std::size_t s = 0; s < planes; ++s) {
            const float* light = light_.data() + 4 * i + steering[s];
            const float first = flux_[s] * light[0];
            values.push_back(cover_[i] == 0 ? std::fma(second_[s], light[2], first) : first);
          }
          for (const std::size_t j : steering) values.push_back(depth_[2 * i + j]);
        }
        return values;
      };
      const std::vector<float> fine = integrals();
      thin_out(2);
      integrate();
      const std::vector<float> middle = integrals();
      thin_out(2);
      integrate();
      const std::vector<float> coarse = integrals();
      for (std::size_t k = 0; k < steered.size(); ++k) {
        // The rules by every second and fourth node add up slots before nodes: sums of up to 89
        // numbers, each rounded to 6e-8.
        const double rounding = 6.5e-7 * double{fine[k]};
        EXPECT_EQ(steered[k].value, fine[k]);
        EXPECT_NEAR(steered[k].change, std::abs(fine[k] - middle[k]), rounding);
        EXPECT_NEAR(steered[k].earlier_change, std::abs(middle[k] - coarse[k]), rounding);
      }
    }
  });
}

TEST_F(SegmentsTest, SteeringGoesOnFromWhatItHad) {
  for_each_simd_target([this] {
    clear();
    for (int i = 0; i < 20; ++i) add(-10, 21 + 2 * (i % 7), false);
    integrate();
    const std::vector<Steered> before = steered_;
    clear();
    for (int i = 0; i < 20; ++i) add(-10, 41 + 4 * (i % 7), false);
    integrate(false);
    for (std::size_t k = 0; k < before.size(); ++k) {
      EXPECT_EQ(steered_[k].change, std::abs(steered_[k].value - before[k].value));
      EXPECT_EQ(steered_[k].earlier_change, before[k].change);
    }
  });
}

TEST_F(SegmentsTest, PiecesWithOpenEnds) {
  // Pieces of 17 nodes, half a scale height each, follow each other from -3 to 3.
  for_each_simd_target([this] {
    clear();
    const auto begin_of = [](std::size_t i) { return -3 + 0.5 * static_cast<double>(i); };
    for (std::size_t i = 0; i < 12; ++i) {
      add(begin_of(i), 17, true, i % 3 == 0, i % 4 == 3 ? 1 : 0, begin_of(i + 1));
    }
    integrate();
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const double whole = std::tanh(begin_of(i + 1)) - std::tanh(begin_of(i));
      const double second = i % 3 == 0 ? variant_weights_[1] : 0;
      for (std::size_t j = 0; j < 2; ++j) {
        const double a = cover_[i] == 0 ? double{extinction_[j]} : 0;
        const auto light_of = [&](double x) { return x > 0 ? -std::expm1(-x * whole) / x : whole; };
        EXPECT_NEAR(depth(i, j), (1 + second) * a * whole, 4e-6 * whole) << i;
        EXPECT_NEAR(light(i, j), (1 - second) * light_of(a) + second * light_of(2 * a),
                    4e-6 * whole)
            << i;
      }
      for (std::size_t s = 0; s < planes; ++s) {
        const Steered& steered = steered_[i * 2 * planes + s];
        EXPECT_LT(double{steered.change}, 2e-3 * double{steered.value}) << i;
        EXPECT_EQ(steered.missed, 0) << i;
      }
    }
  });
}

TEST_F(SegmentsTest, LightBetweenNodesThatDustHidesIsBounded) {
  // Nodes 20 scale heights / 14 apart step over the skin of thick dust, where the light comes from.
  for_each_simd_target([this] {
    clear();
    for (int i = 0; i < 9; ++i) add(-10, 15, false, false, i % 2);
    for (float& density : density_) density *= 1e3f;
    integrate();
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const Steered& steered = steered_[i * 2 * planes];
      if (cover_[i] == 1) {
        EXPECT_EQ(steered.missed, 0) << i;
        continue;
      }
      const double skin = double{flux_[0]} / double{extinction_[1]};
      EXPECT_GT(double{steered.missed}, 0.1 * skin) << i;
      EXPECT_GT(steered.error(1, false), double{steered.missed} * (1 - 1e-6)) << i;
    }
  });
}

TEST_F(SegmentsTest, SegmentsWithoutDustBesideDustyOnes) {
  for_each_simd_target([this] {
    clear();
    for (int i = 0; i < 37; ++i) add(-10, 81, false, false, i % 2);
    integrate();
    for (std::size_t i = 0; i < first_.size(); ++i) {
      for (std::size_t j = 0; j < 2; ++j) {
        const double a = i % 2 == 0 ? double{extinction_[j]} : 0.0;
        EXPECT_NEAR(depth(i, j), 2 * a, 3e-6 * a) << i;
        EXPECT_NEAR(light(i, j), a > 0 ? (1 - std::exp(-2 * a)) / a : 2.0, 8e-5) << i;
        if (a == 0) {
          EXPECT_EQ(transmission(i, j), 1) << i;
        }
      }
    }
  });
}

TEST_F(SegmentsTest, VariantsOfDust) {
  // The second variant's dust is twice the first's.
  for_each_simd_target([this] {
    clear();
    for (int i = 0; i < 37; ++i) add(-10, 81, false, i % 2 == 0);
    integrate();
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const double second = i % 2 == 0 ? variant_weights_[1] : 0;
      for (std::size_t j = 0; j < 2; ++j) {
        const double a = double{extinction_[j]};
        const auto mean = [&](auto of) { return (1 - second) * of(a) + second * of(2 * a); };
        EXPECT_NEAR(depth(i, j), mean([](double x) { return 2 * x; }), 3e-6 * a) << i;
        EXPECT_NEAR(transmission(i, j), mean([](double x) { return std::exp(-2 * x); }), 3e-6) << i;
        EXPECT_NEAR(light(i, j), mean([](double x) { return (1 - std::exp(-2 * x)) / x; }), 8e-5)
            << i;
      }
    }
  });
}

TEST_F(SegmentsTest, ASegmentDependsOnItselfAlone) {
  for_each_simd_target([this] {
    clear();
    const auto add_one = [&](int i) {
      add(-10, 21 + 2 * (i % 23), i % 3 == 0, i % 4 == 1, i % 5 == 0 ? 1 : 0);
    };
    for (int i = 0; i < 80; ++i) add_one(i);
    integrate();
    const std::vector<float> light = light_, depth = depth_, transmission = transmission_;
    const std::vector<Steered> steered = steered_;
    for (std::size_t i = 0; i < 80; ++i) {
      clear();
      add_one(static_cast<int>(i));
      integrate();
      for (std::size_t j = 0; j < 2; ++j) {
        EXPECT_EQ(light_[j], light[4 * i + j]);
        if (cover_[0] == 0) {
          EXPECT_EQ(light_[2 + j], light[4 * i + 2 + j]);
        }
        EXPECT_EQ(depth_[j], depth[2 * i + j]);
        EXPECT_EQ(transmission_[j], transmission[2 * i + j]);
      }
      for (std::size_t k = 0; k < 2 * planes; ++k) {
        const Steered& among_others = steered[2 * planes * i + k];
        EXPECT_EQ(steered_[k].value, among_others.value);
        EXPECT_EQ(steered_[k].change, among_others.change);
        EXPECT_EQ(steered_[k].earlier_change, among_others.earlier_change);
      }
    }
  });
}

}  // namespace
}  // namespace gamer::ray_integral_test
