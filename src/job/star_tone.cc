#include "gamer/job/star_tone.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "gamer/job/journal.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

// The sampled pixels are runs of neighbours in some rows. The tone takes the noise from differences
// of neighbours.
constexpr int most_rows = 96, most_runs = 24, run_length = 4, most_centres = 16;
/// Share of an image's pixels that may be brighter than its white, as in automatic_tone().
constexpr double white_share = 1e-4;

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

/// The centres of the largest galaxies whose centre is in the window, in the window's pixels.
std::vector<glm::dvec2> largest_centres(const RenderJob& job) {
  const ImageRegion& window = job.camera.window();
  std::vector<std::pair<double, glm::dvec2>> found;
  for (const PlacedGalaxy& galaxy : job.scene->galaxies) {
    const auto place = job.camera.pixel(galaxy.centre);
    if (!place) continue;
    const glm::dvec2 pixel = *place - glm::dvec2(window.left, window.bottom);
    if (!(pixel.x > -0.5 && pixel.x < window.width - 0.5 && pixel.y > -0.5 &&
          pixel.y < window.height - 0.5)) {
      continue;
    }
    found.emplace_back(galaxy.bounding_radius / job.camera.pixel_size(galaxy.centre), pixel);
  }
  std::ranges::stable_sort(found, std::greater<>(), &std::pair<double, glm::dvec2>::first);
  if (found.size() > most_centres) found.resize(most_centres);
  std::vector<glm::dvec2> centres;
  for (const auto& [size, pixel] : found) centres.push_back(pixel);
  return centres;
}

/// The rows and runs whose pixels give the tone. An even sample misses the nuclei of galaxies, and
/// with them the white, so that some runs move there. In a picture of round galaxies the brightest
/// pixels, in number `white_share` of all, are within a radius of the centres: a run begins there.
std::vector<SampledRow> choose_sample(const RenderJob& job) {
  const int width = job.camera.window().width, height = job.camera.window().height;
  std::vector<SampledRow> sample = even_sample(width, height);
  const std::vector<glm::dvec2> centres = largest_centres(job);
  const double radius =
      std::sqrt(white_share * width * height /
                (std::numbers::pi * static_cast<double>(std::max<std::size_t>(centres.size(), 1))));
  std::vector<bool> has_moved(sample.size());
  for (const glm::dvec2& centre : centres) {
    const int y = static_cast<int>(std::lround(centre.y));
    const int i = part_of(y, static_cast<int>(sample.size()), height);
    // Where a part of the rows holds two centres, the row of the larger galaxy stays.
    if (has_moved[i]) continue;
    has_moved[i] = true;
    sample[i].y = y;
    move_run(sample[i].columns, static_cast<int>(std::lround(centre.x + radius)), width);
  }
  return sample;
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
  const std::vector<SampledRow> rows = choose_sample(job);
  const auto row_count = static_cast<int>(rows.size());
  const int columns = count_rows(rows.front().columns);
  const auto width = static_cast<std::size_t>(renderer.width());
  const auto count = static_cast<std::size_t>(columns);
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
  Image sample(columns, row_count, renderer.planes());
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
