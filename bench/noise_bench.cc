// Noise evaluations per second on one core, for each kind and SIMD target. Measured are sums of
// octaves, other combinations, octaves on a helix and a torus, and vector values, which count once
// for all components. The first line is the core's peak, in multiplications and additions per
// second.

#include <benchmark/benchmark.h>

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bench/peak.h"
#include "gamer/core/random.h"
#include "gamer/core/simd.h"
#include "gamer/noise/noise.h"

namespace gamer {
namespace {

constexpr int octave_count = 8;

/// The evaluation of octaves at points.
using Work = std::function<void(const Noise&, const Points&, std::span<const Octave>,
                                std::span<float* const>)>;

struct Task {
  const char* name;
  bool identifies;  ///< octaves on cubic lattices only
  Work work;
  std::function<void(Octave&, int)> prepare = [](Octave&, int) {};
};

Work combining(const Combination& combination) {
  return [combination](const Noise& noise, const Points& points, std::span<const Octave> octaves,
                       std::span<float* const> out) {
    noise.combine(combination, points, octaves, out[0]);
  };
}

std::vector<Task> tasks() {
  const Work sum = [](const Noise& noise, const Points& points, std::span<const Octave> octaves,
                      std::span<float* const> out) { noise.sum(points, octaves, out[0]); };
  const auto components = [](std::size_t count) -> Work {
    return [count](const Noise& noise, const Points& points, std::span<const Octave> octaves,
                   std::span<float* const> out) {
      noise.sum_vector(points, octaves, out.first(count));
    };
  };
  using enum Combination::Kind;
  return {
      {"sum", false, sum},
      {"multiplicative", false, combining({multiplicative})},
      {"billow", false, combining({billow})},
      {"ridged", false, combining({ridged})},
      {"vector2", false, components(2)},
      {"vector3", false, components(3)},
      {"helix", true, sum,
       [](Octave& octave, int k) {
         octave.translation[0] = 2 * (k + 1);
         octave.translation[1] = 5 * (k + 1);
       }},
      {"torus", true, sum,
       [](Octave& octave, int k) {
         octave.period[0] = 2 * (k + 1);
         octave.period[1] = 5 * (k + 1);
       }},
  };
}

void evaluate(benchmark::State& state, const Noise& noise, const Task& task, std::int64_t target) {
  use_simd_targets(target);
  BatchArray x, y, z, out[Noise::most_components];
  for (std::size_t i = 0; i < batch_capacity; ++i) {
    // Points of a ray: neighbours are close together, as in a render.
    x[i] = static_cast<float>(0.3 + 0.002 * static_cast<double>(i));
    y[i] = static_cast<float>(-0.2 + 0.001 * static_cast<double>(i));
    z[i] = static_cast<float>(0.02 * to_unit(mix64(i)));
  }
  std::array<Octave, octave_count> octaves;
  for (int k = 0; k < octave_count; ++k) {
    Octave& octave = octaves[static_cast<std::size_t>(k)];
    octave.frequency = static_cast<float>(2 * k + 2);
    octave.seed = static_cast<std::uint32_t>(mix64(k + 1u));
    task.prepare(octave, k);
  }
  float* const arrays[] = {out[0].data(), out[1].data(), out[2].data()};
  for (auto _ : state) {
    task.work(noise, {x.data(), y.data(), z.data(), batch_capacity}, octaves, arrays);
    benchmark::DoNotOptimize(out[0].values[0]);
    benchmark::ClobberMemory();
  }
  state.counters["evaluations"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * octave_count * batch_capacity,
                         benchmark::Counter::kIsRate);
  use_simd_targets(0);
}

void reach_peak(benchmark::State& state, std::int64_t target) {
  use_simd_targets(target);
  for (auto _ : state) benchmark::DoNotOptimize(work_at_peak());
  state.counters["FLOP"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * static_cast<double>(peak_operations()),
      benchmark::Counter::kIsRate);
  use_simd_targets(0);
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  using namespace gamer;
  for (const std::int64_t target : simd_targets()) {
    benchmark::RegisterBenchmark(("peak/" + simd_target_name(target)).c_str(),
                                 [target](benchmark::State& state) { reach_peak(state, target); });
  }
  for (const Noise* noise : noise_kinds()) {
    for (const Task& task : tasks()) {
      if (task.identifies && !noise->identifies()) continue;
      for (const std::int64_t target : simd_targets()) {
        const std::string name =
            std::string(noise->name()) + "/" + task.name + "/" + simd_target_name(target);
        benchmark::RegisterBenchmark(name.c_str(), [noise, task, target](benchmark::State& state) {
          evaluate(state, *noise, task, target);
        });
      }
    }
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
