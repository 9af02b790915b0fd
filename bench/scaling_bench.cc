// Predicts the efficiency of many ranks. Scenes are rendered once, strip by strip. The costs of
// rows, preparing, writing and messages are measured. A simulation of the protocol
// (src/parallel/mpi) then hands out the schedule's blocks to each number of ranks.
//
//   scaling_bench [--json FILE] [--growth 1,16] [--ranks 64,256,1024,4096] [--latency US]
//                 [--bandwidth GB/S] SCENE...        names of scenes/, SCENE:SIZE for another size
//
// Started by mpirun with two ranks or more, it measures the time of rank 0 for a block's messages.
// Otherwise it assumes 20 us. --growth G: the image has G times the pixels on a side.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <queue>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"
#include "gamer/image/image_writer.h"
#include "gamer/job/estimate.h"
#include "gamer/job/job.h"
#include "gamer/job/journal.h"
#include "gamer/job/schedule.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/renderer.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Seconds of rank 0; `latency` and `bandwidth` are those of the network.
struct Costs {
  double message = 20e-6;  ///< of a block: request, answer, head
  double value = 0;        ///< of a pixel in a plane: journal and file
  double latency = 5e-6;
  double bandwidth = 5e9;  ///< bytes/s
};

struct Workload {
  std::string name;
  int width = 0, height = 0, planes = 0;
  double reading = 0;     ///< seconds, of rank 0 and then of the others
  double measuring = 0;   ///< core seconds, shared by all ranks: textures, and costs of rows
  std::size_t parts = 0;  ///< number of parts in which textures are measured
  std::vector<double> estimated, measured;  ///< of each row; microseconds, seconds
};

struct Outcome {
  double wall = 0;     ///< from the first row to the last that is written
  double largest = 0;  ///< seconds of the largest block
  double server = 0;   ///< seconds that rank 0 hands out, receives and writes
  double tail = 0;     ///< mean time for which ranks wait for the last
  std::size_t blocks = 0;
};

Workload measure_scene(const std::string& name, int size) {
  const fs::path folder = fs::path(GAMER_BENCH_SOURCE_DIR) / "scenes";
  JobRequest request;
  request.parameters = folder / (name + ".par");
  request.scene = folder / (name + ".lst");
  if (size > 0) request.settings.push_back(fmt::format("image.size={}", size));
  Resources resources({fs::path(GAMER_BENCH_SOURCE_DIR)});
  const double begin = thread_seconds();
  RenderJob job = read_job(request, resources);
  const double read = thread_seconds();
  Workload load;
  for (const auto& galaxy : job.pending.galaxies) {
    load.parts += GalaxyStatistics(*galaxy).parts(GalaxyStatistics::Round::textures);
  }
  complete(job, Ranks(), 1);
  const double measured = thread_seconds();
  const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
  const double placed = thread_seconds();
  load.name = name;
  load.width = renderer.width();
  load.height = renderer.height();
  load.planes = renderer.planes();
  ThreadExecutor alone(1);
  load.estimated = estimate_row_costs(renderer, alone);
  load.reading = read - begin + placed - measured;
  load.measuring = measured - read + thread_seconds() - placed;
  std::vector<double> values;
  for (int first = 0; first < load.height; first += Renderer::tile_rows) {
    const RowRange rows{first, std::min(first + Renderer::tile_rows, load.height)};
    values.resize(static_cast<std::size_t>(rows.size()) * static_cast<std::size_t>(load.planes) *
                  static_cast<std::size_t>(load.width));
    const double start = thread_seconds();
    renderer.render_rows(rows, values);
    const double row = (thread_seconds() - start) / rows.size();
    load.measured.insert(load.measured.end(), static_cast<std::size_t>(rows.size()), row);
  }
  return load;
}

/// The workload's view with `growth` times the pixels on a side.
Workload grown(const Workload& load, int growth) {
  Workload result = load;
  result.width *= growth;
  result.height *= growth;
  for (auto* costs : {&result.estimated, &result.measured}) {
    std::vector<double> rows;
    for (const double cost : *costs) {
      rows.insert(rows.end(), static_cast<std::size_t>(growth), growth * cost);
    }
    *costs = std::move(rows);
  }
  return result;
}

/// Seconds to write a value that is not zero: journal and file, in the folder for temporary files.
double measure_writing() {
  constexpr int width = 2048, rows = 16, blocks = 64, planes = 3;
  const fs::path folder = fs::temp_directory_path();
  ImageHeader header;
  header.width = width;
  header.height = rows * blocks;
  header.labels = {"a", "b", "c"};
  header.wavelengths = {4000, 5000, 6000};
  OutputOptions output;
  output.path = folder / "scaling_bench.fits";
  output.overwrite = true;
  Journal journal(folder / "scaling_bench.journal", JournalHead{}, 10);
  const auto writer = make_image_writer(output, header);
  const std::vector<double> values(std::size_t{width} * rows * planes, 1.1);
  const double begin = thread_seconds();
  for (int block = 0; block < blocks; ++block) {
    const RowRange range{block * rows, (block + 1) * rows};
    journal.add_rows(0, range, values, true);
    writer->write_rows(range.first, rows, values);
  }
  const double seconds = thread_seconds() - begin;
  journal.remove();
  return seconds / (static_cast<double>(values.size()) * blocks);
}

/// Seconds of rank 0's thread for handing out a block. Every rank calls this function.
double measure_messages(const Ranks& ranks) {
  constexpr int blocks = 4000;
  const auto executor = ranks.executor(1);
  const double begin = thread_seconds();
  executor->run(
      even_blocks(blocks, 1), 1, [](RowRange, std::span<double> values) { values[0] = 1; },
      [](RowRange, std::span<const double>) {});
  return (thread_seconds() - begin) / blocks;
}

/// A run of the protocol. Every rank has one thread and holds one block besides the one that it
/// computes; two results of each may be on their way. A thread of rank 0 serves requests and
/// results in the order in which they come, beside the thread that computes.
class Simulation {
 public:
  Simulation(const Workload& load, int ranks, const Costs& costs)
      : load_(load),
        costs_(costs),
        blocks_(cost_blocks(load.estimated, ranks, most_block_rows(load.width, load.planes))),
        ranks_(static_cast<std::size_t>(ranks)) {
    outcome_.blocks = blocks_.size();
  }
  Outcome run();

 private:
  static constexpr int most_on_their_way = 2;
  struct Rank {
    std::deque<std::size_t> held;
    bool is_computing = false;
    int on_their_way = 0;
    bool has_finished_block = false;
    double values = 0;  ///< of the block that is computed, or was computed last
    double idle_since = 0;
  };
  enum class What { request, finished, result };
  struct Happening {
    double time;
    What what;
    int rank;
    double values;
    bool operator>(const Happening& other) const { return time > other.time; }
  };

  Rank& rank(int number) { return ranks_[static_cast<std::size_t>(number)]; }
  /// A rank computes the first of the blocks that it holds, where it may.
  void start(int number, double time);
  void send(int number, double time);
  /// Rank 0 works for `service` seconds. Returns when it is done.
  double serve(double time, double service);
  void take(const Happening& now);

  const Workload& load_;
  const Costs& costs_;
  const std::vector<RowRange> blocks_;
  std::vector<Rank> ranks_;
  std::priority_queue<Happening, std::vector<Happening>, std::greater<>> queue_;
  std::size_t next_ = 0;
  double server_free_ = 0;
  Outcome outcome_;
};

void Simulation::start(int number, double time) {
  Rank& own = rank(number);
  if (own.is_computing || own.has_finished_block || own.held.empty()) return;
  const RowRange& rows = blocks_[own.held.front()];
  own.held.pop_front();
  own.is_computing = true;
  const double seconds =
      std::accumulate(load_.measured.begin() + rows.first, load_.measured.begin() + rows.last, 0.0);
  outcome_.largest = std::max(outcome_.largest, seconds);
  own.values = static_cast<double>(rows.size()) * load_.width * load_.planes;
  queue_.push({time + seconds, What::finished, number, 0});
  queue_.push({time + costs_.latency, What::request, number, 0});
}

void Simulation::send(int number, double time) {
  Rank& own = rank(number);
  if (!own.has_finished_block || own.on_their_way == most_on_their_way) return;
  own.has_finished_block = false;
  ++own.on_their_way;
  queue_.push({time + costs_.latency + own.values * sizeof(double) / costs_.bandwidth, What::result,
               number, own.values});
}

double Simulation::serve(double time, double service) {
  server_free_ = std::max(time, server_free_) + service;
  outcome_.server += service;
  return server_free_;
}

void Simulation::take(const Happening& now) {
  Rank& own = rank(now.rank);
  switch (now.what) {
    case What::request: {
      const double done = serve(now.time, 0.5 * costs_.message);
      if (next_ == blocks_.size()) break;
      own.held.push_back(next_++);
      start(now.rank, done + costs_.latency);
      break;
    }
    case What::finished:
      own.is_computing = false;
      own.has_finished_block = true;
      own.idle_since = now.time;
      send(now.rank, now.time);
      start(now.rank, now.time);
      break;
    case What::result: {
      const double done = serve(now.time, 0.5 * costs_.message + now.values * costs_.value +
                                              now.values * sizeof(double) / costs_.bandwidth);
      outcome_.wall = std::max(outcome_.wall, done);
      --own.on_their_way;
      send(now.rank, done);
      start(now.rank, done);
      break;
    }
  }
}

Outcome Simulation::run() {
  const int count = static_cast<int>(ranks_.size());
  for (int number = 0; number < count; ++number) {
    queue_.push({0, What::request, number, 0});
    queue_.push({0, What::request, number, 0});
  }
  while (!queue_.empty()) {
    const Happening now = queue_.top();
    queue_.pop();
    take(now);
  }
  for (const Rank& own : ranks_) outcome_.tail += (outcome_.wall - own.idle_since) / count;
  return outcome_;
}

std::vector<int> numbers(const std::string& text) {
  std::vector<int> result;
  for (std::size_t at = 0; at < text.size();) {
    int number = 0;
    const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), number);
    if (error != std::errc() || number < 1) throw InputError("not a list of numbers: " + text);
    result.push_back(number);
    at = static_cast<std::size_t>(end - text.data()) + 1;
  }
  return result;
}

/// Seconds until this number of ranks render. Rank 0 reads the job before the others do; parts of
/// the measuring count as equal.
double seconds_to_prepare(const Workload& load, int ranks) {
  const double sharing = std::clamp(static_cast<double>(load.parts), 1.0, double{1} * ranks);
  return 2 * load.reading + load.measuring / sharing;
}

/// The main cause of lost time.
const char* limit_of(double preparing, const Outcome& outcome, double least) {
  if (outcome.server > 0.8 * outcome.wall) return "rank 0";
  if (outcome.largest > 0.5 * outcome.wall && outcome.wall > 1.1 * least) return "a row";
  if (preparing > least) return "preparing";
  return outcome.wall > 1.1 * least ? "the end" : "-";
}

struct Options {
  std::string json;
  std::vector<int> rank_counts = {64, 256, 1024, 4096}, growths = {1, 16};
  std::vector<std::string> scenes;
  Costs costs;
};

Options read_options(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string {
      if (i + 1 == argc) throw InputError(word + " needs a value");
      return argv[++i];
    };
    if (word == "--json") {
      options.json = value();
    } else if (word == "--growth") {
      options.growths = numbers(value());
    } else if (word == "--ranks") {
      options.rank_counts = numbers(value());
    } else if (word == "--latency") {
      options.costs.latency = 1e-6 * std::stod(value());
    } else if (word == "--bandwidth") {
      options.costs.bandwidth = 1e9 * std::stod(value());
    } else {
      options.scenes.push_back(word);
    }
  }
  if (options.scenes.empty()) options.scenes = {"deepfield_2014", "ngc4321"};
  return options;
}

/// Prints the table of one workload. Returns its rows as objects of JSON.
std::string print_workload(const Workload& load, const Options& options) {
  const double all = std::accumulate(load.measured.begin(), load.measured.end(), 0.0);
  fmt::print(
      "\n{}, {} x {} pixels: {:.1f} core seconds, {:.2f} s to read, {:.2f} core seconds of "
      "measuring\n",
      load.name, load.width, load.height, all, load.reading, load.measuring);
  fmt::print("{:>6}{:>8}{:>12}{:>14}{:>12}{:>9}{:>9}{:>9}  {}\n", "ranks", "blocks", "rendering s",
             "efficiency %", "with prep. %", "block s", "rank 0 %", "tail %", "limit");
  std::string lines;
  for (const int count : options.rank_counts) {
    const Outcome outcome = Simulation(load, count, options.costs).run();
    const double least = all / count;
    const double preparing = seconds_to_prepare(load, count);
    const double whole = outcome.wall + preparing;
    const char* limit = limit_of(preparing, outcome, least);
    fmt::print("{:>6}{:>8}{:>12.3f}{:>14.1f}{:>12.1f}{:>9.4f}{:>9.1f}{:>9.1f}  {}\n", count,
               outcome.blocks, outcome.wall, 100 * least / outcome.wall, 100 * least / whole,
               outcome.largest, 100 * outcome.server / outcome.wall,
               100 * outcome.tail / outcome.wall, limit);
    lines += fmt::format(
        "{}\n    {{\"scene\": \"{}\", \"width\": {}, \"height\": {}, \"core_seconds\": {:.4f}, "
        "\"preparing\": {:.4f}, \"ranks\": {}, \"blocks\": {}, \"rendering\": {:.5f}, "
        "\"efficiency\": {:.4f}, \"efficiency_with_preparing\": {:.4f}, \"largest_block\": "
        "{:.5f}, \"rank_0_busy\": {:.4f}, \"tail\": {:.4f}, \"limit\": \"{}\"}}",
        lines.empty() ? "" : ",", load.name, load.width, load.height, all, preparing, count,
        outcome.blocks, outcome.wall, least / outcome.wall, least / whole, outcome.largest,
        outcome.server / outcome.wall, outcome.tail / outcome.wall, limit);
  }
  return lines;
}

void run(const Ranks& ranks, int argc, char** argv) {
  Options options = read_options(argc, argv);
  Costs& costs = options.costs;
  if (ranks.size() > 1) costs.message = measure_messages(ranks);
  if (ranks.rank() > 0) return;
  costs.value = measure_writing();
  fmt::print("rank 0: {:.1f} us a block{}, {:.1f} ns a value; network: {:.0f} us, {:.0f} GB/s\n",
             1e6 * costs.message, ranks.size() > 1 ? "" : " (not measured)", 1e9 * costs.value,
             1e6 * costs.latency, 1e-9 * costs.bandwidth);
  std::string lines;
  for (const std::string& scene : options.scenes) {
    const std::size_t colon = scene.find(':');
    const int size = colon == std::string::npos ? 0 : std::stoi(scene.substr(colon + 1));
    const Workload measured = measure_scene(scene.substr(0, colon), size);
    for (const int growth : options.growths) {
      const std::string rows = print_workload(grown(measured, growth), options);
      lines += (lines.empty() ? "" : ",") + rows;
    }
  }
  if (options.json.empty()) return;
  std::ofstream file(options.json);
  file << fmt::format(
      "{{\n  \"message_seconds\": {}, \"value_seconds\": {}, \"latency_seconds\": {}, "
      "\"bandwidth_bytes\": {},\n  \"runs\": [{}\n  ]\n}}\n",
      costs.message, costs.value, costs.latency, costs.bandwidth, lines);
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  gamer::Ranks ranks(&argc, &argv);
  try {
    gamer::run(ranks, argc, argv);
    return ranks.end(0);
  } catch (const std::exception& error) {
    return ranks.end(1, error.what(), [](const std::string& message) {
      fmt::print(stderr, "scaling_bench: {}\n", message);
    });
  }
}
