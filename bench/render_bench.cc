// Microseconds per pixel on one core. First comes each shipped scene. M100 follows for each SIMD
// target, for 1, 3 and 30 wavelengths or bands, and for tolerances of both samplers. Then comes a
// sky view of 100 galaxies, alone and among 10^5 rows of a list, with the time to place them. Last
// come a disk alone, a field of 10^11 stars in its place, and both, from outside and from within.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/core/simd.h"
#include "gamer/job/job.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

constexpr int image_size = 128;

/// A triangle of a band.
Resources::Text band(int i) {
  const int middle = 4400 + 3600 * i / 29;
  return {"bandpasses/band" + std::to_string(i), "band" + std::to_string(i),
          "# wavelength: Angstrom\n# response: photons\n" + std::to_string(middle - 150) + " 0\n" +
              std::to_string(middle) + " 1\n" + std::to_string(middle + 150) + " 0\n"};
}

std::string bands(int count) {
  std::string list = "spectrum.bands=[";
  for (int i = 0; i < count; ++i)
    list += (i == 0 ? "\"band" : ", \"band") + std::to_string(i) + '"';
  return list + "]";
}

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
  for (int i = 0; i < 30; ++i) resources.add(band(i));
  const RenderJob job = load_job(request, resources);
  const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
  constexpr std::size_t pixels = std::size_t{image_size} * image_size;
  std::vector<double> values(pixels * static_cast<std::size_t>(renderer.planes()));
  RenderCounts counts;
  const Clock clock;
  for (auto _ : state) renderer.render_rows({0, image_size}, values, counts);
  const double seconds = clock.seconds();
  const auto rendered = static_cast<double>(state.iterations()) * pixels;
  // The time per pixel, since invert turns a rate of pixels into seconds.
  state.counters["per_pixel"] =
      benchmark::Counter(rendered, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["nodes_per_pixel"] = static_cast<double>(counts.nodes) / rendered;
  state.counters["rays_per_pixel"] = static_cast<double>(counts.rays) / rendered;
  const auto noise = static_cast<double>(counts.noise_evaluations);
  state.counters["noise_per_pixel"] = noise / rendered;
  state.counters["noise_per_second"] = counts.noise_seconds > 0 ? noise / counts.noise_seconds : 0;
  // Shares of the time in render_rows(); writing and waiting are those of jobs, see jobs.py.
  state.counters["share_noise"] = counts.noise_seconds / seconds;
  state.counters["share_envelopes"] = counts.envelope_seconds / seconds;
  state.counters["share_transfer"] = counts.transfer_seconds / seconds;
  use_simd_targets(0);
}

std::string thirty_wavelengths() {
  std::string list = "spectrum.wavelengths=[";
  for (int i = 0; i < 30; ++i) {
    list += (i == 0 ? "" : ", ") + std::to_string(4400 + 3600 * i / 29);
  }
  return list + "]";
}

/// 100 galaxies in the image, and `others` that do not touch it.
std::string crowd(int others) {
  std::string list = "galaxy ra dec redshift size_kpc inclination pa apparent_magnitude\n";
  const auto row = [&](double ra, double dec, int i) {
    list += "elliptical " + std::to_string(ra) + ' ' + std::to_string(dec) + ' ' +
            std::to_string(0.2 + 0.008 * (i % 100)) + " 6 " + std::to_string(i % 90) + ' ' +
            std::to_string(i % 180) + " 22\n";
  };
  for (int i = 0; i < 100; ++i) row(150 + 0.0015 * (i % 10 - 5), 2 + 0.0015 * (i / 10 - 5), i);
  for (int i = 0; i < others; ++i) row(150 + 1e-4 * i, 5 + 1e-4 * i, i);
  return list;
}

/// Placing and rendering, without reading the text.
void render_crowd(benchmark::State& state, int others) {
  Resources resources({std::filesystem::path(GAMER_BENCH_SOURCE_DIR)});
  const std::string text = crowd(others);
  const RenderParameters parameters = RenderParameters::read(
      parse_toml("[image]\nsize = 400\n[camera]\nprojection = \"sky\"\ncenter = [150, 2]\n"
                 "pixel_scale = 0.14\n[spectrum]\nbands = [\"sdss_r\"]\n",
                 "crowd"));
  const Camera camera(parameters);
  const Spectrum spectrum = load_spectrum(parameters, resources);
  const Catalogue catalogue = Catalogue::parse(text, "crowd", CatalogueFormat::list);
  std::vector<double> values(std::size_t{400} * 400);
  for (auto _ : state) {
    const auto scene = std::make_shared<const Scene>(
        read_scene(catalogue, parameters, spectrum, camera, resources));
    Renderer(parameters, camera, scene, spectrum).render_rows({0, 400}, values);
    state.counters["galaxies"] = static_cast<double>(scene->galaxies.size());
  }
}

/// A disk, a star field, or both, in dust or not, at 256 x 256 pixels.
void render_field(benchmark::State& state, const std::string& components, bool is_inside) {
  const auto layer = [](const std::string& kind, const std::string& more) {
    return "[[component]]\nclass = \"" + kind +
           "\"\nz0 = 0.03\nrh = 0.2\narm_width = 2\ntwirl = 0.5\n" + more + "\n";
  };
  std::string galaxy = "[arms]\nmodel = \"logarithmic\"\n";
  if (components.find("disk") != std::string::npos) galaxy += layer("disk", "sed = \"flat\"");
  if (components.find("field") != std::string::npos) galaxy += layer("starfield", "number = 1e11");
  if (components.find("dust") != std::string::npos) galaxy += layer("dust", "");
  Resources resources = Resources::from_record({{"galaxies/g", "g.toml", galaxy}});
  const RenderParameters parameters =
      RenderParameters::read(parse_toml(std::string("[image]\nsize = 256\n[camera]\n") +
                                            (is_inside ? "position = [0, -0.35, 0.01]\nfov = 60\n"
                                                       : "position = [0, -2, 2]\nfov = 35\n") +
                                            "[spectrum]\nwavelengths = [4300, 5750, 7400]\n",
                                        "field"));
  const Camera camera(parameters);
  const Spectrum spectrum = load_spectrum(parameters, resources);
  const auto scene = std::make_shared<const Scene>(
      read_scene("galaxy x y z\ng 0 0 0\n", "field", parameters, spectrum, camera, resources));
  const Renderer renderer(parameters, camera, scene, spectrum);
  std::vector<double> values(std::size_t{256} * 256 * 3);
  for (auto _ : state) renderer.render_rows({0, 256}, values);
  state.counters["per_pixel"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * 256 * 256,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
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
  add("bands/1", "ngc4321", {bands(1)});
  add("bands/30", "ngc4321", {bands(30)});
  for (const int others : {0, 99900}) {
    benchmark::RegisterBenchmark(("crowd/100 of " + std::to_string(100 + others)).c_str(),
                                 [=](benchmark::State& state) { render_crowd(state, others); })
        ->Unit(benchmark::kMillisecond);
  }
  for (const bool is_inside : {false, true}) {
    for (const std::string components :
         {"disk", "field", "disk+field", "disk+dust", "field+dust", "disk+field+dust"}) {
      benchmark::RegisterBenchmark(
          ((is_inside ? "stars/inside/" : "stars/outside/") + components).c_str(),
          [=](benchmark::State& state) { render_field(state, components, is_inside); })
          ->Unit(benchmark::kMillisecond);
    }
  }
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
