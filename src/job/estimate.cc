#include "gamer/job/estimate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <functional>
#include <numbers>
#include <numeric>
#include <vector>

#include "gamer/job/report.h"
#include "gamer/job/resume.h"
#include "gamer/job/schedule.h"
#include "gamer/job/stamps.h"
#include "gamer/job/truth_table.h"
#include "gamer/render/renderer.h"
#include "image/image_suffix.h"
#include "image/memory.h"
#include "image/picture_size.h"

namespace gamer {
namespace {

constexpr std::size_t most_tiles = 256;
constexpr std::size_t most_measured = 16;
constexpr double microsecond = 1e-6;
/// Rank 0's time for each value of a pixel, in the journal (1 to 10 ns) and the writer;
/// bench/journal_bench.cc measures it.
constexpr double writing_seconds = 5e-9;

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::uint64_t resident_memory() {
  std::uint64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Seconds per unit of cost, from the times of squares of pixels around samples. A square is a
/// whole tile where tiles are cheap. Where time is short it is smaller, down to a pixel.
double seconds_per_cost(const Renderer& renderer, const std::vector<CostSample>& samples,
                        double most_seconds) {
  std::vector<double> sums(samples.size());
  std::transform_inclusive_scan(samples.begin(), samples.end(), sums.begin(), std::plus<>(),
                                [](const CostSample& sample) { return sample.cost; });
  const double all = sums.empty() ? 0 : sums.back();
  if (!(all > 0)) return microsecond;
  double seconds = 0, cost = 0, spent = 0;
  int side = 1;
  for (std::size_t tile = 0; tile < most_tiles && spent < most_seconds; ++tile) {
    // Multiples of the golden ratio keep the samples evenly spread after any number of tiles.
    const double at = all * std::fmod((static_cast<double>(tile) + 0.5) * std::numbers::phi, 1.0);
    const auto found = std::lower_bound(sums.begin(), sums.end(), at);
    const CostSample& sample =
        samples[static_cast<std::size_t>(std::min(found, sums.end() - 1) - sums.begin())];
    const int left = sample.x - sample.x % side, bottom = sample.y - sample.y % side;
    RenderCounts counts;
    const double begin = thread_seconds();
    renderer.count_pixels(left, std::min(left + side, renderer.width()), bottom,
                          std::min(bottom + side, renderer.height()), counts);
    const double took = thread_seconds() - begin;
    spent += took;
    constexpr int least_tiles = 5;
    if (took < most_seconds / least_tiles / 4) side = std::min(2 * side, Renderer::tile_rows);
    // The first sample is not counted: it fills caches that later ones use.
    if (tile == 0 && spent < most_seconds) continue;
    seconds += took;
    cost += estimated_cost(counts);
  }
  return cost > 0 ? seconds / cost : microsecond;
}

/// Costs of pixels that were sampled in a limited time.
struct TimedSamples {
  std::vector<CostSample> samples;
  double seconds = 0;  ///< that all samples of the job take
};

TimedSamples sample_in_time(const Renderer& renderer, double most_seconds) {
  ThreadExecutor alone(1);
  const int all = sampled_rows(renderer.height());
  constexpr int more = 4;
  for (int rows = 1;; rows *= more) {
    rows = std::min(rows, all);
    const double begin = thread_seconds();
    std::vector<CostSample> samples = sample_costs(renderer, alone, rows);
    const double took = thread_seconds() - begin;
    if (rows < all && took * more < most_seconds) continue;
    return {std::move(samples), took * all / rows};
  }
}

/// Seconds in which the stars of star fields are drawn.
double star_seconds(const Renderer& renderer, double most_seconds) {
  const int all = renderer.field_tiles();
  const int count = std::min(all, static_cast<int>(most_tiles));
  const double begin = thread_seconds();
  double seconds = 0;
  int done = 0;
  for (; done < count && seconds < most_seconds; ++done) {
    // Multiples of the golden ratio keep the tiles evenly spread after any number of them.
    const double share = std::fmod((done + 0.5) * std::numbers::phi, 1.0);
    RenderCounts counts;
    renderer.count_field_stars(count == all ? done : static_cast<int>(share * all), counts);
    seconds = thread_seconds() - begin;
  }
  return done > 0 ? seconds / done * all : 0;
}

double truth_seconds(const RenderJob& job, double most_seconds) {
  const std::vector<PlacedGalaxy>& galaxies = job.scene->galaxies;
  const std::size_t count = std::min(galaxies.size(), most_measured);
  if (count == 0) return 0;
  const double begin = thread_seconds();
  double seconds = 0;
  std::size_t done = 0;
  for (; done < count && seconds < most_seconds; ++done) {
    const double share = std::fmod((static_cast<double>(done) + 0.5) * std::numbers::phi, 1.0);
    const auto place = static_cast<std::size_t>(share * static_cast<double>(galaxies.size()));
    measure_for_truth(job, place);
    seconds = thread_seconds() - begin;
  }
  return seconds / static_cast<double>(done) * static_cast<double>(galaxies.size());
}

/// The share of the objects of TRUTH that is still to be measured.
double share_left(const RenderJob& job, int done) {
  const auto all = static_cast<double>(job.scene->objects);
  return all > 0 ? std::max(0.0, 1 - done / all) : 0;
}

/// Finished rows cost nothing.
void clear_rows(const std::vector<RowRange>& finished, std::vector<double>& costs) {
  const auto end = static_cast<int>(costs.size());
  for (const RowRange& rows : finished) {
    std::fill(costs.begin() + std::min(rows.first, end), costs.begin() + std::min(rows.last, end),
              0.0);
  }
}

}  // namespace

double process_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

double thread_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }

JobEstimate estimate_job(const RenderJob& job, bool truth, int ranks, int threads,
                         const Preparation& preparation, const FinishedWork& done,
                         double most_seconds) {
  JobEstimate estimate;
  const int workers = ranks * threads;
  const double begin = process_seconds();
  const TruthSettings images = truth ? job.parameters.truth : TruthSettings();
  const Renderer renderer = image_renderer(job, images);
  const double placing = process_seconds() - begin;
  const auto [samples, sampling] = sample_in_time(renderer, 2 * most_seconds);
  std::vector<double> costs = row_costs(samples, renderer.width(), renderer.height());
  const double together = preparation.measuring + (samples_costs(renderer, workers) ? sampling : 0);
  estimate.preparing = preparation.reading + placing + together;
  const std::uint64_t before = resident_memory();

  const double unit = seconds_per_cost(renderer, samples, most_seconds);
  if (truth) estimate.truth = truth_seconds(job, most_seconds) * share_left(job, done.objects);
  const std::vector<RowRange> blocks = render_blocks(renderer, workers, costs);
  const double stars = star_seconds(renderer, most_seconds) / static_cast<double>(costs.size());
  for (double& cost : costs) cost = unit * cost + stars;
  clear_rows(done.rows, costs);
  estimate.rendering = std::accumulate(costs.begin(), costs.end(), 0.0);
  const double values = static_cast<double>(renderer.width()) * renderer.height() *
                        static_cast<double>(renderer.planes());
  const double writing = writing_seconds * values;
  const double rows_seconds =
      workers == 1
          ? estimate.rendering + writing
          : std::max(time_of_blocks(unfinished_blocks(blocks, done.rows), costs, workers), writing);
  // Rank 0 reads and checks before the others begin.
  estimate.wall = (ranks > 1 ? 2 : 1) * preparation.reading + placing +
                  (together + estimate.truth) / workers + rows_seconds;

  int rows = 0;
  for (const RowRange& block : blocks) rows = std::max(rows, block.size());
  const auto of_rows = [&](int count) {
    return static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(renderer.planes()) *
           static_cast<std::uint64_t>(renderer.width()) * sizeof(double);
  };
  const std::uint64_t now = resident_memory();
  const std::uint64_t of_thread = now > before ? now - before : 0;
  const std::uint64_t working = now + static_cast<std::uint64_t>(threads - 1) * of_thread +
                                of_rows(held_blocks(ranks, threads) * rows);
  estimate.other_memory = std::max(peak_memory(), working);
  const auto suffix = image_suffix(job.parameters.image.output.path);
  const bool is_fits = suffix == ImageSuffix::fits || suffix == ImageSuffix::fits_compressed;
  const std::uint64_t pending =
      std::min<std::uint64_t>(Journal::most_pending, of_rows(renderer.height()));
  const std::uint64_t picture =
      is_fits ? 0
              : picture_memory(renderer.width(), renderer.height(), renderer.planes(),
                               job.parameters.image.output.style);
  estimate.memory = std::max(peak_memory(), working + pending + picture);
  return estimate;
}

JobEstimate estimate_stamps(const RenderJob& job, bool truth, int ranks, int threads,
                            const Preparation& preparation, double most_seconds) {
  JobEstimate estimate;
  estimate.preparing = preparation.reading + preparation.measuring;
  const StampRenderer stamps(job);
  double seconds = 0, sampled = 0, all = 0;
  for (std::size_t stamp = 0; stamp < stamps.size(); ++stamp) {
    all += static_cast<double>(stamps.values(stamp));
  }
  const double begin = thread_seconds();
  const std::size_t count = std::min(stamps.size(), most_measured);
  for (std::size_t k = 0; k < count && thread_seconds() - begin < most_seconds; ++k) {
    const double share = std::fmod((static_cast<double>(k) + 0.5) * std::numbers::phi, 1.0);
    const auto stamp = static_cast<std::size_t>(share * static_cast<double>(stamps.size()));
    const double start = thread_seconds();
    const Renderer renderer = stamps.renderer(stamp);
    const double placing = thread_seconds() - start;
    constexpr double part = 0.25;
    const auto samples = sample_in_time(renderer, part * most_seconds).samples;
    const std::vector<double> costs = row_costs(samples, renderer.width(), renderer.height());
    seconds += placing + star_seconds(renderer, part * most_seconds) +
               std::accumulate(costs.begin(), costs.end(), 0.0) *
                   seconds_per_cost(renderer, samples, part * most_seconds);
    sampled += static_cast<double>(stamps.values(stamp));
  }
  if (sampled > 0) estimate.rendering = seconds * all / sampled;
  if (truth) estimate.truth = truth_seconds(job, most_seconds);
  const double workers = static_cast<double>(ranks) * threads;
  estimate.wall = (ranks > 1 ? 2 : 1) * preparation.reading +
                  (preparation.measuring + estimate.truth + estimate.rendering) / workers;
  estimate.memory = estimate.other_memory =
      peak_memory() + static_cast<std::uint64_t>(held_blocks(ranks, threads)) * stamps.most_bytes();
  return estimate;
}

std::string estimate_text(const JobEstimate& estimate, int ranks, int threads) {
  const auto count = [](int number, const char* what) {
    return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
  };
  std::string text = fmt::format(
      "about {:.3g} s with {} of {}: {:.2g} s to prepare, {:.3g} core seconds of rendering",
      estimate.wall, count(ranks, "rank"), count(threads, "thread"), estimate.preparing,
      estimate.rendering);
  if (estimate.truth > 0) text += fmt::format(", {:.3g} of the truth's table", estimate.truth);
  text += fmt::format("; memory {}", bytes_text(estimate.memory));
  if (ranks > 1) {
    text += fmt::format(" on rank 0, {} on each other", bytes_text(estimate.other_memory));
  }
  return text;
}

}  // namespace gamer
