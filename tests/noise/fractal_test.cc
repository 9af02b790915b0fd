#include "gamer/noise/fractal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "core/error_text.h"
#include "core/parameter_ends.h"
#include "noise/evaluate.h"

namespace gamer::fractal_test {
namespace {

FractalParameters parameters_of(const Noise& kind) {
  FractalParameters p;
  p.kind = &kind;
  p.seed = 17;
  return p;
}

std::vector<double> raw_sum(const FractalNoise& noise, const std::vector<Vector>& positions) {
  std::vector<double> result;
  for_each_batch(positions, [&](const Points& points, std::size_t) {
    BatchArray out;
    noise.sum(points, out.data());
    result.insert(result.end(), out.data(), out.data() + points.size);
  });
  return result;
}

std::vector<double> phi_of(const FractalNoise& noise, const std::vector<Vector>& positions) {
  std::vector<double> result;
  for_each_batch(positions, [&](const Points& points, std::size_t) {
    BatchArray out;
    noise.evaluate(points, out.data());
    result.insert(result.end(), out.data(), out.data() + points.size);
  });
  return result;
}

std::vector<WeightedBatch> cloud_of(const std::vector<Vector>& positions,
                                    const std::function<double(const Vector&)>& weight) {
  std::vector<WeightedBatch> cloud;
  for_each_batch(positions, [&](const Points& points, std::size_t first) {
    WeightedBatch& batch = cloud.emplace_back();
    batch.size = points.size;
    for (std::size_t i = 0; i < points.size; ++i) {
      batch.x[i] = points.x[i];
      batch.y[i] = points.y[i];
      batch.z[i] = points.z[i];
      batch.weight[i] = static_cast<float>(weight(positions[first + i]));
    }
  });
  return cloud;
}

double even(const Vector& /*p*/) { return 1; }

double mean(const std::vector<double>& values, int power = 1) {
  double sum = 0;
  for (const double v : values) sum += std::pow(v, power);
  return sum / static_cast<double>(values.size());
}

/// Points in a cube so large that the values of octaves are nearly independent.
const std::vector<Vector>& scattered() {
  static const std::vector<Vector> positions = positions_in_cube(1 << 20, 512, 40);
  return positions;
}

// Products of these positions and frequencies are exact, so that only sums with offsets round.
TEST(FractalNoise, OctaveKHasFrequencyAndWeightOfTheFormula) {
  std::vector<Vector> positions = positions_in_cube(512, 1, 41);
  for (Vector& p : positions) {
    for (double& c : p) c = std::floor(c * 64) / 64;
  }
  for (const Noise* kind : noise_kinds()) {
    SCOPED_TRACE(kind->name());
    FractalParameters p = parameters_of(*kind);
    // One octave of frequency 1 and weight 1: P(x + o_1).
    p.octaves = 1;
    p.k0 = 0;
    p.frequency_scale = 1;
    const FractalNoise first(p);
    p.k0 = 2;
    p.frequency_scale = 3;
    p.spectral_index = 1.5;
    const FractalNoise fifth(p);
    std::vector<Vector> stretched = positions;
    for (Vector& q : stretched) {
      for (double& c : q) c *= 5;
    }
    const std::vector<double> expected = raw_sum(first, stretched);
    const std::vector<double> found = raw_sum(fifth, positions);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      ASSERT_NEAR(found[i], std::pow(5, -1.5) * expected[i], 2e-6);
    }
    // Octave k has the weight (k0 + f_s k)^-nu: the third octave alone, at two spectral indices.
    const auto third = [&](double spectral_index) {
      p.spectral_index = spectral_index;
      p.octaves = 3;
      std::vector<double> values = raw_sum(FractalNoise(p), positions);
      p.octaves = 2;
      const std::vector<double> without = raw_sum(FractalNoise(p), positions);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] -= without[i];
      return values;
    };
    const std::vector<double> plain = third(0);
    const std::vector<double> weighted = third(1);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      ASSERT_NEAR(weighted[i], plain[i] / 11, 1e-6);
    }
  }
}

TEST(FractalNoise, EffectiveFrequency) {
  FractalParameters p = parameters_of(perlin_noise());
  p.octaves = 3;
  p.k0 = 2;
  p.frequency_scale = 3;
  p.spectral_index = 2;
  // Frequencies 5, 8, 11; variances f^-4.
  const double w = 1 / 625.0 + 1 / 4096.0 + 1 / 14641.0;
  EXPECT_NEAR(FractalNoise(p).effective_frequency(),
              std::sqrt((1 / 25.0 + 1 / 64.0 + 1 / 121.0) / w), 1e-5);
}

TEST(FractalNoise, OctavesAreIndependent) {
  for (const Noise* kind : noise_kinds()) {
    SCOPED_TRACE(kind->name());
    for (const double spectral_index : {0.0, 1.0}) {
      FractalParameters p = parameters_of(*kind);
      p.spectral_index = spectral_index;
      const FractalNoise noise(p);
      double weights = 0;
      for (int k = 1; k <= 8; ++k) weights += std::pow(k, -2 * spectral_index);
      const double sigma = std::sqrt(weights * kind->variance());
      EXPECT_NEAR(noise.sigma(), sigma, 1e-12);
      EXPECT_EQ(noise.mean(), 0);
      const std::vector<double> values = raw_sum(noise, scattered());
      EXPECT_NEAR(std::sqrt(mean(values, 2)) / sigma, 1, 0.0015);
      EXPECT_NEAR(mean(values) / sigma, 0, 0.0025);
    }
  }
}

// The excess kurtosis of the sum is that of one octave times sum w^4/(sum w^2)^2.
TEST(FractalNoise, HistogramIsNearlyGaussian) {
  for (const Noise* kind : noise_kinds()) {
    SCOPED_TRACE(kind->name());
    FractalParameters p = parameters_of(*kind);
    p.octaves = 1;
    const auto excess = [&](const std::vector<double>& values) {
      return mean(values, 4) / std::pow(mean(values, 2), 2) - 3;
    };
    const double base = excess(raw_sum(FractalNoise(p), scattered()));
    EXPECT_LT(base, -0.2);
    p.octaves = 8;
    for (const double spectral_index : {0.0, 1.0}) {
      p.spectral_index = spectral_index;
      double second = 0;
      double fourth = 0;
      for (int k = 1; k <= 8; ++k) {
        second += std::pow(k, -2 * spectral_index);
        fourth += std::pow(k, -4 * spectral_index);
      }
      const std::vector<double> values = raw_sum(FractalNoise(p), scattered());
      const double sigma = std::sqrt(mean(values, 2));
      EXPECT_NEAR(excess(values), base * fourth / (second * second), 0.01);
      EXPECT_NEAR(mean(values, 3) / std::pow(sigma, 3), 0, 0.009);
      if (spectral_index != 0) continue;
      // The shares within 1, 2 and 3 sigma follow from the first term of Edgeworth's series.
      double inside[3] = {};
      for (const double v : values) {
        for (int n = 1; n <= 3; ++n) inside[n - 1] += std::abs(v) < n * sigma ? 1 : 0;
      }
      const auto count = static_cast<double>(values.size());
      for (int n = 1; n <= 3; ++n) {
        const double density = std::exp(-0.5 * n * n) / std::sqrt(2 * std::numbers::pi);
        const double term = -excess(values) / 12 * (std::pow(n, 3) - 3 * n) * density;
        EXPECT_NEAR(inside[n - 1] / count, std::erf(n / std::numbers::sqrt2) + term, 0.0015) << n;
      }
    }
  }
}

TEST(FractalNoise, NormaliseTakesWeightedStatistics) {
  const std::vector<Vector> positions = positions_in_cube(20000, 1, 42);
  const auto weight = [](const Vector& p) { return std::exp(2 * p[0]) + (p[1] > 0 ? 1 : 0); };
  const std::vector<WeightedBatch> cloud = cloud_of(positions, weight);
  const FractalNoise::Factor given = [](const Points& points, float* out) {
    for (std::size_t i = 0; i < points.size; ++i) out[i] = 1.5f + points.y[i];
  };
  std::vector<double> factor_list;
  for (const WeightedBatch& batch : cloud) {
    for (std::size_t i = 0; i < batch.size; ++i) factor_list.push_back(1.5f + batch.y[i]);
  }
  for (const bool with_factors : {false, true}) {
    FractalParameters p = parameters_of(simplex_noise());
    p.exponent = 3;
    p.offset = 0.4;
    FractalNoise noise(p);
    const std::vector<double> raw = raw_sum(noise, positions);
    noise.normalise(cloud, with_factors ? given : FractalNoise::Factor());
    const std::vector<double> phi = phi_of(noise, positions);
    double w = 0, s = 0, ss = 0, light = 0, squares = 0, errors = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const double weight_i = weight(positions[i]);
      const double value = phi[i] * (with_factors ? factor_list[i] : 1.0);
      w += weight_i;
      s += weight_i * raw[i];
      ss += weight_i * raw[i] * raw[i];
      light += weight_i * value;
      squares += weight_i * value * value;
      errors += std::pow(weight_i * (value - 1), 2);
    }
    EXPECT_NEAR(noise.mean(), s / w, 1e-6);
    EXPECT_NEAR(noise.sigma(), std::sqrt(ss / w - s * s / (w * w)), 1e-6);
    EXPECT_NEAR(light / w, 1, 1e-6);
    EXPECT_NEAR(noise.rms() / std::sqrt(squares / w), 1, 1e-5);
    EXPECT_NEAR(noise.mean_error() / (std::sqrt(errors) / w), 1, 1e-5);
  }
}

/// Evaluates the noise for rays of the given footprints.
void see(const FractalNoise& noise, const Points& points, const BatchArray& footprints,
         SeenNoise& out) {
  const float* const one = footprints.data();
  std::uint64_t evaluations = 0;
  noise.see(points, std::span(&one, 1), std::span(&out, 1), evaluations);
}

/// The expectation of Phi at points for rays of a footprint, with the hidden variance.
std::vector<double> expected_of(const FractalNoise& noise, std::span<const WeightedBatch> cloud,
                                double width, double* hidden = nullptr) {
  std::vector<double> result;
  BatchArray footprint, out;
  std::fill_n(footprint.data(), batch_capacity, static_cast<float>(width));
  SeenNoise seen;
  for (const WeightedBatch& batch : cloud) {
    see(noise, batch.points(), footprint, seen);
    noise.expect(batch.size, seen, out.data());
    result.insert(result.end(), out.data(), out.data() + batch.size);
    if (hidden != nullptr) *hidden = double{seen.hidden[0]};
  }
  return result;
}

TEST(SeenNoise, KeepsItsMeanAboutAndLosesItsContrast) {
  const std::vector<WeightedBatch> cloud = cloud_of(positions_in_cube(40000, 1, 7), even);
  for (const bool inverse : {false, true}) {
    FractalParameters p = parameters_of(simplex_noise());
    p.octaves = 6;
    p.k0 = 2;
    p.frequency_scale = 5;
    p.exponent = inverse ? 1.5 : 3;
    p.inverse = inverse;
    p.offset = inverse ? 0 : 1;
    FractalNoise noise(p);
    noise.normalise(cloud);
    double last_square = HUGE_VAL, last_hidden = -1;
    for (const double width : {0.0, 0.01, 0.03, 0.06, 0.12, 0.3}) {
      double hidden = 0;
      const std::vector<double> phi = expected_of(noise, cloud, width, &hidden);
      double mean = 0, square = 0;
      for (const double value : phi) {
        mean += value / static_cast<double>(phi.size());
        square += value * value / static_cast<double>(phi.size());
      }
      // The mean holds as far as octaves are normal; components correct the rest.
      EXPECT_NEAR(mean, 1, 5e-3) << "inverse " << inverse << " width " << width;
      square /= mean * mean;
      EXPECT_LE(square, last_square + 2e-4);
      EXPECT_GE(hidden, last_hidden);
      last_square = square;
      last_hidden = hidden;
    }
    EXPECT_NEAR(last_hidden, 1, 1e-6);
    EXPECT_NEAR(last_square, 1, 1e-4);
  }
}

TEST(SeenNoise, NarrowRaysSeeAll) {
  const std::vector<Vector> positions = positions_in_cube(1000, 1, 3);
  const std::vector<WeightedBatch> cloud = cloud_of(positions, even);
  FractalNoise noise(parameters_of(simplex_noise()));
  noise.normalise(cloud);
  EXPECT_EQ(expected_of(noise, cloud, 0), phi_of(noise, positions));
  EXPECT_EQ(expected_of(noise, cloud, 1e-4), phi_of(noise, positions));
}

TEST(SeenNoise, DeviationsAverageToWhatIsExpected) {
  // The three-point Gauss-Hermite rule over the coherent part gives the expectation over all hidden
  // noise.
  const std::vector<WeightedBatch> cloud = cloud_of(positions_in_cube(4000, 1, 5), even);
  FractalParameters p = parameters_of(simplex_noise());
  p.exponent = 2;
  p.offset = 2;
  FractalNoise noise(p, 0.02);
  noise.normalise(cloud);
  BatchArray footprint, out;
  std::fill_n(footprint.data(), batch_capacity, 0.08f);
  SeenNoise seen;
  double expected = 0, averaged = 0;
  for (const WeightedBatch& batch : cloud) {
    see(noise, batch.points(), footprint, seen);
    noise.expect(batch.size, seen, out.data());
    for (std::size_t i = 0; i < batch.size; ++i) expected += double{out[i]};
    for (const auto& [deviation, weight] :
         {std::pair(0.0, 2.0 / 3), std::pair(std::sqrt(3.0), 1.0 / 6),
          std::pair(-std::sqrt(3.0), 1.0 / 6)}) {
      noise.expect(batch.size, seen, nullptr, deviation, out.data());
      for (std::size_t i = 0; i < batch.size; ++i) averaged += weight * double{out[i]};
    }
  }
  EXPECT_NEAR(averaged / expected, 1, 5e-3);
}

constexpr Combination::Kind all_combinations[] = {
    Combination::Kind::additive, Combination::Kind::multiplicative, Combination::Kind::ridged,
    Combination::Kind::billow};

TEST(SeenNoise, DoesNotDependOnOtherFootprints) {
  const std::vector<WeightedBatch> cloud = cloud_of(positions_in_cube(1000, 1, 5), even);
  constexpr float widths[] = {0, 0.05f, 0.2f, 2};
  std::array<BatchArray, std::size(widths)> footprints;
  std::array<const float*, std::size(widths)> sets;
  for (std::size_t v = 0; v < sets.size(); ++v) {
    std::fill_n(footprints[v].data(), batch_capacity, widths[v]);
    sets[v] = footprints[v].data();
  }
  for (const Combination::Kind kind : all_combinations) {
    FractalParameters p = parameters_of(simplex_noise());
    p.combination.kind = kind;
    p.warp = 0.05;
    FractalNoise noise(p);
    noise.normalise(cloud);
    for (const WeightedBatch& batch : cloud) {
      std::array<SeenNoise, std::size(widths)> together;
      std::uint64_t evaluations = 0;
      noise.see(batch.points(), sets, together, evaluations);
      for (std::size_t v = 0; v < sets.size(); ++v) {
        SeenNoise alone;
        see(noise, batch.points(), footprints[v], alone);
        for (std::size_t i = 0; i < batch.size; ++i) {
          EXPECT_NEAR(together[v].sum[i], alone.sum[i], 1e-5);
          EXPECT_EQ(together[v].hidden[i], alone.hidden[i]);
          EXPECT_EQ(together[v].coherent[i], alone.coherent[i]);
        }
      }
    }
  }
}

TEST(SeenNoise, DoesNotDependOnOtherPoints) {
  // Frequencies are 20, 40, ..., 120. Rays of this width hide the last four at all points but one.
  const std::vector<WeightedBatch> cloud = cloud_of(positions_in_cube(batch_capacity, 1, 5), even);
  BatchArray alike;
  std::fill_n(alike.data(), batch_capacity, 0.019f);
  for (const Combination::Kind kind : all_combinations) {
    FractalParameters p = parameters_of(simplex_noise());
    p.combination.kind = kind;
    p.octaves = 6;
    p.k0 = 0;
    p.frequency_scale = 20;
    FractalNoise noise(p, 0.02);
    noise.normalise(cloud);
    for_each_simd_target([&] {
      SeenNoise alone, beside;
      see(noise, cloud[0].points(), alike, alone);
      const std::size_t last = cloud[0].size - 1;
      BatchArray others = alike;
      others[last] = 0.001f;
      see(noise, cloud[0].points(), others, beside);
      EXPECT_NE(beside.sum[last], alone.sum[last]);
      for (std::size_t i = 0; i < last; ++i) {
        ASSERT_EQ(beside.sum[i], alone.sum[i]);
        ASSERT_EQ(beside.hidden[i], alone.hidden[i]);
        ASSERT_EQ(beside.coherent[i], alone.coherent[i]);
      }
    });
  }
}

/// Calls work(parameters, name) for every kind and combination, without a warp and with one.
void for_every_noise(const std::function<void(const FractalParameters&)>& work) {
  for (const Noise* kind : noise_kinds()) {
    for (const Combination::Kind combination : all_combinations) {
      for (const double warp : {0.0, 0.05}) {
        SCOPED_TRACE(std::string(kind->name()) + ", combination " +
                     std::to_string(static_cast<int>(combination)) + ", warp " +
                     std::to_string(warp));
        FractalParameters p = parameters_of(*kind);
        p.combination.kind = combination;
        p.octaves = 5;
        p.frequency_scale = 4;
        p.lacunarity = 2;
        p.exponent = 1.5;
        p.offset = 0.5;
        p.warp = warp;
        p.warp_frequency = 3;
        p.warp_octaves = 2;
        work(p);
      }
    }
  }
}

TEST(EveryNoise, LosesItsContrastWithTheFootprint) {
  const std::vector<WeightedBatch> cloud =
      cloud_of(positions_in_cube(20000, 1, 7), [](const Vector& p) { return std::exp(p[0]); });
  for_every_noise([&](const FractalParameters& p) {
    FractalNoise noise(p);
    noise.normalise(cloud);
    double last_square = HUGE_VAL;
    for (const double width : {0.0, 0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.3}) {
      const std::vector<double> phi = expected_of(noise, cloud, width);
      double weights = 0, sum = 0, squares = 0;
      std::size_t i = 0;
      for (const WeightedBatch& batch : cloud) {
        for (std::size_t j = 0; j < batch.size; ++j, ++i) {
          const double weight = double{batch.weight[j]};
          weights += weight;
          sum += weight * phi[i];
          squares += weight * phi[i] * phi[i];
        }
      }
      if (width == 0) {
        EXPECT_NEAR(sum / weights, 1, 1e-5);
      }
      const double square = squares * weights / (sum * sum);
      EXPECT_LE(square, last_square * (1 + 2e-3)) << "width " << width;
      last_square = square;
    }
    EXPECT_NEAR(last_square, 1, 1e-4);
  });
}

TEST(EveryNoise, TargetsAgree) {
  const std::vector<Vector> positions = positions_in_cube(2000, 1, 8);
  const std::vector<WeightedBatch> cloud = cloud_of(positions, even);
  for_every_noise([&](const FractalParameters& p) {
    FractalNoise noise(p);
    noise.normalise(cloud);
    std::vector<double> first;
    for_each_simd_target([&] {
      for (const double width : {0.0, 0.02}) {
        const std::vector<double> phi = expected_of(noise, cloud, width);
        if (first.size() < 2 * phi.size()) {
          first.insert(first.end(), phi.begin(), phi.end());
          continue;
        }
        const std::size_t start = width == 0 ? 0 : phi.size();
        // A point on the face of a cell may count to either side, so that a few values may jump.
        std::size_t others = 0;
        for (std::size_t i = 0; i < phi.size(); ++i) {
          if (std::abs(phi[i] - first[start + i]) > 2e-4 * (1 + first[start + i])) ++others;
        }
        EXPECT_LE(others, p.kind->name() == "cell" ? 4u : 0u);
      }
    });
  });
}

TEST(EveryNoise, SeedsDiffer) {
  const std::vector<Vector> positions = positions_in_cube(1 << 14, 64, 9);
  const std::vector<WeightedBatch> cloud = cloud_of(positions, even);
  for_every_noise([&](FractalParameters p) {
    const auto fluctuations = [&] {
      FractalNoise noise(p);
      noise.normalise(cloud);
      std::vector<double> phi = phi_of(noise, positions);
      for (double& value : phi) value -= 1;
      return phi;
    };
    const std::vector<double> here = fluctuations();
    EXPECT_EQ(fluctuations(), here);
    p.seed = 18;
    const std::vector<double> other = fluctuations();
    double product = 0;
    for (std::size_t i = 0; i < here.size(); ++i) product += here[i] * other[i];
    const auto count = static_cast<double>(here.size());
    EXPECT_LT(std::abs(product) / count / std::sqrt(mean(here, 2) * mean(other, 2)),
              4.5 / std::sqrt(count));
  });
}

// docs/facts.md section 7 gives the variance of one octave of Perlin noise, and with 6 octaves that
// of the product.
TEST(Multiplicative, VariancesAndLogarithms) {
  struct Row {
    double amplitude, variance, log_mean, log_variance;
  };
  for (const Row& row : {Row{1, 0.0729, -0.0406, 0.0879}, Row{1.5, 0.163, -0.125, 0.411},
                         Row{2, 0.272, -0.353, 0}}) {
    FractalParameters p = parameters_of(perlin_noise());
    p.combination.kind = Combination::Kind::multiplicative;
    p.amplitude = row.amplitude;
    p.octaves = 1;
    const std::vector<double> factor = raw_sum(FractalNoise(p), scattered());
    EXPECT_NEAR(mean(factor), 1, 0.0015);
    EXPECT_NEAR(mean(factor, 2) - std::pow(mean(factor), 2), row.variance, 8e-4);
    double clamped = 0, logs = 0, squares = 0;
    for (const double f : factor) {
      clamped += f == 0 ? 1 : 0;
      // docs/facts.md section 7 bounds the logarithm where factors are 0.
      const double logarithm = std::log(std::max(f, 1e-3));
      logs += logarithm;
      squares += logarithm * logarithm;
    }
    const auto count = static_cast<double>(factor.size());
    logs /= count;
    EXPECT_NEAR(logs, row.log_mean, 2e-3);
    if (row.log_variance > 0) {
      EXPECT_NEAR(squares / count - logs * logs, row.log_variance, 0.01);
    }
    const double share = row.amplitude == 1 ? 0 : row.amplitude == 1.5 ? 0.0055 : 0.059;
    double top = 0;
    for (const double f : factor) top += f == 2 ? 1 : 0;
    EXPECT_NEAR((clamped + top) / count, share, 8e-4);
    p.octaves = 6;
    p.lacunarity = 2;
    const std::vector<double> product = raw_sum(FractalNoise(p), scattered());
    const double single = mean(factor, 2) - std::pow(mean(factor), 2);
    EXPECT_NEAR(mean(product), 1, 0.006);
    EXPECT_NEAR((mean(product, 2) - std::pow(mean(product), 2)) / (std::pow(1 + single, 6) - 1), 1,
                0.04);
  }
}

TEST(Ridged, MomentsOfTheMultifractal) {
  FractalParameters p = parameters_of(perlin_noise());
  p.combination.kind = Combination::Kind::ridged;
  p.octaves = 6;
  p.lacunarity = 2;
  p.spectral_index = 1;
  const std::vector<double> values = raw_sum(FractalNoise(p), scattered());
  EXPECT_NEAR(mean(values), 1.1705, 2e-3);
  EXPECT_NEAR(std::sqrt(mean(values, 2) - std::pow(mean(values), 2)), 0.339, 1.5e-3);
}

TEST(Additive, SigmaOfFractionalBrownianMotion) {
  FractalParameters p = parameters_of(perlin_noise());
  p.octaves = 8;
  p.lacunarity = 2;
  p.spectral_index = 1;
  EXPECT_NEAR(FractalNoise(p).sigma(), 0.3118, 5e-5);
  EXPECT_NEAR(std::sqrt(mean(raw_sum(FractalNoise(p), scattered()), 2)), 0.3118, 8e-4);
}

// The power of the product falls as k^-(3 - mu) with mu = log2(1 + sigma_k^2). For each factor of 2
// in r, one octave less is common to x and x + r, so that <F(x) F(x + r)> falls as r^-mu.
TEST(Multiplicative, SpectralSlope) {
  for (const auto& [amplitude, mu] : {std::pair(1.0, 0.102), {1.5, 0.218}, {2.0, 0.347}}) {
    FractalParameters p = parameters_of(perlin_noise());
    p.combination.kind = Combination::Kind::multiplicative;
    p.amplitude = amplitude;
    p.octaves = 8;
    p.lacunarity = 2;
    const FractalNoise noise(p);
    const std::vector<double> here = raw_sum(noise, scattered());
    std::vector<double> logs;
    for (const double lag : {0.32, 0.04}) {
      std::vector<Vector> moved = scattered();
      for (Vector& q : moved) q[0] += lag;
      const std::vector<double> there = raw_sum(noise, moved);
      double product = 0;
      for (std::size_t i = 0; i < here.size(); ++i) product += here[i] * there[i];
      logs.push_back(std::log2(product / static_cast<double>(here.size())));
    }
    EXPECT_NEAR((logs[1] - logs[0]) / 3, mu, 0.006 + 0.02 * mu) << amplitude;
  }
}

TEST(Warp, DisplacesByTheAmplitude) {
  // Where the noise is linear, its value measures the displacement.
  FractalParameters p = parameters_of(perlin_noise());
  p.octaves = 1;
  p.frequency_scale = 1e-4;
  p.spectral_index = 0;
  const std::vector<Vector> positions = positions_in_cube(1 << 16, 512, 12);
  std::vector<Vector> origin(positions.size(), Vector{});
  const auto slope = [&](std::size_t axis) {
    Vector q{};
    q[axis] = 256;
    const std::vector<Vector> two = {Vector{}, q};
    const std::vector<double> v = raw_sum(FractalNoise(p), two);
    return (v[1] - v[0]) / 256;
  };
  const double gradient = std::hypot(slope(0), slope(1), slope(2));
  const std::vector<double> still = raw_sum(FractalNoise(p), positions);
  p.warp = 20;
  p.warp_frequency = 0.3;
  for (const int octaves : {1, 4}) {
    p.warp_octaves = octaves;
    const std::vector<double> moved = raw_sum(FractalNoise(p), positions);
    double squares = 0;
    for (std::size_t i = 0; i < still.size(); ++i) squares += std::pow(moved[i] - still[i], 2);
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(still.size())) / (20 * gradient), 1, 0.03);
  }
}

// The warp shrinks lengths: hides() and the steps assume the growth of the rms gradient that is
// measured here.
TEST(Warp, RaisesFrequencies) {
  FractalParameters p = parameters_of(simplex_noise());
  p.octaves = 1;
  const std::vector<Vector> positions = positions_in_cube(1 << 17, 256, 13);
  const auto steepness = [&](const FractalNoise& noise) {
    double squares = 0;
    constexpr double step = 1.0 / 512;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<Vector> moved = positions;
      for (Vector& q : moved) q[axis] += step;
      const std::vector<double> a = raw_sum(noise, positions), b = raw_sum(noise, moved);
      for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow((b[i] - a[i]) / step, 2);
    }
    return std::sqrt(squares);
  };
  const FractalNoise still(p);
  p.warp = 0.15;
  p.warp_frequency = 0.7;
  p.warp_octaves = 3;
  const FractalNoise warped(p);
  const double ratio = warped.effective_frequency() / still.effective_frequency();
  EXPECT_GT(ratio, 1.3);
  EXPECT_NEAR(steepness(warped) / steepness(still) / ratio, 1, 0.02);
  EXPECT_TRUE(warped.hides(0.15 / ratio * 1.01));
  EXPECT_FALSE(warped.hides(0.15 / ratio * 0.99));
}

TEST(FractalNoise, TakesGivenOctaves) {
  const std::vector<Vector> positions = positions_in_cube(2000, 1, 14);
  const std::vector<WeightedBatch> cloud = cloud_of(positions, even);
  FractalParameters p = parameters_of(perlin_noise());
  p.octaves = 4;
  p.combination.kind = Combination::Kind::multiplicative;
  p.lacunarity = 2;
  FractalNoise own(p), given(p, p.make_octaves());
  own.normalise(cloud);
  given.normalise(cloud);
  EXPECT_EQ(phi_of(given, positions), phi_of(own, positions));
  EXPECT_EQ(expected_of(given, cloud, 0.1), expected_of(own, cloud, 0.1));
  // A translation maps these octaves to themselves, however much of the noise is seen.
  std::vector<Octave> octaves = p.make_octaves();
  for (std::size_t k = 0; k < octaves.size(); ++k) {
    octaves[k].translation[0] = 3 << k;
    octaves[k].translation[1] = -1 << k;
  }
  std::vector<Vector> coarse = positions;
  for (Vector& q : coarse) {
    for (double& c : q) c = std::floor(c * 256) / 256;
  }
  std::vector<Vector> moved = coarse;
  for (Vector& q : moved) {
    q[0] += 3;
    q[1] -= 1;
  }
  FractalNoise helix(p, octaves);
  helix.normalise(cloud);
  for (const double width : {0.0, 0.1, 0.3}) {
    const std::vector<double> here = expected_of(helix, cloud_of(coarse, even), width);
    const std::vector<double> there = expected_of(helix, cloud_of(moved, even), width);
    for (std::size_t i = 0; i < here.size(); ++i)
      ASSERT_NEAR(there[i], here[i], 2e-5 * (1 + here[i]));
  }
}

TEST(NoiseShape, ExpectedValuesAreThoseOfTheNormalDistribution) {
  // E[max(v + h g, 0)^2] = (v^2 + h^2) Q + v h q, Q and q the normal distribution and density.
  const NoiseShape shape({2, false, 0.5, 1, 0.1});
  BatchArray values, hidden;
  for (const double h : {0.25, 0.4, 0.5, 0.77, 1.0}) {
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      values[i] = static_cast<float>(-2.5 + 5.0 * static_cast<double>(i) / batch_capacity);
      hidden[i] = static_cast<float>(h * h);
    }
    const BatchArray s = values;
    shape.apply_expected({1, 0}, 1, batch_capacity, hidden.data(), values.data());
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double v = 0.5 + double{s[i]};
      const double x = v / h;
      const double exact = (v * v + h * h) * 0.5 * std::erfc(-x / std::sqrt(2.0)) +
                           v * h * std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
      EXPECT_NEAR(values[i], exact, 1e-2 * (exact + 0.1 * h * h)) << "h " << h << " v " << v;
    }
  }
}

TEST(NoiseShape, ExpectedValuesDoNotDependOnOthers) {
  for (const bool inverse : {false, true}) {
    const NoiseShape shape({1.5, inverse, 0.5, 1, 0.1});
    BatchArray sums, hidden, together, seen;
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      sums[i] = static_cast<float>(-7 + 14.0 * static_cast<double>(i) / batch_capacity);
      hidden[i] = i % 3 == 0 ? 0.0f : static_cast<float>(i % 7) / 6;
    }
    for_each_simd_target([&] {
      together = seen = sums;
      shape.apply_expected({1, 0}, 2, batch_capacity, hidden.data(), together.data());
      shape.apply({1, 0}, 2, batch_capacity, seen.data());
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        if (hidden[i] > 0) continue;
        ASSERT_EQ(together[i], seen[i]) << i;
      }
      for (const std::size_t size : {1, 17, 63, 64, 65, 130}) {
        BatchArray first = sums;
        shape.apply_expected({1, 0}, 2, size, hidden.data(), first.data());
        ASSERT_TRUE(std::equal(first.data(), first.data() + size, together.data())) << size;
      }
      for (std::size_t i = 0; i < batch_capacity; i += 5) {
        BatchArray alone{}, own{};
        alone[0] = sums[i];
        own[0] = hidden[i];
        shape.apply_expected({1, 0}, 2, 1, own.data(), alone.data());
        ASSERT_EQ(alone[0], together[i]) << i;
      }
    });
  }
}

TEST(NoiseShape, ExpectedInverseValuesAreThoseOfTheNormalDistribution) {
  struct Case {
    double exponent, floor, error;  // The steps of the table show where the shape is sharp.
  };
  for (const auto& [exponent, floor, error] :
       {Case{1.5, 0.3, 4e-3}, {-2, 0.3, 8e-3}, {4, 0.1, 0.09}}) {
    const NoiseShape shape({exponent, true, 0.2, 1, floor});
    double worst = 0;
    for (const double h : {0.05, 0.3, 0.6, 1.0}) {
      BatchArray values, hidden;
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        values[i] = static_cast<float>(-3 + 6.0 * static_cast<double>(i) / batch_capacity);
        hidden[i] = static_cast<float>(h * h);
      }
      const BatchArray s = values;
      shape.apply_expected({1, 0}, 3, batch_capacity, hidden.data(), values.data());
      for (std::size_t i = 0; i < batch_capacity; i += 7) {
        double sum = 0, weights = 0;
        for (int k = -2000; k <= 2000; ++k) {
          const double g = k / 300.0;
          const double v = std::abs(0.2 + double{s[i]} + h * g);
          const double weight = std::exp(-0.5 * g * g);
          sum += weight * std::pow(std::max(v, floor), -exponent);
          weights += weight;
        }
        worst = std::max(worst, std::abs(double{values[i]} / (3 * sum / weights) - 1));
      }
    }
    EXPECT_LT(worst, error) << exponent << " " << floor;
  }
}

TEST(FractalNoise, MeanErrorIsThatOfIndependentPoints) {
  // The expected error is the scatter of the mean over many small clouds.
  FractalParameters p = parameters_of(simplex_noise());
  p.exponent = 2;
  FractalNoise noise(p);
  noise.normalise(cloud_of(scattered(), even));
  constexpr int clouds = 400, size = 1000;
  double sum = 0, squares = 0;
  const std::vector<double> phi = phi_of(noise, scattered());
  for (int c = 0; c < clouds; ++c) {
    double average = 0;
    for (int i = 0; i < size; ++i) average += phi[static_cast<std::size_t>(c * size + i)] / size;
    sum += average;
    squares += average * average;
  }
  const double scatter = std::sqrt(squares / clouds - std::pow(sum / clouds, 2));
  const double count = static_cast<double>(scattered().size());
  EXPECT_NEAR(noise.mean_error() * std::sqrt(count / size) / scatter, 1, 0.1);
}

double shaped(const FractalParameters& p, double v) {
  return p.inverse ? std::pow(std::max(std::abs(v), p.floor), -p.exponent)
                   : std::pow(std::max(v, 0.0), p.exponent);
}

// Before normalise(), mu = 0, sigma is known and the mean of Phi is 1.
TEST(FractalNoise, ShapesOnEveryTarget) {
  const std::vector<Vector> positions = positions_in_cube(4000, 4, 43);
  for (const bool inverse : {false, true}) {
    for (const double exponent : {0.0, 1.0, 2.0, 8.0, 20.0, 0.5, 2.5, 7.3, -1.0, -2.5}) {
      if (!inverse && exponent < 0) continue;
      FractalParameters p = parameters_of(simplex_noise());
      p.inverse = inverse;
      p.exponent = exponent;
      p.offset = 0.3;
      p.contrast = 0.7;
      p.floor = 0.2;
      const FractalNoise noise(p);
      for_each_simd_target([&] {
        const std::vector<double> raw = raw_sum(noise, positions);
        const std::vector<double> phi = phi_of(noise, positions);
        double worst = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
          const double v = p.offset + p.contrast * raw[i] / noise.sigma();
          const double base = inverse ? std::max(std::abs(v), p.floor) : std::max(v, 0.0);
          if (base == 0) {
            EXPECT_NEAR(phi[i], exponent == 0 ? 1 : 0, 1e-12);
            continue;
          }
          if (shaped(p, v) < std::numeric_limits<float>::min()) continue;
          const double error = std::abs(phi[i] / shaped(p, v) - 1);
          worst = std::max(worst, error / std::max(1.0, std::abs(exponent)) / (2e-7 + 2e-8 / base));
        }
        EXPECT_LT(worst, 1) << "exponent " << exponent;
      });
    }
  }
}

TEST(FractalNoise, WholeAndGeneralExponentsAgree) {
  const std::vector<Vector> positions = positions_in_cube(4000, 4, 44);
  for (const bool inverse : {false, true}) {
    for (const double exponent : {1.0, 3.0, 8.0, 20.0}) {
      FractalParameters p = parameters_of(perlin_noise());
      p.inverse = inverse;
      p.exponent = exponent;
      const std::vector<double> whole = phi_of(FractalNoise(p), positions);
      p.exponent = exponent * (1 + 1e-7);
      const std::vector<double> general = phi_of(FractalNoise(p), positions);
      for (std::size_t i = 0; i < positions.size(); ++i) {
        ASSERT_NEAR(general[i], whole[i], 2e-5 * std::abs(whole[i]) + 1e-9) << exponent;
      }
    }
  }
}

TEST(FractalNoise, SeedsGiveOtherNoises) {
  const std::vector<Vector> positions = positions_in_cube(1 << 16, 64, 45);
  for (const Noise* kind : noise_kinds()) {
    FractalParameters p = parameters_of(*kind);
    const std::vector<double> here = raw_sum(FractalNoise(p), positions);
    for (const std::uint64_t seed : {18u, 16u, 0u}) {
      p.seed = seed;
      const std::vector<double> other = raw_sum(FractalNoise(p), positions);
      double product = 0;
      for (std::size_t i = 0; i < here.size(); ++i) product += here[i] * other[i];
      EXPECT_LT(std::abs(product) / static_cast<double>(here.size()) / mean(here, 2),
                4.5 / std::sqrt(static_cast<double>(here.size())));
    }
    p.seed = 17;
    EXPECT_EQ(raw_sum(FractalNoise(p), positions), here);
  }
}

TEST(FractalNoise, ErrorsOfNormalise) {
  const std::vector<Vector> positions = positions_in_cube(2000, 1, 46);
  const auto error = [&](FractalParameters p) {
    p.kind = &simplex_noise();
    return error_text([&] { FractalNoise(p).normalise(cloud_of(positions, even)); });
  };
  FractalParameters dark;
  dark.offset = -10;
  EXPECT_EQ(error(dark),
            "the noise is zero or infinite over the whole component; change its offset, contrast "
            "or exponent");
  FractalParameters flat;
  flat.frequency_scale = 1e-6;
  EXPECT_EQ(error(flat), "the noise hardly varies over the whole component; raise its frequencies");
  FractalParameters infinite;
  infinite.frequency_scale = 1e-6;
  infinite.spectral_index = 10;
  EXPECT_EQ(error(infinite), "the noise is infinite; change its spectral index or frequencies");
  infinite.frequency_scale = 1000;
  infinite.octaves = 32;
  infinite.spectral_index = -10;
  EXPECT_EQ(error(infinite), "the noise is infinite; change its spectral index or frequencies");
}

FractalParameters read(const FractalParameters& defaults, const std::string& text) {
  FractalParameters p = defaults;
  p.apply(
      ParameterSet::read(p.table(), parse_toml(text, "g.toml"), "noise: ", "in component.noise"),
      "noise: ");
  return p;
}

TEST(FractalParameters, TableHasTheValuesAsDefaults) {
  FractalParameters p;
  p.octaves = 5;
  p.k0 = 7;
  p.frequency_scale = 2.5;
  p.spectral_index = 1.25;
  p.exponent = 4;
  p.inverse = true;
  p.offset = -1;
  p.contrast = 2;
  p.floor = 0.5;
  p.seed = 99;
  const FractalParameters same = read(p, "");
  EXPECT_EQ(same.octaves, 5);
  EXPECT_EQ(same.k0, 7);
  EXPECT_EQ(same.frequency_scale, 2.5);
  EXPECT_EQ(same.spectral_index, 1.25);
  EXPECT_EQ(same.exponent, 4);
  EXPECT_TRUE(same.inverse);
  EXPECT_EQ(same.offset, -1);
  EXPECT_EQ(same.contrast, 2);
  EXPECT_EQ(same.floor, 0.5);
  EXPECT_EQ(same.seed, 99u);
}

TEST(FractalParameters, ReadsEveryKey) {
  const FractalParameters p =
      read({},
           "octaves = 3\nk0 = 1.5\nfrequency_scale = 4\nspectral_index = -2\nexponent = -3\n"
           "theta = \"inverse\"\noffset = 0.5\ncontrast = 3\nfloor = 0.25\n"
           "seed = 9223372036854775807");
  EXPECT_EQ(p.octaves, 3);
  EXPECT_EQ(p.k0, 1.5);
  EXPECT_EQ(p.frequency_scale, 4);
  EXPECT_EQ(p.spectral_index, -2);
  EXPECT_EQ(p.exponent, -3);
  EXPECT_TRUE(p.inverse);
  EXPECT_EQ(p.offset, 0.5);
  EXPECT_EQ(p.contrast, 3);
  EXPECT_EQ(p.floor, 0.25);
  EXPECT_EQ(p.seed, std::uint64_t{9223372036854775807u});
}

/// The other keys without which a key has no meaning.
std::string beside(const std::string& key) {
  if (key == "exponent") return "theta = \"inverse\"\n";
  if (key == "amplitude") return "combination = \"multiplicative\"\n";
  if (key.starts_with("ridge_")) return "combination = \"ridged\"\n";
  if (key.starts_with("warp_")) return "warp = 0.1\n";
  return "";
}

TEST(FractalParameters, ReadsCombinations) {
  FractalParameters p = read({},
                             "kind = \"perlin\"\ncombination = \"ridged\"\nridge_offset = 0.75\n"
                             "ridge_gain = 3\nwarp = 0.25\nwarp_frequency = 2\nwarp_octaves = 4");
  EXPECT_EQ(p.kind, &perlin_noise());
  EXPECT_EQ(p.combination.kind, Combination::Kind::ridged);
  EXPECT_EQ(p.combination.ridge_offset, 0.75f);
  EXPECT_EQ(p.combination.ridge_gain, 3.0f);
  EXPECT_EQ(p.warp, 0.25);
  EXPECT_EQ(p.warp_frequency, 2);
  EXPECT_EQ(p.warp_octaves, 4);
  EXPECT_EQ(p.lacunarity, 2);
  p = read({}, "combination = \"multiplicative\"\namplitude = 1.5\nlacunarity = 0");
  EXPECT_EQ(p.combination.kind, Combination::Kind::multiplicative);
  EXPECT_EQ(p.amplitude, 1.5);
  EXPECT_EQ(p.lacunarity, 0);
  p = read({}, "combination = \"billow\"");
  EXPECT_EQ(p.combination.kind, Combination::Kind::billow);
  EXPECT_EQ(p.lacunarity, 0);
  EXPECT_EQ(p.kind, nullptr);
}

TEST(FractalParameters, ConflictsAreErrors) {
  const auto error = [](const std::string& text) { return error_text([&] { read({}, text); }); };
  EXPECT_EQ(
      error("combination = \"ridged\"\ntheta = \"inverse\""),
      "g.toml:2:9: noise: theta shapes sums of octaves; combination = \"ridged\" is a density "
      "as it is, so leave it out");
  EXPECT_EQ(error("ridge_gain = 3"),
            "g.toml:1:14: noise: ridge_gain belongs to combination = \"ridged\", not \"additive\"");
  EXPECT_EQ(error("amplitude = 3\ncombination = \"billow\""),
            "g.toml:1:13: noise: amplitude belongs to combination = \"multiplicative\", not "
            "\"billow\"");
  EXPECT_EQ(error("spectral_index = 3\ncombination = \"multiplicative\""),
            "g.toml:1:18: noise: spectral_index weighs terms of a sum; combination = "
            "\"multiplicative\" has amplitude instead");
  EXPECT_EQ(error("warp_octaves = 3"),
            "g.toml:1:16: noise: warp_octaves has no meaning without warp");
  EXPECT_EQ(error("lacunarity = 0.5"),
            "g.toml:1:14: noise: lacunarity must be above 1, or 0 for linear frequencies");
  EXPECT_EQ(error("lacunarity = 3\noctaves = 20"),
            "g.toml:1:14: noise: lacunarity 3 gives octave 20 more than 1e5 cycles per galaxy "
            "radius; take fewer octaves");
}

TEST(FractalParameters, IntervalEnds) {
  check_parameter_ends(FractalParameters().table(),
                       [](const std::string& key, const std::string& value) {
                         read({}, beside(key) + key + " = " + value);
                       });
}

TEST(FractalParameters, Errors) {
  EXPECT_EQ(error_text([] { read({}, "exponent = -1"); }),
            "g.toml:1:12: noise: exponent below 0 has no meaning where theta is 'linear'; use "
            "theta = \"inverse\" with a positive exponent");
  EXPECT_EQ(error_text([] { read({}, "k1 = 1"); }),
            "g.toml:1:1: noise: unknown key 'k1' in component.noise; did you mean 'k0'?");
  EXPECT_EQ(error_text([] { read({}, "theta = \"invers\""); }),
            "g.toml:1:9: noise: theta = 'invers' is none of \"linear\", \"inverse\"; did you mean "
            "'inverse'?");
}

}  // namespace
}  // namespace gamer::fractal_test
