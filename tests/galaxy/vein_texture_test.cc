// Veins close after a turn, and are those of the class comment and of docs/facts.md section 8.

#include "galaxy/veins/vein_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"

namespace gamer::vein_texture_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr double thickness = 0.024;

/// beta = 1.38.
const std::string m51_arms = "model = \"logarithmic\"\npitch_angle = 17.853\n";
const std::string barred_arms =
    "model = \"ringermacher-mead\"\nwinding_b = 20\nwinding_n = 1.5\nscale = 1.6\n";

VeinParameters plain() {
  VeinParameters p;
  p.small_kind = &simplex_noise();
  p.displacement = 0;
  p.noise_contrast = 0;
  p.spur_variation = 0;
  return p;
}

VeinParameters rich() {
  VeinParameters p;
  p.small_kind = &simplex_noise();
  return p;
}

VeinTexture texture(const VeinParameters& p, const std::string& arms = m51_arms) {
  return VeinTexture(p, SpiralCoordinates(arms_of(arms), 0), thickness);
}

struct Sample {
  double displacement, arms, spurs, veins, noise, phi;
};

std::vector<Sample> sample(const VeinTexture& veins, const std::vector<Vector>& positions) {
  std::vector<Sample> result;
  for (std::size_t first = 0; first < positions.size(); first += batch_capacity) {
    BatchArray x{}, y{}, z{}, phi;
    const std::size_t size = std::min(batch_capacity, positions.size() - first);
    for (std::size_t i = 0; i < size; ++i) {
      x[i] = static_cast<float>(positions[first + i][0]);
      y[i] = static_cast<float>(positions[first + i][1]);
      z[i] = static_cast<float>(positions[first + i][2]);
    }
    const Points points{x.data(), y.data(), z.data(), size};
    VeinTexture::Parts parts;
    std::uint64_t evaluations = 0;
    veins.parts(points, parts);
    veins.evaluate(points, nullptr, nullptr, {}, std::span(&phi, 1), evaluations);
    for (std::size_t i = 0; i < size; ++i) {
      result.push_back({parts.displacement[i], parts.arms[i], parts.spurs[i], parts.veins[i],
                        parts.noise[i], phi[i]});
    }
  }
  return result;
}

/// The place of (u, v) in the plane, for arms without shift and offset whose angle grows outwards.
Vector position(const SpiralCoordinates& c, double u, double v) {
  // u/n - v/n' grows with ln r and does not depend on theta.
  const auto sum = [&](double s) {
    const auto here = c.at(std::exp(s), 0);
    return here.u / c.count() - here.v / c.cycle();
  };
  double low = -30, high = 30;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (sum(middle) < u / c.count() - v / c.cycle() ? low : high) = middle;
  }
  const double r = std::exp(low), theta = 2 * pi * (c.at(r, 0).u - u) / c.count();
  return {r * std::cos(theta), r * std::sin(theta), 0};
}

/// There is no seam for any n', spur rate, stretch, number of arms, or in a bar.
TEST(VeinTexture, ClosesAcrossTheCutOfTheAzimuth) {
  for (const std::string& arms : {m51_arms, m51_arms + "count = 3\n",
                                  m51_arms + "count = 1\nhandedness = -1\n", barred_arms}) {
    for (const double stretch : {1.0, 3.0, 7.3}) {
      VeinParameters p = rich();
      p.anisotropy = stretch;
      p.anisotropy_angle = 20 * stretch;
      p.spur_number = 7.77 * stretch;
      p.spur_length = 0.9 * std::min(stretch, 3.0);
      const VeinTexture veins = texture(p, arms);
      // The cut is where the first arm's angle is pi: along -x.
      const double offset = arms_of(arms).offsets().front();
      ASSERT_EQ(offset, 0);
      for_each_simd_target([&] {
        std::vector<Vector> above, below;
        for (int i = 0; i < 4000; ++i) {
          const double r = 0.02 + 0.97 * i / 4000;
          const double z = 0.03 * std::sin(0.7 * i);
          above.push_back({-r, 1e-12, z});
          below.push_back({-r, -1e-12, z});
        }
        const auto here = sample(veins, above);
        const auto there = sample(veins, below);
        double worst = 0, most = 0;
        for (std::size_t i = 0; i < here.size(); ++i) {
          worst = std::max(worst, std::abs(here[i].phi - there[i].phi));
          most = std::max(most, here[i].phi);
        }
        EXPECT_LT(worst / most, 1e-5) << arms << stretch;
      });
    }
  }
}

/// The jump of a function at 0: the difference of straight lines fitted on both sides.
double jump(const std::function<double(double)>& f, double step) {
  constexpr int count = 60;
  double result = 0;
  for (const double side : {1.0, -1.0}) {
    double x = 0, xx = 0, y = 0, xy = 0;
    for (int i = 0; i < count; ++i) {
      const double h = (i + 0.5) / count;
      const double value = f(side * h * step);
      x += h / count;
      xx += h * h / count;
      y += value / count;
      xy += h * value / count;
    }
    result += side * (y - x * (xy - x * y) / (xx - x * x));
  }
  return result;
}

TEST(VeinTexture, HasNoEdgeWhereAnIndexChanges) {
  VeinParameters p = plain();
  p.spur_variation = 0.7;
  p.spur_length = 1.7;
  const VeinTexture veins = texture(p);
  const SpiralCoordinates& c = veins.coordinates();
  const auto v_at = [&](double u, double v) { return sample(veins, {position(c, u, v)})[0].veins; };
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    // At arms floor(u) changes, and along v the number of the spur.
    const double v = -1 + 0.013 * i;
    worst = std::max(worst, std::abs(jump([&](double h) { return v_at(h, v); }, 1e-4)));
    const double u = 0.05 + 0.003 * i;
    worst = std::max(worst, std::abs(jump([&](double h) { return v_at(u, v + h); }, 1e-4)));
  }
  EXPECT_LT(worst, 1e-5);
}

TEST(VeinTexture, ArmsAreGaussiansOfPeriodOne) {
  VeinParameters p = plain();
  p.vein_width = 0.1;
  const VeinTexture veins = texture(p);
  const SpiralCoordinates& c = veins.coordinates();
  double mean = 0;
  constexpr int steps = 200;
  for (int i = 0; i < steps; ++i) {
    const double u = -1 + 2.0 * (i + 0.5) / steps;
    const double expected = std::exp((std::cos(2 * pi * u) - 1) / (4 * pi * pi * 0.01));
    const double found = sample(veins, {position(c, u, 0.3)})[0].arms;
    EXPECT_NEAR(found, expected, 1e-5);
    mean += found / steps;
  }
  EXPECT_NEAR(mean, 0.2680, 1e-4);
}

/// The v of the spur's crest next to `guess` at distance u from arm 0.
double crest(const VeinTexture& veins, double u, double guess) {
  const SpiralCoordinates& c = veins.coordinates();
  double low = guess - 0.1, high = guess + 0.1;
  for (int i = 0; i < 40; ++i) {
    const double a = low + 0.382 * (high - low), b = low + 0.618 * (high - low);
    const auto found = sample(veins, {position(c, u, a), position(c, u, b)});
    (found[0].spurs > found[1].spurs ? high : low) = found[0].spurs > found[1].spurs ? b : a;
  }
  return 0.5 * (low + high);
}

TEST(VeinTexture, SpursLeaveArmsAtTheirAngleAndCurl) {
  for (const double angle : {60.0, 35.0, 110.0}) {
    VeinParameters p = plain();
    p.vein_width = 0.02;
    p.spur_angle = angle;
    const VeinTexture veins = texture(p);
    const SpiralCoordinates& c = veins.coordinates();
    // A crest at u = 0.04, followed outwards.
    double best = 0;
    for (int i = 0; i < 400; ++i) {
      const double v = -1 + 0.005 * i;
      if (sample(veins, {position(c, 0.04, v)})[0].spurs >
          sample(veins, {position(c, 0.04, best)})[0].spurs) {
        best = v;
      }
    }
    const double v1 = crest(veins, 0.04, best);
    const double v2 = crest(veins, 0.08, v1 - 0.04 / std::tan(angle * degree));
    // v = const - u cot(angle) - curvature u^2: the slope at the arm itself.
    const double slope = -(v2 - v1) / 0.04 - p.spur_curvature * 0.12;
    EXPECT_NEAR(std::atan2(1, slope) / degree, angle, 0.5);
    // Distances in the galaxy: between the crest near the arm and the arm.
    if (angle == 60) {
      for (const auto& [u, expected] : {std::pair{0.5, 21.2}, std::pair{0.9, 13.4}}) {
        double guess = v1;
        for (double at = 0.04; at < u; at += 0.02) {
          guess -= 0.02 * (1 / std::tan(angle * degree) + 4 * at);
        }
        const double before = crest(veins, u - 0.01, guess + 0.02);
        const double after = crest(veins, u + 0.01, guess - 0.02);
        const Vector a = position(c, u - 0.01, before), b = position(c, u + 0.01, after);
        const Vector middle = position(c, u, 0.5 * (before + after));
        const Vector along = position(c, u, 0.5 * (before + after) - 1e-4);
        const double spur = std::atan2(b[1] - a[1], b[0] - a[0]);
        const double arm = std::atan2(along[1] - middle[1], along[0] - middle[0]);
        EXPECT_NEAR(std::abs(std::remainder(spur - arm, 2 * pi)) / degree, expected, 0.5) << u;
      }
    }
  }
}

TEST(VeinTexture, SpursAreCountedPerTurnAndFade) {
  VeinParameters p = plain();
  p.spur_number = 17.3;
  p.spur_length = 0.8;
  const VeinTexture veins = texture(p);
  const SpiralCoordinates& c = veins.coordinates();
  const double tangent = c.reference_tangent();
  const double turn = c.cycle() * (1 + tangent * tangent);
  std::vector<Vector> along;
  constexpr int steps = 20000;
  for (int i = 0; i < steps; ++i) along.push_back(position(c, 0.3, 2 + turn * i / steps));
  const auto found = sample(veins, along);
  int crests = 0;
  double highest = 0;
  for (int i = 1; i + 1 < steps; ++i) {
    const auto k = static_cast<std::size_t>(i);
    crests += found[k].spurs > found[k - 1].spurs && found[k].spurs >= found[k + 1].spurs &&
                      found[k].spurs > 0.3
                  ? 1
                  : 0;
    highest = std::max(highest, found[k].spurs);
  }
  EXPECT_NEAR(crests, 17.3, 1);
  EXPECT_NEAR(highest, p.spur_strength * std::pow(1 - std::pow(0.3 / 0.8, 2), 2), 2e-3);
  for (const double u : {0.81, 0.95}) {
    for (int i = 0; i < 50; ++i) {
      EXPECT_EQ(sample(veins, {position(c, u, 0.1 * i)})[0].spurs, 0);
    }
  }
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
  const auto n = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ma += a[i] / n;
    mb += b[i] / n;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
    ab += (a[i] - ma) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

TEST(VeinTexture, DoesNotRepeatAlongTheArm) {
  // On a torus with the periods n and n' it would repeat at v + n'.
  VeinParameters p = rich();
  p.displacement = 0.2;
  p.isotropic_scale = 1e-3;
  const VeinTexture veins = texture(p);
  const SpiralCoordinates& c = veins.coordinates();
  std::vector<Vector> here, there;
  for (int i = 0; i < 2000; ++i) {
    const double u = -0.5 + 0.9 * to_unit(hash_words({1, static_cast<std::uint64_t>(i)}));
    const double v = 0.5 + 6 * to_unit(hash_words({2, static_cast<std::uint64_t>(i)}));
    here.push_back(position(c, u, v));
    there.push_back(position(c, u, v + c.cycle()));
  }
  const auto a = sample(veins, here), b = sample(veins, there);
  std::vector<double> n1, n2, d1, d2;
  for (std::size_t i = 0; i < a.size(); ++i) {
    n1.push_back(std::log(a[i].noise + 1e-3));
    n2.push_back(std::log(b[i].noise + 1e-3));
    d1.push_back(a[i].displacement);
    d2.push_back(b[i].displacement);
  }
  EXPECT_LT(std::abs(correlation(n1, n2)), 0.25);
  EXPECT_LT(std::abs(correlation(d1, d2)), 0.25);
  EXPECT_NEAR(correlation(n1, n1), 1, 1e-12);
}

TEST(VeinTexture, DisplacementHasItsRms) {
  VeinParameters p = plain();
  p.displacement = 0.2;
  const VeinTexture veins = texture(p);
  std::vector<Vector> positions;
  for (std::uint64_t i = 0; i < 40000; ++i) {
    const auto u = [&](std::uint64_t k) { return to_unit(hash_words({i, k})); };
    const double r = std::exp(-2.5 * u(0));
    positions.push_back({r * std::cos(2 * pi * u(1)), r * std::sin(2 * pi * u(1)), 2 * r * u(2)});
  }
  double squares = 0;
  for (const Sample& s : sample(veins, positions)) squares += s.displacement * s.displacement;
  EXPECT_NEAR(std::sqrt(squares / 40000) / 0.2, 1, 0.1);
}

std::vector<WeightedBatch> cloud_of(const std::string& component) {
  const auto galaxy = parse_galaxy("[arms]\n" + m51_arms + component);
  return galaxy->components()[0]->cloud(std::size_t{1} << 16).all();
}

TEST(VeinTexture, DeviationsAverageToWhatIsExpected) {
  const std::string disk = "[[component]]\nclass = \"veins\"\nz0 = 0.012\nrh = 0.3\noctaves = 1\n";
  const auto cloud = cloud_of(disk);
  for (const double clumpiness : {1.0, 6.0}) {
    VeinParameters p = rich();
    p.clumpiness = clumpiness;
    VeinTexture veins = texture(p);
    veins.normalise(cloud, {});
    for (const double width : {0.0, 0.002, 0.005, 0.013, 0.03, 0.08, 0.2, 0.5, 1.5}) {
      BatchArray footprints;
      std::fill_n(footprints.data(), batch_capacity, static_cast<float>(width));
      std::vector<BatchArray> all(cloud.size()), together(cloud.size());
      const std::vector<double> deviations = {0, std::sqrt(3.0), -std::sqrt(3.0)};
      std::uint64_t evaluations = 0;
      for (std::size_t b = 0; b < cloud.size(); ++b) {
        veins.evaluate(cloud[b].points(), footprints.data(), nullptr, {}, std::span(&all[b], 1),
                       evaluations);
        std::vector<BatchArray> variants(3);
        veins.evaluate(cloud[b].points(), footprints.data(), nullptr, deviations, variants,
                       evaluations);
        for (std::size_t i = 0; i < cloud[b].size; ++i) {
          together[b][i] = (4 * variants[0][i] + variants[1][i] + variants[2][i]) / 6;
          EXPECT_NEAR(together[b][i], all[b][i], 2e-5 * all[b][i]);
        }
      }
    }
  }
}

TEST(VeinTexture, WhatFootprintsSeeDoesNotDependOnOthers) {
  const std::string disk = "[[component]]\nclass = \"veins\"\nz0 = 0.012\nrh = 0.3\noctaves = 1\n";
  const auto cloud = cloud_of(disk);
  constexpr float widths[] = {0, 0.002f, 0.013f, 0.08f, 0.5f};
  std::array<BatchArray, std::size(widths)> footprints;
  std::array<const float*, std::size(widths)> sets;
  for (std::size_t w = 0; w < sets.size(); ++w) {
    std::fill_n(footprints[w].data(), batch_capacity, widths[w]);
    sets[w] = footprints[w].data();
  }
  const std::vector<double> deviations = {0, std::sqrt(3.0), -std::sqrt(3.0)};
  for (const double clumpiness : {1.0, 6.0}) {
    VeinParameters p = rich();
    p.clumpiness = clumpiness;
    VeinTexture veins = texture(p);
    veins.normalise(cloud, {});
    const Points points = cloud[cloud.size() / 2].points();
    std::uint64_t evaluations = 0;
    std::array<SeenNoise, std::size(widths)> seen;
    veins.see(points, sets, true, seen, evaluations);
    for (std::size_t w = 0; w < sets.size(); ++w) {
      std::array<BatchArray, 3> together, alone;
      veins.expect(points.size, seen[w], nullptr, deviations, together);
      SeenNoise one;
      veins.see(points, std::span(sets).subspan(w, 1), true, std::span(&one, 1), evaluations);
      veins.expect(points.size, one, nullptr, deviations, alone);
      for (std::size_t k = 0; k < together.size(); ++k) {
        for (std::size_t i = 0; i < points.size; ++i) {
          EXPECT_NEAR(together[k][i], alone[k][i], 1e-5 * alone[k][i]);
        }
      }
    }
  }
}

TEST(VeinTexture, WidensVeinsAsTheMeanOverTheFootprint) {
  // The expected value is the mean over a square of the footprint's side.
  const auto cloud = cloud_of("[[component]]\nclass = \"veins\"\noctaves = 1\nrh = 0.3\n");
  VeinParameters p = plain();
  p.octaves = 4;
  VeinTexture veins = texture(p);
  veins.normalise(cloud, {});
  constexpr double width = 0.06;
  constexpr int side = 12;
  double worst = 0, squares = 0;
  constexpr int places = 300;
  for (std::uint64_t i = 0; i < places; ++i) {
    const double r = 0.15 + 0.6 * to_unit(hash_words({i, 0}));
    const double phi = 2 * pi * to_unit(hash_words({i, 1}));
    const Vector centre = {r * std::cos(phi), r * std::sin(phi), 0};
    std::vector<Vector> square;
    for (int k = 0; k < side * side; ++k) {
      square.push_back({centre[0] + width * ((k % side + 0.5) / side - 0.5),
                        centre[1] + width * ((k / side + 0.5) / side - 0.5), 0});
    }
    double mean = 0;
    for (const Sample& s : sample(veins, square)) mean += s.phi / (side * side);
    BatchArray x{}, y{}, z{}, footprint{}, out;
    x[0] = static_cast<float>(centre[0]);
    y[0] = static_cast<float>(centre[1]);
    footprint[0] = static_cast<float>(width);
    std::uint64_t evaluations = 0;
    veins.evaluate({x.data(), y.data(), z.data(), 1}, footprint.data(), nullptr, {},
                   std::span(&out, 1), evaluations);
    worst = std::max(worst, std::abs(double{out[0]} - mean));
    squares += std::pow(double{out[0]} - mean, 2) / places;
  }
  EXPECT_LT(std::sqrt(squares), 0.12);
  EXPECT_LT(worst, 0.6);
}

std::string veins_text(const std::string& kind, const std::string& rest) {
  return "[arms]\n" + m51_arms + "[[component]]\nclass = \"" + kind + "\"\n" +
         (kind == "veins" ? "" : "sed = \"flat\"\n") + rest;
}

TEST(Veins, KeepTheLight) {
  for (const std::string kind : {"veins", "veins_light"}) {
    std::vector<std::shared_ptr<const Galaxy>> galaxies;
    for (const std::uint64_t seed : {1u, 2u}) {
      galaxies.push_back(parse_galaxy(veins_text(kind, ""), settings_with(seed)));
    }
    const std::vector<double> light = integrate(galaxies, {0.02, 200, 500, 16});
    for (std::size_t g = 0; g < galaxies.size(); ++g) {
      const Component& own = *galaxies[g]->components()[0];
      EXPECT_NEAR(light[g] / (own.amplitude() * own.envelope_integral()), 1, 0.01) << kind;
    }
  }
}

TEST(Veins, OpticalDepthIsThatOfTheMeanThroughTheMiddle) {
  const auto galaxy = parse_galaxy(veins_text("veins", "optical_depth = 2.5\nz0 = 0.03\n"));
  EXPECT_NEAR(galaxy->components()[0]->amplitude(), 2.5 / 0.06, 1e-9);
  EXPECT_TRUE(galaxy->components()[0]->absorbs());
}

TEST(Veins, TargetsAgree) {
  const auto galaxy = parse_galaxy(veins_text("veins", ""));
  std::vector<Vector> positions;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const auto u = [&](std::uint64_t k) { return 2 * to_unit(hash_words({i, k})) - 1; };
    positions.push_back({0.7 * u(0), 0.7 * u(1), 0.03 * u(2)});
  }
  use_simd_targets(simd_targets().back());
  const auto scalar = evaluate(*galaxy, positions, 1e-4f)[0];
  use_simd_targets(0);
  const float largest = *std::max_element(scalar.begin(), scalar.end());
  for_each_simd_target([&] {
    const auto found = evaluate(*galaxy, positions, 1e-4f)[0];
    double worst = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      worst = std::max(worst, double{std::abs(found[i] - scalar[i])} / largest);
    }
    EXPECT_LT(worst, 5e-5);
  });
}

TEST(Veins, OfOnePatternCoincide) {
  // Two components of one galaxy have equal veins and different noise.
  const auto galaxy = parse_galaxy(
      veins_text("veins", "name = \"a\"\n") +
      "[[component]]\nclass = \"veins_light\"\nsed = \"flat\"\nname = \"b\"\nclumpiness = 1\n" +
      "[[component]]\nclass = \"veins_light\"\nsed = \"flat\"\nname = \"c\"\npattern_seed = 2\n");
  std::vector<Vector> positions;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const auto u = [&](std::uint64_t k) { return 2 * to_unit(hash_words({i, k})) - 1; };
    positions.push_back({0.6 * u(0), 0.6 * u(1), 0});
  }
  std::vector<std::vector<double>> displacement, noise;
  for (const auto& component : galaxy->components()) {
    displacement.emplace_back();
    noise.emplace_back();
    for (const Sample& s :
         sample(dynamic_cast<const VeinTexture&>(*component->texture()), positions)) {
      displacement.back().push_back(s.displacement);
      noise.back().push_back(std::log(s.noise + 1e-3));
    }
  }
  EXPECT_EQ(displacement[0], displacement[1]);
  EXPECT_LT(std::abs(correlation(displacement[0], displacement[2])), 0.3);
  EXPECT_LT(std::abs(correlation(noise[0], noise[1])), 0.2);
}

TEST(Veins, Errors) {
  EXPECT_EQ(galaxy_error("[[component]]\nclass = \"veins\"\n"),
            "g.toml:1:1: component 'veins1': veins need [arms] with a model and at least one arm");
  EXPECT_EQ(galaxy_error("[arms]\nmodel = \"logarithmic\"\noffsets = [0, 100]\n"
                         "[[component]]\nclass = \"veins\"\n"),
            "g.toml:4:1: component 'veins1': veins need arms that are evenly spread");
}

}  // namespace
}  // namespace gamer::vein_texture_test
