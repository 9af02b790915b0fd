// Time per point of components with eight octaves on one core, with dust beside veins. Rays resolve
// all of the texture, a part of it, or a part with the three variants of hidden dust.

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/random.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {
namespace {

constexpr double z0 = 0.012;
constexpr std::size_t batches = 200;

struct PointBatch {
  BatchArray x, y, z;
  RayBatch rays;
};

/// Points along rays through a face-on disk, 32 each, with footprints of a picture of 512 pixels.
std::vector<PointBatch> points() {
  std::vector<PointBatch> result(batches);
  for (std::uint64_t b = 0; b < batches; ++b) {
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const auto u = [&](std::uint64_t k) { return to_unit(hash_words({b, i / 32, k})); };
      const double r = 0.9 * std::sqrt(u(0));
      const double phi = 2 * std::numbers::pi * u(1);
      result[b].x[i] = static_cast<float>(r * std::cos(phi));
      result[b].y[i] = static_cast<float>(r * std::sin(phi));
      result[b].z[i] = static_cast<float>(2.5 * z0 * (static_cast<double>(i % 32) / 16 - 1));
      result[b].rays.footprint[i] = 0.0037F;
      result[b].rays.obliquity[i] = 0;
    }
  }
  return result;
}

std::shared_ptr<const Galaxy> galaxy(const std::string& component) {
  GalaxySettings settings;
  settings.noise_kind = &simplex_noise();
  Resources resources({});
  return Galaxy::parse(
      "[arms]\nmodel = \"logarithmic\"\npitch_angle = 17.853\n[[component]]\n"
      "z0 = " +
          std::to_string(z0) + "\nrh = 0.3\n" + component,
      "bench", settings, resources);
}

void evaluate(benchmark::State& state, const std::string& component, bool footprints,
              std::span<const double> deviations) {
  const auto type = galaxy(component);
  const std::vector<PointBatch> places = points();
  std::vector<BatchArray> densities(3);
  constexpr float threshold = 1e-5F;
  EvaluationCounts counts;
  for (auto _ : state) {
    for (const PointBatch& p : places) {
      type->evaluate({p.x.data(), p.y.data(), p.z.data(), batch_capacity}, threshold,
                     footprints ? &p.rays : nullptr, deviations, densities, counts);
    }
  }
  const auto all = static_cast<double>(state.iterations() * batches * batch_capacity);
  state.counters["ns/point"] =
      benchmark::Counter(1e-9 * all, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["noises/point"] = static_cast<double>(counts.noise_evaluations) / all;
}

void add_all() {
  const std::array<std::array<std::string, 2>, 3> components = {
      {{"dust, 8 octaves", "class = \"dust\"\n"},
       {"veins, 6 octaves and 2 of displacement", "class = \"veins\"\noctaves = 6\n"},
       {"veins, 8 octaves and 2 of displacement", "class = \"veins\"\n"}}};
  for (const auto& [name, text] : components) {
    const auto add = [&](const std::string& what, bool footprints,
                         std::span<const double> variants) {
      benchmark::RegisterBenchmark((name + ", " + what).c_str(),
                                   [text = text, footprints, variants](benchmark::State& state) {
                                     evaluate(state, text, footprints, variants);
                                   });
    };
    add("all seen", false, {});
    add("footprints", true, {});
    add("variants", true, dust_deviations);
  }
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  gamer::add_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
