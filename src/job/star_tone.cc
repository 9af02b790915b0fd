#include "gamer/job/star_tone.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <ranges>
#include <vector>

#include "gamer/job/journal.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

// The sampled pixels are runs of neighbours in some rows. The tone takes the noise from differences
// of neighbours.
constexpr int most_rows = 96, most_runs = 24, run_length = 4, most_galaxies = 16;
/// Smallest radius, relative to the largest, of a galaxy whose centre decides the white. The
/// nuclei of small galaxies behind a large one may be much brighter than its disk.
constexpr double least_radius = 0.25;
/// Distance from a galaxy's centre at which its light is taken as white, in bounding radii. In
/// zooms the unit is the radius of a circle of the window's area. Within twice this distance are
/// 1e-4 of a round galaxy's pixels, the share that automatic_tone() lets be brighter than white.
/// The middle of an edge-on galaxy is narrower.
constexpr double white_distance = 0.005;

/// A row of the window and runs of its columns, which ascend and do not overlap.
struct SampledRow {
  int y;
  std::vector<RowRange> columns;
};

/// The middle of part `i` of `parts` equal parts.
int middle_of(int i, int parts, int size) {
  return static_cast<int>((2 * static_cast<long long>(i) + 1) * size / (2 * parts));
}

/// The part, of `parts` equal parts, that holds a place.
int part_of(int place, int parts, int size) {
  return static_cast<int>(static_cast<long long>(place) * parts / size);
}

/// Evenly spread rows and runs.
std::vector<SampledRow> even_sample(int width, int height) {
  std::vector<RowRange> runs;
  if (width <= most_runs * run_length) {
    runs = {{0, width}};
  } else {
    for (int run = 0; run < most_runs; ++run) {
      const int first = middle_of(run, most_runs, width) - run_length / 2;
      runs.push_back({first, first + run_length});
    }
  }
  const int rows = std::min(height, most_rows);
  std::vector<SampledRow> sample;
  for (int i = 0; i < rows; ++i) sample.push_back({middle_of(i, rows, height), runs});
  return sample;
}

/// Moves the nearest run of a row towards `first`, as far as its neighbours let it.
void move_run(std::vector<RowRange>& runs, int first, int width) {
  const auto count = static_cast<int>(runs.size());
  if (count == 1) return;
  const int i = part_of(std::clamp(first, 0, width - 1), count, width);
  const int least = i > 0 ? runs[i - 1].last : 0;
  const int most = (i + 1 < count ? runs[i + 1].first : width) - run_length;
  const int moved = std::clamp(first, least, most);
  runs[i] = {moved, moved + run_length};
}

/// A galaxy in the window: its centre and its bounding radius, pixels.
struct SeenGalaxy {
  glm::dvec2 centre;
  double radius;
};

/// The galaxies of the largest bounding radii whose centres are in the window, without those much
/// smaller than the largest.
std::vector<SeenGalaxy> largest_galaxies(const RenderJob& job) {
  const ImageRegion& window = job.camera.window();
  std::vector<SeenGalaxy> found;
  for (const PlacedGalaxy& galaxy : job.scene->galaxies) {
    const auto place = job.camera.pixel(galaxy.centre);
    if (!place) continue;
    const glm::dvec2 centre = *place - glm::dvec2(window.left, window.bottom);
    if (centre.x > -0.5 && centre.x < window.width - 0.5 && centre.y > -0.5 &&
        centre.y < window.height - 0.5) {
      found.push_back({centre, galaxy.bounding_radius / job.camera.pixel_size(galaxy.centre)});
    }
  }
  std::ranges::stable_sort(found, std::greater<>(), &SeenGalaxy::radius);
  if (found.size() > most_galaxies) found.resize(most_galaxies);
  const double least = found.empty() ? 0 : least_radius * found.front().radius;
  std::erase_if(found, [&](const SeenGalaxy& galaxy) { return galaxy.radius < least; });
  return found;
}

/// The rows and runs whose pixels give the tone. An even sample misses the nuclei of galaxies,
/// which decide the white. Some runs therefore move next to the centres of the largest galaxies.
std::vector<SampledRow> choose_sample(const RenderJob& job) {
  const int width = job.camera.window().width, height = job.camera.window().height;
  std::vector<SampledRow> sample = even_sample(width, height);
  const double window_radius = std::sqrt(double(width) * height / std::numbers::pi);
  // Where a part of the rows holds two centres, that of the larger galaxy, which comes last,
  // decides.
  for (const SeenGalaxy& galaxy : std::views::reverse(largest_galaxies(job))) {
    const int distance =
        static_cast<int>(std::lround(white_distance * std::min(galaxy.radius, window_radius)));
    const int x = static_cast<int>(std::lround(galaxy.centre.x));
    const int y = static_cast<int>(std::lround(galaxy.centre.y));
    const int i = part_of(y, static_cast<int>(sample.size()), height);
    SampledRow& row = sample[i];
    row.y = y;
    const bool is_at_end = x + distance + run_length > width;
    move_run(row.columns, is_at_end ? x - distance - run_length + 1 : x + distance, width);
  }
  return sample;
}

}  // namespace

bool measures_star_tone(const RenderParameters& parameters, const Scene& scene) {
  const bool has_white = parameters.draws_star_discs() && !parameters.stars.white_point;
  return (has_white || parameters.image.output.style.seeing > 0) &&
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
  const std::vector<SampledRow> rows = choose_sample(job);
  const auto row_count = static_cast<int>(rows.size());
  const int column_count = count_rows(rows.front().columns);
  const auto width = static_cast<std::size_t>(renderer.width());
  const auto count = static_cast<std::size_t>(column_count);
  const auto planes = static_cast<std::size_t>(renderer.planes());
  const std::vector<double> values = ranks.compute_together(
      even_blocks(row_count, 1), planes * count, threads,
      [&](RowRange block, std::span<double> all) {
        std::vector<double> row(width * planes);
        auto to = all.begin();
        for (int i = block.first; i < block.last; ++i) {
          renderer.render_smooth(rows[i].y, rows[i].columns, row);
          for (std::size_t plane = 0; plane < planes; ++plane) {
            for (const RowRange& run : rows[i].columns) {
              to = std::copy_n(row.begin() + static_cast<std::ptrdiff_t>(plane * width) + run.first,
                               run.size(), to);
            }
          }
        }
      });
  Image sample(column_count, row_count, renderer.planes());
  for (int row = 0; row < row_count; ++row) {
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
