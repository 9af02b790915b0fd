// Cost of the journal for rank 0, in nanoseconds per value (of a pixel in one plane). Values are
// dense in single and in double precision, or empty sky. The disk is that of the folder for
// temporary files.

#include <benchmark/benchmark.h>

#include <filesystem>
#include <vector>

#include "gamer/job/journal.h"

namespace gamer {
namespace {

constexpr int block_rows = 16;
constexpr std::size_t values_per_row = 1024 * 3;
constexpr int blocks = 200;
constexpr double interval = 10;  // the program's

void add_blocks(benchmark::State& state, double value, bool single) {
  const auto path = std::filesystem::temp_directory_path() / "journal_bench.journal";
  const std::vector<double> values(block_rows * values_per_row, value);
  for (auto _ : state) {
    Journal journal(path, JournalHead{}, interval);
    for (int block = 0; block < blocks; ++block) {
      journal.add_rows(0, {block * block_rows, (block + 1) * block_rows}, values, single);
    }
    journal.add_end();
    journal.remove();
  }
  const double count = static_cast<double>(state.iterations()) * blocks * block_rows *
                       static_cast<double>(values_per_row);
  state.counters["value"] =
      benchmark::Counter(count, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

BENCHMARK_CAPTURE(add_blocks, single, 1.1, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(add_blocks, double, 1.1, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(add_blocks, empty, 0.0, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gamer

BENCHMARK_MAIN();
