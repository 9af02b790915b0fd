#include "render/march/node_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/each_simd_target.h"

namespace gamer::node_map_test {
namespace {

/// int rate / sqrt(1 + ((s - c)/w)^2) from `begin` to s.
double u_of(std::span<const Focus> focuses, double begin, double s) {
  double u = 0;
  for (const Focus& f : focuses) {
    u += f.rate * f.width *
         (std::asinh((s - f.centre) / f.width) - std::asinh((begin - f.centre) / f.width));
  }
  return u;
}

double density(std::span<const Focus> focuses, double s) {
  double rho = 0;
  for (const Focus& f : focuses) rho += f.rate / std::hypot(1.0, (s - f.centre) / f.width);
  return rho;
}

/// Nodes of one run: count of them at unit distances, from `shift` on.
struct Nodes {
  std::vector<float> s, weight;
  double step;
};

Nodes place(const NodeMap& map, std::int32_t run, std::int32_t count, double shift) {
  Nodes nodes;
  nodes.s.resize(static_cast<std::size_t>(count));
  nodes.weight.resize(nodes.s.size());
  nodes.step = map.length(static_cast<std::size_t>(run)) / (count - 1 + 2 * shift);
  const std::int32_t first = 0;
  const auto step = static_cast<float>(nodes.step);
  map.place({std::span(&run, 1), std::span(&first, 1), std::span(&count, 1), std::span(&step, 1),
             static_cast<float>(shift), nodes.s.data(), nodes.weight.data()});
  return nodes;
}

// A cusp, a layer, and several of them.
const std::vector<std::vector<Focus>> examples = {
    {{0.1, 1e-3, 1600}},
    {{-0.5, 0.1, 40}},
    {{0.45, 0.1, 40}, {-0.5, 0.02, 60}},
    {{0.1, 1e-3, 1600}, {0.3, 0.2, 30}, {-0.6, 0.05, 50}}};

NodeMap map_of_examples() {
  NodeMap map;
  for (const auto& focuses : examples) map.add(-1, 1, focuses);
  map.measure();
  return map;
}

TEST(NodeMapTest, NodesStandAtEqualDistancesOfU) {
  for_each_simd_target([] {
    const NodeMap map = map_of_examples();
    for (std::size_t run = 0; run < examples.size(); ++run) {
      if (examples[run].size() > 1) continue;  // other focuses reduce the rates
      const double length = u_of(examples[run], -1, 1);
      EXPECT_NEAR(map.length(run), length, 1e-5 * length);
      for (const double shift : {0.0, 0.5}) {
        const Nodes nodes = place(map, static_cast<std::int32_t>(run), 33, shift);
        for (std::size_t k = 0; k < nodes.s.size(); ++k) {
          const double u = (static_cast<double>(k) + shift) * nodes.step;
          EXPECT_NEAR(u_of(examples[run], -1, nodes.s[k]), u, 1e-3 * nodes.step + 2e-5 * length);
          EXPECT_NEAR(nodes.weight[k] * density(examples[run], nodes.s[k]) / nodes.step, 1, 1e-4);
        }
      }
    }
  });
}

// The weights are ds/du times the step, whatever rates are kept. Nodes half way between others
// stand on the cubics through these.
TEST(NodeMapTest, SeveralFocusesShareOneU) {
  for_each_simd_target([] {
    const NodeMap map = map_of_examples();
    for (std::size_t run = 2; run < examples.size(); ++run) {
      constexpr std::int32_t count = 257;
      const auto number = static_cast<std::int32_t>(run);
      const Nodes nodes = place(map, number, count, 0),
                  between = place(map, number, count - 1, 0.5);
      ASSERT_NEAR(between.step, nodes.step, 1e-9 * nodes.step);
      for (std::size_t k = 0; k + 1 < nodes.s.size(); ++k) {
        const double from = nodes.s[k], to = nodes.s[k + 1];
        const double cubic =
            0.5 * (from + to) + (double{nodes.weight[k]} - double{nodes.weight[k + 1]}) / 8;
        const double own = 0.5 * (double{nodes.weight[k]} + double{nodes.weight[k + 1]});
        EXPECT_NEAR(between.s[k], cubic, 8e-5 * own) << run << ' ' << k;
        EXPECT_NEAR(between.weight[k], 1.5 * (to - from) - 0.5 * own, 1.4e-4 * own);
      }
    }
  });
}

TEST(NodeMapTest, TrapezoidsConvergeSpectrally) {
  // int sech^2(s/h) ds = 2h, with nodes one h apart in the middle and farther outside.
  constexpr double h = 0.02;
  const std::vector<Focus> focuses = {{0.05, 1.5 * h, 1 / h}};
  NodeMap map;
  map.add(-0.3, 0.4, focuses);
  map.measure();
  double last = 1;
  for (const std::int32_t count : {9, 17, 33}) {
    const Nodes nodes = place(map, 0, count, 0);
    double sum = 0;
    for (std::size_t k = 0; k < nodes.s.size(); ++k) {
      sum += double{nodes.weight[k]} / std::pow(std::cosh((double{nodes.s[k]} - 0.05) / h), 2);
    }
    const double error = std::abs(sum / (2 * h) - 1);
    EXPECT_LT(error, std::max(last * last, 2e-6)) << count;
    last = error;
  }
}

TEST(NodeMapTest, SeveralFocusesShareARun) {
  NodeMap map;
  map.add(-1, 1, std::vector<Focus>{{0.45, 0.1, 40}, {-0.5, 0.02, 60}});
  map.measure();
  const Nodes nodes = place(map, 0, 65, 0);
  double length = 0;
  for (std::size_t k = 0; k < nodes.s.size(); ++k) {
    if (k > 0) {
      EXPECT_GT(nodes.s[k], nodes.s[k - 1]);
    }
    length += double{nodes.weight[k]} * (k == 0 || k == 64 ? 0.5 : 1);
    // Nodes are no farther apart than either focus asks for.
    for (const auto& [centre, rate] : {std::pair(0.45, 40.0), std::pair(-0.5, 60.0)}) {
      if (std::abs(double{nodes.s[k]} - centre) > 0.01) continue;
      EXPECT_LT(nodes.weight[k], 1.05 * nodes.step / rate);
    }
  }
  EXPECT_NEAR(length, 2, 2e-3);
}

// Pieces may be long: a cut finds the nodes between their bounds, too.
TEST(NodeMapTest, PiecesHaveEqualLengthsInU) {
  for_each_simd_target([] {
    NodeMap map;
    map.add(-1, 1, std::vector<Focus>{{0.0, 0.05, 40}, {0.4, 0.002, 900}, {-0.3, 0.01, 300}});
    map.measure();
    std::vector<float> bounds;
    for (const int pieces : {1, 2, 3, 7}) {
      map.cut(0, pieces, bounds);
      ASSERT_EQ(bounds.size(), static_cast<std::size_t>(pieces) + 1);
      constexpr std::int32_t fine = 64;
      const Nodes nodes = place(map, 0, fine * pieces + 1, 0);
      for (std::size_t k = 0; k < bounds.size(); ++k) {
        EXPECT_NEAR(bounds[k], nodes.s[fine * k], 1.2e-4 * double{nodes.weight[fine * k]})
            << pieces;
      }
    }
  });
}

TEST(NodeMapTest, RunsDoNotDependOnTheirNeighbours) {
  for_each_simd_target([&] {
    const NodeMap map = map_of_examples();
    std::vector<std::int32_t> runs, first, count;
    std::vector<float> step, s(17 * examples.size()), weight(s.size());
    for (std::size_t run = 0; run < examples.size(); ++run) {
      runs.push_back(static_cast<std::int32_t>(run));
      first.push_back(static_cast<std::int32_t>(17 * run));
      count.push_back(17);
      step.push_back(static_cast<float>(map.length(run) / 16));
    }
    map.place({runs, first, count, step, 0, s.data(), weight.data()});
    for (const std::int32_t run : runs) {
      const Nodes alone = place(map, run, 17, 0);
      for (std::size_t k = 0; k < 17; ++k) {
        EXPECT_EQ(alone.s[k], s[17 * static_cast<std::size_t>(run) + k]);
        EXPECT_EQ(alone.weight[k], weight[17 * static_cast<std::size_t>(run) + k]);
      }
    }
  });
}

TEST(NodeMapTest, SuperfluousFocusesAreLeftOut) {
  NodeMap alone, together;
  alone.add(-1, 1, std::vector<Focus>{{0, 0.1, 100}});
  together.add(-1, 1, std::vector<Focus>{{0, 0.1, 100}, {0.01, 0.1, 50}});
  alone.measure();
  together.measure();
  EXPECT_EQ(alone.length(0), together.length(0));
}

}  // namespace
}  // namespace gamer::node_map_test
