#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/parallel/team.h"

namespace gamer {
namespace {

// A round ends with a meeting. More rounds report progress more often; longer rounds divide the
// work more evenly.
constexpr std::size_t most_rounds = 10;
constexpr std::size_t least_blocks_per_worker = 8;

std::size_t rows_of(std::span<const RowRange> blocks) {
  std::size_t rows = 0;
  for (const RowRange& block : blocks) rows += static_cast<std::size_t>(block.size());
  return rows;
}

/// A hash of the blocks and of the number of values per row.
std::uint64_t fingerprint(std::span<const RowRange> blocks, std::size_t values_per_row) {
  std::uint64_t result = values_per_row;
  const auto mix = [&](std::uint64_t number) {
    result = std::rotl((result ^ number) * 0x9e3779b97f4a7c15, 29);
  };
  for (const RowRange& block : blocks) {
    mix(static_cast<std::uint64_t>(block.first));
    mix(static_cast<std::uint64_t>(block.last));
  }
  return result;
}

}  // namespace

TeamExecutor::TeamExecutor(Team team, int threads) : team_(std::move(team)), threads_(threads) {
  if (team_.rank < 0 || team_.rank >= team_.size) {
    throw std::invalid_argument(fmt::format("a team of {} has no rank {}", team_.size, team_.rank));
  }
  workers_ = static_cast<int>(sum(static_cast<std::uint64_t>(threads)));
}

void TeamExecutor::add_up(std::span<std::byte> integers) {
  try {
    if (team_.size > 1) team_.add_up(integers);
  } catch (...) {
    is_over_ = true;
    throw;
  }
}

void TeamExecutor::meet(const std::exception_ptr& failure, std::uint64_t agreed) {
  // A sum with a place for each rank gives every rank all failures and numbers.
  const auto size = static_cast<std::size_t>(team_.size),
             own = static_cast<std::size_t>(team_.rank);
  std::vector<std::uint64_t> numbers(2 * size);
  numbers[2 * own] = failure ? 1 : 0;
  numbers[2 * own + 1] = agreed;
  add_up(std::as_writable_bytes(std::span(numbers)));
  for (std::size_t rank = 0; rank < size; ++rank) is_over_ = is_over_ || numbers[2 * rank] != 0;
  if (failure) std::rethrow_exception(failure);
  for (std::size_t rank = 0; rank < size; ++rank) {
    if (numbers[2 * rank] != 0) throw run_error("the render failed on rank {}", rank);
  }
  for (std::size_t rank = 0; rank < size; ++rank) {
    if (numbers[2 * rank + 1] == numbers[1]) continue;
    is_over_ = true;
    throw input_error("ranks 0 and {} do not render equal images", rank);
  }
}

std::uint64_t TeamExecutor::sum(std::uint64_t number) {
  meet(nullptr, 0);
  add_up(std::as_writable_bytes(std::span(&number, 1)));
  return number;
}

void TeamExecutor::leave(const std::exception_ptr& failure) {
  if (is_over_) return;
  try {
    meet(failure, 0);
  } catch (...) {
    // The caller has its own failure already.
    if (!failure) throw;
  }
}

void TeamExecutor::share(std::span<const RowRange> blocks, std::size_t values_per_row,
                         const Compute& compute, std::vector<double>& values) {
  std::vector<RowRange> mine;
  std::vector<std::size_t> places;
  std::size_t place = 0;
  for (std::size_t block = 0; block < blocks.size(); ++block) {
    if (block % static_cast<std::size_t>(team_.size) == static_cast<std::size_t>(team_.rank)) {
      mine.push_back(blocks[block]);
      places.push_back(place);
    }
    place += static_cast<std::size_t>(blocks[block].size()) * values_per_row;
  }
  threads_.run(mine, values_per_row, compute, [&](RowRange rows, std::span<const double> of_block) {
    const auto block = std::ranges::find(mine, rows) - mine.begin();
    std::ranges::copy(of_block, values.begin() + static_cast<std::ptrdiff_t>(
                                                     places[static_cast<std::size_t>(block)]));
  });
}

void TeamExecutor::run(std::span<const RowRange> blocks, std::size_t values_per_row,
                       const Compute& compute, const Consume& consume) {
  const RunTimes before = threads_.times();
  if (team_.size == 1) {
    threads_.run(blocks, values_per_row, compute, consume);
    add_times(threads_.times() - before);
    return;
  }
  meet(nullptr, fingerprint(blocks, values_per_row));
  const std::size_t per_round =
      std::max((blocks.size() + most_rounds - 1) / most_rounds,
               least_blocks_per_worker * static_cast<std::size_t>(workers_));
  std::exception_ptr failure;
  for (std::size_t first = 0; first < blocks.size(); first += per_round) {
    const auto round = blocks.subspan(first, std::min(per_round, blocks.size() - first));
    std::vector<double> values(rows_of(round) * values_per_row);
    try {
      if (!failure) share(round, values_per_row, compute, values);
    } catch (...) {
      failure = std::current_exception();
    }
    meet(failure, 0);
    // Other ranks' values are 0 here, bit for bit.
    add_up(std::as_writable_bytes(std::span(values)));
    std::span<const double> rest(values);
    try {
      for (const RowRange& block : round) {
        const std::size_t count = static_cast<std::size_t>(block.size()) * values_per_row;
        consume(block, rest.first(count));
        rest = rest.subspan(count);
      }
    } catch (...) {
      failure = std::current_exception();
    }
  }
  if (failure) meet(failure, 0);
  add_times(threads_.times() - before);
}

}  // namespace gamer
