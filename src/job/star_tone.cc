#include "gamer/job/star_tone.h"

#include <algorithm>
#include <vector>

#include "gamer/job/journal.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

// The sampled pixels are runs of neighbours in some rows. The tone takes the noise from differences
// of neighbours.
constexpr int most_rows = 96, most_runs = 24, run_length = 4;

/// The middle of part `i` of `parts` equal parts.
int middle_of(int i, int parts, int size) {
  return static_cast<int>((2 * static_cast<long long>(i) + 1) * size / (2 * parts));
}

std::vector<RowRange> sampled_columns(int width) {
  if (width <= most_runs * run_length) return {{0, width}};
  std::vector<RowRange> runs;
  for (int run = 0; run < most_runs; ++run) {
    const int first = middle_of(run, most_runs, width) - run_length / 2;
    runs.push_back({first, first + run_length});
  }
  return runs;
}

}  // namespace

bool measures_star_tone(const RenderParameters& parameters, const Scene& scene) {
  return parameters.draws_star_discs() && !parameters.stars.white_point &&
         scene.unit != PixelUnit::magnitude &&
         (!scene.stars.empty() || std::ranges::any_of(scene.galaxies, &PlacedGalaxy::draws_stars));
}

PictureTone picture_tone(const RenderJob& job, const Image& image) {
  std::vector<double> wavelengths;
  for (const SpectralPlane& plane : job.spectrum.planes) wavelengths.push_back(plane.wavelength);
  return choose_tone(image, wavelengths, zero_points(job));
}

void find_star_tone(RenderJob& job, const Ranks& ranks, int threads) {
  if (job.parameters.image.output.tone) {
    job.parameters.stars.tone = job.parameters.image.output.tone;
    return;
  }
  RenderParameters parameters = job.parameters;
  parameters.sampling.stars_per_pixel = 0;
  const Renderer renderer(parameters, job.camera, job.scene, job.spectrum);
  const int rows = std::min(renderer.height(), most_rows);
  const std::vector<RowRange> columns = sampled_columns(renderer.width());
  const int sampled = count_rows(columns);
  const auto width = static_cast<std::size_t>(renderer.width());
  const auto count = static_cast<std::size_t>(sampled);
  const auto planes = static_cast<std::size_t>(renderer.planes());
  const std::vector<double> values = ranks.compute_together(
      even_blocks(rows, 1), planes * count, threads, [&](RowRange block, std::span<double> all) {
        std::vector<double> row(width * planes);
        auto to = all.begin();
        for (int i = block.first; i < block.last; ++i) {
          renderer.render_smooth(middle_of(i, rows, renderer.height()), columns, row);
          for (std::size_t plane = 0; plane < planes; ++plane) {
            for (const RowRange& run : columns) {
              to = std::copy_n(row.begin() + static_cast<std::ptrdiff_t>(plane * width) + run.first,
                               run.size(), to);
            }
          }
        }
      });
  Image sample(sampled, rows, renderer.planes());
  for (int row = 0; row < rows; ++row) {
    for (std::size_t plane = 0; plane < planes; ++plane) {
      const std::size_t first = (static_cast<std::size_t>(row) * planes + plane) * count;
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(first), count,
                  &sample.at(0, row, static_cast<int>(plane)));
    }
  }
  job.parameters.stars.tone = picture_tone(job, sample).numbers();
}

OutputOptions toned_output(const OutputOptions& output, const RenderParameters& parameters) {
  OutputOptions result = output;
  if (!result.tone) result.tone = parameters.stars.tone;
  return result;
}

}  // namespace gamer
