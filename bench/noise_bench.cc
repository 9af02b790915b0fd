// Noise evaluations per second on one core, for each kind and SIMD target.

#include <benchmark/benchmark.h>

#include <array>
#include <string>

#include "gamer/core/random.h"
#include "gamer/core/simd.h"
#include "gamer/noise/noise.h"

namespace gamer {
namespace {

constexpr int octave_count = 8;

void sum_octaves(benchmark::State& state, const Noise& noise, std::int64_t target) {
  use_simd_targets(target);
  BatchArray x, y, z, out;
  for (std::size_t i = 0; i < batch_capacity; ++i) {
    // Points of a ray: neighbours are close together, as in a render.
    x[i] = static_cast<float>(0.3 + 0.002 * static_cast<double>(i));
    y[i] = static_cast<float>(-0.2 + 0.001 * static_cast<double>(i));
    z[i] = static_cast<float>(0.02 * to_unit(mix64(i)));
  }
  std::array<Octave, octave_count> octaves;
  for (int k = 0; k < octave_count; ++k) {
    octaves[static_cast<std::size_t>(k)].frequency = static_cast<float>(2 * k + 2);
    octaves[static_cast<std::size_t>(k)].seed = static_cast<std::uint32_t>(mix64(k + 1u));
  }
  for (auto _ : state) {
    noise.sum({x.data(), y.data(), z.data(), batch_capacity}, octaves, out.data());
    benchmark::DoNotOptimize(out.values[0]);
    benchmark::ClobberMemory();
  }
  state.counters["evaluations"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * octave_count * batch_capacity,
                         benchmark::Counter::kIsRate);
  use_simd_targets(0);
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  using namespace gamer;
  for (const Noise* noise : noise_kinds()) {
    for (const std::int64_t target : simd_targets()) {
      const std::string name = std::string(noise->name()) + "/" + simd_target_name(target);
      benchmark::RegisterBenchmark(name.c_str(), [noise, target](benchmark::State& state) {
        sum_octaves(state, *noise, target);
      });
    }
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
