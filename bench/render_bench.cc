// Microseconds per pixel of the shipped scenes on one core: each scene; and M100 for each SIMD
// target, for 1, 3 and 30 wavelengths, and for tolerances of both samplers.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gamer/core/simd.h"
#include "gamer/render/job.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

constexpr int image_size = 128;

void render(benchmark::State& state, const std::string& scene,
            const std::vector<std::string>& settings, std::int64_t target) {
  use_simd_targets(target);
  const fs::path folder = fs::path(GAMER_BENCH_SOURCE_DIR) / "scenes";
  JobRequest request;
  request.parameters = folder / (scene + ".par");
  request.scene = folder / (scene + ".lst");
  request.settings = settings;
  request.settings.push_back("image.size=" + std::to_string(image_size));
  Resources resources({fs::path(GAMER_BENCH_SOURCE_DIR)});
  const RenderJob job = load_job(request, resources);
  const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
  constexpr std::size_t pixels = std::size_t{image_size} * image_size;
  std::vector<double> values(pixels * static_cast<std::size_t>(renderer.planes()));
  RenderCounts counts;
  for (auto _ : state) renderer.render_rows({0, image_size}, values, counts);
  const auto rendered = static_cast<double>(state.iterations()) * pixels;
  // Printed as time per pixel: with kInvert a rate of pixels becomes seconds.
  state.counters["per_pixel"] =
      benchmark::Counter(rendered, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["nodes_per_pixel"] = static_cast<double>(counts.nodes) / rendered;
  use_simd_targets(0);
}

std::string thirty_wavelengths() {
  std::string list = "spectrum.wavelengths=[";
  for (int i = 0; i < 30; ++i) {
    list += (i == 0 ? "" : ", ") + std::to_string(4400 + 3600 * i / 29);
  }
  return list + "]";
}

void add(const std::string& name, const std::string& scene,
         const std::vector<std::string>& settings = {}, std::int64_t target = 0) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    render(state, scene, settings, target);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  using namespace gamer;
  std::vector<std::string> scenes;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(GAMER_BENCH_SOURCE_DIR) / "scenes")) {
    if (entry.path().extension() == ".lst") scenes.push_back(entry.path().stem());
  }
  std::sort(scenes.begin(), scenes.end());
  for (const std::string& scene : scenes) add("scene/" + scene, scene);
  for (const std::int64_t target : simd_targets()) {
    add("target/" + simd_target_name(target), "ngc4321", {}, target);
  }
  add("wavelengths/1", "ngc4321", {"spectrum.wavelengths=[5500]"});
  add("wavelengths/3", "ngc4321", {"spectrum.wavelengths=[4300, 5750, 7400]"});
  add("wavelengths/30", "ngc4321", {thirty_wavelengths()});
  for (const char* tolerance : {"1e-2", "1e-3", "1e-4"}) {
    add(std::string("adaptive/") + tolerance, "ngc4321",
        {std::string("sampling.tolerance=") + tolerance});
  }
  for (const char* step : {"0.02", "0.01", "0.005"}) {
    add(std::string("uniform/") + step, "ngc4321",
        {"sampling.sampler=\"uniform\"", std::string("sampling.step=") + step});
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
