// Errors of single rays through every shipped galaxy, as a table in Markdown. There is a column for
// each inclination from 0 to 89 degrees. It has the errors at the tolerances 1e-2, 1e-3 and 1e-4,
// in units of the tolerance, and the mean nodes of a ray at 1e-3. Errors are relative, rms over the
// rays above 1 % of the brightest, in the worst of three wavelengths. The reference is the uniform
// sampler with 10^5 steps.
//
//   ray_error_bench [GALAXY...]

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "render/galaxy_rays.h"

namespace gamer {
namespace {

constexpr int rays = 128;
constexpr double steps = 1e5;
constexpr double inclinations[] = {0, 40, 60, 75, 80, 85, 88, 89};
constexpr double tolerances[] = {1e-2, 1e-3, 1e-4};
constexpr double counted_tolerance = 1e-3;

void print_table(const std::vector<std::string>& galaxies) {
  std::string head = "| galaxy |", rule = "|---|";
  for (const double inclination : inclinations) {
    head += fmt::format(" {}° |", inclination);
    rule += "---|";
  }
  fmt::print("{}\n{}\n", head, rule);
  for (const std::string& galaxy : galaxies) {
    fmt::print("| {} |", galaxy);
    for (const double inclination : inclinations) {
      const GalaxyRays view(GAMER_BENCH_SOURCE_DIR, galaxy, inclination, rays);
      const std::vector<double> exact = view.uniform(steps);
      double nodes = 0;
      for (const double tolerance : tolerances) {
        RenderCounts counts;
        const std::vector<double> light = view.adaptive(tolerance, counts);
        fmt::print(" {:.2f}", view.rms_error(light, exact) / tolerance);
        if (tolerance == counted_tolerance) nodes = static_cast<double>(counts.nodes) / rays;
      }
      fmt::print("; {:.0f} |", nodes);
      std::fflush(stdout);
    }
    fmt::print("\n");
  }
}

}  // namespace
}  // namespace gamer

int main(int count, char** names) {
  std::vector<std::string> galaxies(names + 1, names + count);
  if (galaxies.empty()) {
    galaxies = gamer::names_in(std::filesystem::path(GAMER_BENCH_SOURCE_DIR) / "galaxies", ".toml");
  }
  gamer::print_table(galaxies);
}
