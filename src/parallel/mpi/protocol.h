#pragma once

#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/parallel/executor.h"

namespace gamer::mpi {

using std::chrono::microseconds;

// The protocol. Rank 0 sends orders, the others send notices; both are small and in order. A rank
// takes rank 0's orders in every function of RankGroup, so that `leave` reaches it anywhere.
// Results are sent synchronously: once they are sent, rank 0 has accepted them.

enum Tag : int { tag_order = 1, tag_notice, tag_rows, tag_values };

enum class OrderKind : int {
  broadcast,    // `first` = length of the text
  gather,       // answer with a notice that holds a text
  common_bits,  //
  run,          // `first` = number of blocks
  block,        // compute rows [first, second)
  no_block,     // answer to a request: all rows are handed out
  abandon,      // compute no further block
  alive,        // rank 0 is at work
  outcome,      // the run is over; `first` = exit code, 0 when all went well
  leave,        // the job is over; `first` = exit code
};

/// The message before a block's values.
struct BlockHead {
  RowRange range;
  bool has_values;  ///< else all are +0 and not sent
};

struct Order {
  OrderKind kind;
  std::int64_t first = 0;
  std::int64_t second = 0;
};

enum class NoticeKind : int {
  text,     // what gather() collects
  request,  // asks for one block
  alive,    // the rank is at work
  failure,  // compute threw `text`
  done,     // last notice of a run
  left,     // last notice of all: this rank is in end()
};

struct NoticeHead {
  NoticeKind kind;
  int code = 0;
};

struct Notice {
  int rank;
  NoticeHead head;
  std::string text;
};

// Far below MPI's limit of 2^31 - 1 elements and large enough for full bandwidth (8 MiB).
constexpr std::size_t values_per_message = std::size_t{1} << 20;
constexpr std::size_t bytes_per_message = values_per_message * sizeof(double);

// Results that rank 0 receives at a time, and that another rank sends at a time: one is on its way
// while the next is prepared.
constexpr std::size_t transfers = 2;

// MPI's own waiting burns a core that a worker needs. A rank pauses for half of the time for which
// no message has come. A look for messages takes 20 us of a core. The longest pause is long
// compared with such a look, and short compared with any part of a job. A rank without work makes
// shorter pauses.
constexpr microseconds shortest_pause{20};
constexpr microseconds longest_pause{4000};
constexpr microseconds longest_idle_pause{1000};

// Times in units of the patience (Ranks::give_up_after()): the time between signs of life of a
// rank, and the limit for rank 0 and for ranks that have sent no message yet.
constexpr double alive_share = 1.0 / 12;
constexpr double long_patience = 10;

/// Time in which a rank has been looking for messages. A longer time than half a second between two
/// looks counts as half a second: the rank was suspended or writing, and messages may be waiting.
class WatchTime {
 public:
  double look() {
    constexpr double most = 0.5;  // seconds
    const double now = clock_.seconds();
    seconds_ += std::min(now - last_, most);
    last_ = now;
    return seconds_;
  }
  double seconds() const { return seconds_; }

 private:
  Clock clock_;
  double last_ = 0;
  double seconds_ = 0;
};

class Pause {
 public:
  microseconds next(bool is_working = false) {
    const microseconds longest = is_working ? longest_pause : longest_idle_pause;
    const microseconds pause = std::min(pause_, longest);
    pause_ = std::min(2 * pause, longest);
    return pause;
  }
  void reset() { pause_ = shortest_pause; }

 private:
  microseconds pause_ = shortest_pause;
};

/// Whether the transfer is over; never waits.
bool test(MPI_Request& request);
bool test_all(std::vector<MPI_Request>& requests);
/// Waits without burning a core.
void wait(MPI_Request& request);

/// Calls transfer(pointer, count) for the pieces of one block's values.
template <typename Value, typename Transfer>
void for_pieces(std::span<Value> values, const Transfer& transfer) {
  for (std::size_t start = 0; start < values.size(); start += values_per_message) {
    const auto piece = values.subspan(start, std::min(values_per_message, values.size() - start));
    transfer(piece.data(), static_cast<int>(piece.size()));
  }
}

}  // namespace gamer::mpi
