// Error against time on scenes/bench_spiral for settings of both samplers, as a table in Markdown.
// The error is the rms relative difference from an image of tolerance 1e-5, over pixels above 1 %
// of the peak, in the worst of three planes. Times are microseconds per pixel, the least of two
// runs. They are measured with 1, 3 and 30 wavelengths in one thread. For 3 wavelengths they are
// also measured in two threads and for each SIMD target.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/core/simd.h"
#include "gamer/job/job.h"
#include "gamer/job/schedule.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

constexpr int image_size = 256;
constexpr int repeats = 2;

struct Setting {
  const char* label;
  std::vector<std::string> keys;
};

std::string wavelengths(int count) {
  std::string list = "spectrum.wavelengths=[";
  for (int i = 0; i < count; ++i) {
    list +=
        (i == 0 ? "" : ", ") + std::to_string(count == 1 ? 5500 : 4300 + 2700 * i / (count - 1));
  }
  return list + "]";
}

Renderer make_renderer(const Setting& setting, int planes) {
  const fs::path folder = fs::path(GAMER_BENCH_SOURCE_DIR) / "scenes";
  JobRequest request;
  request.parameters = folder / "bench_spiral.par";
  request.scene = folder / "bench_spiral.lst";
  request.settings = setting.keys;
  request.settings.push_back("image.size=" + std::to_string(image_size));
  request.settings.push_back(wavelengths(planes));
  Resources resources({fs::path(GAMER_BENCH_SOURCE_DIR)});
  const RenderJob job = load_job(request, resources);
  return Renderer(job.parameters, job.camera, job.scene, job.spectrum);
}

Image render(const Setting& setting, int planes) {
  ThreadExecutor executor(2);
  return render_image(make_renderer(setting, planes), executor);
}

/// Microseconds per pixel, without the statistics of the galaxy.
double cost(const Setting& setting, int planes, int threads) {
  const Renderer renderer = make_renderer(setting, planes);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repeats; ++i) {
    ThreadExecutor executor(threads);
    const Clock clock;
    render_image(renderer, executor);
    least = std::min(least, clock.seconds());
  }
  return 1e6 * least / (double{image_size} * image_size);
}

double rms_error(const Image& image, const Image& exact) {
  double worst = 0;
  for (int plane = 0; plane < image.planes(); ++plane) {
    double peak = 0, sum = 0;
    int count = 0;
    for (int y = 0; y < image_size; ++y) {
      for (int x = 0; x < image_size; ++x) peak = std::max(peak, exact.at(x, y, plane));
    }
    for (int y = 0; y < image_size; ++y) {
      for (int x = 0; x < image_size; ++x) {
        const double wanted = exact.at(x, y, plane);
        if (wanted < 0.01 * peak) continue;
        sum += std::pow(image.at(x, y, plane) / wanted - 1, 2);
        ++count;
      }
    }
    worst = std::max(worst, std::sqrt(sum / count));
  }
  return worst;
}

void print_table() {
  const std::vector<Setting> settings = {
      {"adaptive, 3e-2", {"sampling.tolerance=3e-2"}},
      {"adaptive, 1e-2", {"sampling.tolerance=1e-2"}},
      {"adaptive, 9e-3", {"sampling.tolerance=9e-3"}},
      {"adaptive, 1e-3", {"sampling.tolerance=1e-3"}},
      {"adaptive, 1e-4", {"sampling.tolerance=1e-4"}},
      {"uniform, 0.02", {"sampling.sampler=\"uniform\"", "sampling.step=0.02"}},
      {"uniform, 0.01", {"sampling.sampler=\"uniform\"", "sampling.step=0.01"}},
      {"uniform, 0.005", {"sampling.sampler=\"uniform\"", "sampling.step=0.005"}},
  };
  const std::vector<std::int64_t> targets = simd_targets();
  std::string head = "| sampler | rms error | 1 | 3 | 30 | 3, two threads |";
  std::string rule = "|---|---|---|---|---|---|";
  for (const std::int64_t target : targets) {
    head += fmt::format(" 3, {} |", simd_target_name(target));
    rule += "---|";
  }
  fmt::print("{}\n{}\n", head, rule);
  const Image exact = render({"", {"sampling.tolerance=1e-5"}}, 3);
  for (const Setting& setting : settings) {
    fmt::print("| {} | {:.2g} |", setting.label, rms_error(render(setting, 3), exact));
    for (const int planes : {1, 3, 30}) fmt::print(" {:.2f} |", cost(setting, planes, 1));
    fmt::print(" {:.2f} |", cost(setting, 3, 2));
    for (const std::int64_t target : targets) {
      use_simd_targets(target);
      fmt::print(" {:.2f} |", cost(setting, 3, 1));
      use_simd_targets(0);
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace gamer

int main() { gamer::print_table(); }
