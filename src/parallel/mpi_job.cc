#include "parallel/job.h"

#ifdef GAMER_HAVE_MPI

#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <list>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/core/error.h"
#include "parallel/given_blocks.h"
#include "parallel/row_handout.h"
#include "parallel/worker_pool.h"

namespace gamer {
namespace {

using std::chrono::microseconds;

// The protocol. Rank 0 sends orders, the others send notices; both are small and in order. A rank
// meets rank 0's orders in every function of Job, whichever it is in, so that `leave` reaches it
// anywhere. Results are sent synchronously: once they are sent, rank 0 has accepted them.

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

/// What a rank says before it sends a block's values.
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

constexpr int input_error_code = 2;
constexpr int run_error_code = 1;

// Far below MPI's limit of 2^31 - 1 elements and large enough for full bandwidth (8 MiB).
constexpr std::size_t values_per_message = std::size_t{1} << 20;
constexpr std::size_t bytes_per_message = values_per_message * sizeof(double);

// Results that rank 0 receives at a time, and that another rank sends at a time: one is on its way
// while the next is prepared.
constexpr std::size_t transfers = 2;

// MPI's own waiting burns a core that a worker needs. The pauses, half of the time for which
// nothing has come, are short next to a block's time; the longest are so next to any part of a job,
// and long next to a look, which takes 20 us of the worker's core, or of one that has no work.
constexpr microseconds shortest_pause{20};
constexpr microseconds longest_pause{4000};
constexpr microseconds longest_idle_pause{1000};

// Blocks that a rank holds besides those being computed, so that its threads find the next one
// while the answer to the request is on its way. More would keep them from ranks that are free;
// where there are few, so would any.
int prefetched_blocks(std::int64_t blocks, int ranks, int threads) {
  constexpr int many = 8;  // for each thread
  return blocks < std::int64_t{many} * ranks * threads ? 0 : 1 + threads / 4;
}

// In units of a rank's patience: how often each rank says that it is at work, and the patience with
// rank 0 and with ranks that are still preparing.
constexpr double alive_share = 1.0 / 12;
constexpr double long_patience = 10;

/// Time in which a rank has been looking for messages. What lies between two looks counts little:
/// it was suspended, or writing, and the messages have not gone.
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

bool test(MPI_Request& request) {
  int done = 0;
  MPI_Test(&request, &done, MPI_STATUS_IGNORE);
  return done != 0;
}

void wait(MPI_Request& request) {
  for (Pause pause; !test(request);) std::this_thread::sleep_for(pause.next());
}

bool test_all(std::vector<MPI_Request>& requests) {
  int done = 0;
  MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
  return done != 0;
}

/// Calls transfer(pointer, count) for the pieces of one block's values.
template <typename Value, typename Transfer>
void for_pieces(std::span<Value> values, const Transfer& transfer) {
  for (std::size_t start = 0; start < values.size(); start += values_per_message) {
    const auto piece = values.subspan(start, std::min(values_per_message, values.size() - start));
    transfer(piece.data(), static_cast<int>(piece.size()));
  }
}

/// Whether all are +0. An image of galaxies is mostly empty.
bool is_zero(std::span<const double> values) {
  constexpr std::size_t chunk = 512;
  for (std::size_t start = 0; start < values.size(); start += chunk) {
    std::uint64_t any = 0;
    for (const double value : values.subspan(start, std::min(chunk, values.size() - start))) {
      any |= std::bit_cast<std::uint64_t>(value);
    }
    if (any != 0) return false;
  }
  return true;
}

struct Failure {
  int code;
  std::string message;
};

Failure describe(const std::exception_ptr& exception, int rank) {
  try {
    std::rethrow_exception(exception);
  } catch (const InputError& error) {
    return {input_error_code, error.what()};
  } catch (const RunError& error) {
    return {run_error_code, error.what()};
  } catch (const std::exception& error) {
    return {run_error_code, fmt::format("rank {}: {}", rank, error.what())};
  } catch (...) {
    return {run_error_code, fmt::format("rank {}: unknown failure", rank)};
  }
}

std::exception_ptr make_exception(const Failure& failure) {
  if (failure.code == input_error_code) {
    return std::make_exception_ptr(InputError(failure.message));
  }
  return std::make_exception_ptr(RunError(failure.message));
}

/// The blocks that a rank was given and has not begun. Once closed it takes no more.
class BlockQueue {
 public:
  void push(RowRange range) {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    blocks_.push_back(range);
    change_.notify_one();
  }

  /// Waits for a block; none when the queue is closed and empty.
  std::optional<RowRange> pop() {
    std::unique_lock lock(mutex_);
    change_.wait(lock, [this] { return closed_ || !blocks_.empty(); });
    if (blocks_.empty()) return std::nullopt;
    const RowRange range = blocks_.front();
    blocks_.pop_front();
    return range;
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    change_.notify_all();
  }

  void close_and_drop() {
    const std::lock_guard lock(mutex_);
    blocks_.clear();
    closed_ = true;
    change_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable change_;
  std::deque<RowRange> blocks_;
  bool closed_ = false;
};

class MpiJob : public Job {
 public:
  MpiJob(int* argc, char*** argv);
  ~MpiJob() override { end(run_error_code, {}, {}); }
  MpiJob(const MpiJob&) = delete;
  MpiJob& operator=(const MpiJob&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void give_up_after(double seconds) override { patience_ = seconds; }
  std::string broadcast(std::string text) override;
  std::vector<std::string> gather(const std::string& text) override;
  std::int64_t common_bits(std::int64_t bits) override;
  std::unique_ptr<Executor> executor(int threads) override;
  int end(int code, const std::string& message,
          const std::function<void(const std::string&)>& report) override;

  MPI_Comm communicator() const { return communicator_; }
  double patience() const { return patience_; }

  // Rank 0.
  void send_order(int rank, const Order& order) const;
  void send_order_to_all(const Order& order) const;
  std::optional<Notice> poll_notice();
  /// What rank 0 throws once a rank has left.
  std::exception_ptr early_leave() const { return make_exception(*early_leave_); }
  /// Opens a collective call: throws when a rank has left, else orders the others to take part.
  void open(const Order& order);
  /// Gives up on a rank that cannot be relied on. Throws RunError "rank <rank> <what>"; end() will
  /// kill all.
  [[noreturn]] void give_up(int rank, const std::string& what);

  // The other ranks.
  std::optional<Order> poll_order();
  /// Waits for rank 0 to open the call. Throws Stopped when it orders to leave instead.
  Order join(OrderKind expected);
  void send_notice(NoticeKind kind, const Failure& failure = {0, ""}) const;

  /// Nothing orderly is left to do.
  [[noreturn]] void abort() const;

 private:
  Order next_order();
  void transfer_text(std::string& text) const;
  std::int64_t reduce_bits(std::int64_t bits) const;
  void take_leave(const Notice& notice);

  MPI_Comm communicator_ = MPI_COMM_NULL;
  int rank_ = 0;
  int size_ = 1;
  bool ended_ = false;
  double patience_ = 60;  // seconds

  // Rank 0.
  bool has_lost_ = false;  // a rank
  int left_count_ = 0;
  std::optional<Failure> early_leave_;  // of the first rank that left, as rank 0 throws it
  std::optional<Failure> unreported_;   // of the first rank that left with a failure

  // The other ranks.
  Order order_{};
  MPI_Request order_request_ = MPI_REQUEST_NULL;
  bool ordered_to_leave_ = false;
};

MpiJob::MpiJob(int* argc, char*** argv) {
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided);
  if (provided < MPI_THREAD_FUNNELED) {
    MPI_Finalize();
    throw RunError("the MPI library does not allow threads (MPI_THREAD_FUNNELED)");
  }
  MPI_Comm_dup(MPI_COMM_WORLD, &communicator_);
  MPI_Comm_rank(communicator_, &rank_);
  MPI_Comm_size(communicator_, &size_);
}

void MpiJob::send_order(int rank, const Order& order) const {
  MPI_Send(&order, sizeof order, MPI_BYTE, rank, tag_order, communicator_);
}

void MpiJob::send_order_to_all(const Order& order) const {
  for (int other = 1; other < size_; ++other) send_order(other, order);
}

std::optional<Notice> MpiJob::poll_notice() {
  int arrived = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, tag_notice, communicator_, &arrived, &status);
  if (!arrived) return std::nullopt;
  int count = 0;
  MPI_Get_count(&status, MPI_BYTE, &count);
  std::string bytes(static_cast<std::size_t>(count), '\0');
  MPI_Recv(bytes.data(), count, MPI_BYTE, status.MPI_SOURCE, tag_notice, communicator_,
           MPI_STATUS_IGNORE);
  if (bytes.size() < sizeof(NoticeHead)) give_up(status.MPI_SOURCE, "sent half a message");
  Notice notice{status.MPI_SOURCE, {}, bytes.substr(sizeof(NoticeHead))};
  std::memcpy(&notice.head, bytes.data(), sizeof(NoticeHead));
  if (notice.head.kind == NoticeKind::left) take_leave(notice);
  return notice;
}

void MpiJob::take_leave(const Notice& notice) {
  ++left_count_;
  const int code = notice.head.code;
  if (!early_leave_) {
    early_leave_ = {
        code == input_error_code ? code : run_error_code,
        notice.text.empty() ? fmt::format("rank {} ended early", notice.rank) : notice.text};
  }
  if (code != 0 && (!unreported_ || unreported_->message.empty()))
    unreported_ = {code, notice.text};
}

void MpiJob::open(const Order& order) {
  while (poll_notice()) {
  }
  if (early_leave_) std::rethrow_exception(early_leave());
  send_order_to_all(order);
}

void MpiJob::give_up(int rank, const std::string& what) {
  has_lost_ = true;
  throw RunError(fmt::format("rank {} {}", rank, what));
}

std::optional<Order> MpiJob::poll_order() {
  if (order_request_ == MPI_REQUEST_NULL) {
    MPI_Irecv(&order_, sizeof order_, MPI_BYTE, 0, tag_order, communicator_, &order_request_);
  }
  if (!test(order_request_)) return std::nullopt;
  if (order_.kind == OrderKind::leave) ordered_to_leave_ = true;
  return order_;
}

Order MpiJob::next_order() {
  Pause pause;
  while (true) {
    if (const std::optional<Order> order = poll_order()) return *order;
    std::this_thread::sleep_for(pause.next());
  }
}

Order MpiJob::join(OrderKind expected) {
  const Order order = next_order();
  if (order.kind == OrderKind::leave) throw Stopped{static_cast<int>(order.first)};
  if (order.kind != expected) throw std::logic_error("ranks do not make the same calls");
  return order;
}

void MpiJob::send_notice(NoticeKind kind, const Failure& failure) const {
  const NoticeHead head{kind, failure.code};
  std::string bytes(sizeof head, '\0');
  std::memcpy(bytes.data(), &head, sizeof head);
  bytes += failure.message;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Isend(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, 0, tag_notice, communicator_,
            &request);
  wait(request);
}

void MpiJob::abort() const {
  MPI_Abort(communicator_, run_error_code);
  std::abort();
}

void MpiJob::transfer_text(std::string& text) const {
  for (std::size_t start = 0; start < text.size(); start += bytes_per_message) {
    const std::size_t count = std::min(bytes_per_message, text.size() - start);
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibcast(text.data() + start, static_cast<int>(count), MPI_BYTE, 0, communicator_, &request);
    wait(request);
  }
}

std::string MpiJob::broadcast(std::string text) {
  if (rank_ == 0) {
    open({OrderKind::broadcast, static_cast<std::int64_t>(text.size())});
  } else {
    text.assign(static_cast<std::size_t>(join(OrderKind::broadcast).first), '\0');
  }
  transfer_text(text);
  return text;
}

std::vector<std::string> MpiJob::gather(const std::string& text) {
  if (rank_ > 0) {
    join(OrderKind::gather);
    send_notice(NoticeKind::text, {0, text});
    return {};
  }
  open({OrderKind::gather});
  std::vector<std::string> texts(static_cast<std::size_t>(size_));
  texts.front() = text;
  std::vector<bool> is_here(texts.size(), false);
  Pause pause;
  for (int missing = size_ - 1; missing > 0;) {
    std::optional<Notice> notice = poll_notice();
    if (!notice) {
      std::this_thread::sleep_for(pause.next());
      continue;
    }
    pause.reset();
    // Sent before the rank saw the end of a run.
    if (notice->head.kind == NoticeKind::alive) continue;
    const auto rank = static_cast<std::size_t>(notice->rank);
    if (notice->head.kind == NoticeKind::left) {
      // After its text it may.
      if (!is_here[rank]) std::rethrow_exception(early_leave());
      continue;
    }
    texts[rank] = std::move(notice->text);
    is_here[rank] = true;
    --missing;
  }
  return texts;
}

std::int64_t MpiJob::reduce_bits(std::int64_t bits) const {
  std::int64_t result = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&bits, &result, 1, MPI_INT64_T, MPI_BAND, communicator_, &request);
  wait(request);
  return result;
}

std::int64_t MpiJob::common_bits(std::int64_t bits) {
  if (rank_ == 0) {
    open({OrderKind::common_bits});
  } else {
    join(OrderKind::common_bits);
  }
  return reduce_bits(bits);
}

int MpiJob::end(int code, const std::string& message,
                const std::function<void(const std::string&)>& report) {
  if (ended_) return code;
  ended_ = true;
  if (has_lost_) {
    // It would never come to its end().
    if (report && !message.empty()) report(message);
    abort();
  }
  if (rank_ == 0) {
    send_order_to_all({OrderKind::leave, code});
    for (Pause pause; left_count_ < size_ - 1;) {
      if (poll_notice()) {
        pause.reset();
      } else {
        std::this_thread::sleep_for(pause.next());
      }
    }
    if (code == 0 && unreported_) code = unreported_->code;
    const std::string& text = message.empty() && unreported_ ? unreported_->message : message;
    if (report && !text.empty()) report(text);
  } else {
    send_notice(NoticeKind::left, {code, message});
    // Rank 0 may have opened a call before it sees the notice: take part in what would make it
    // wait.
    while (!ordered_to_leave_) {
      const Order order = next_order();
      if (order.kind == OrderKind::broadcast) {
        std::string text(static_cast<std::size_t>(order.first), '\0');
        transfer_text(text);
      } else if (order.kind == OrderKind::common_bits) {
        reduce_bits(-1);
      }
    }
  }
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(&code, 1, MPI_INT, 0, communicator_, &request);
  wait(request);
  MPI_Comm_free(&communicator_);
  MPI_Finalize();
  return code;
}

/// Rank 0's part of a run: hands out, computes with its own threads, receives and consumes.
class Lead {
 public:
  Lead(MpiJob& job, int threads, std::span<const RowRange> blocks, std::size_t values_per_row,
       const Executor::Compute& compute, const Executor::Consume& consume)
      : job_(job),
        values_per_row_(values_per_row),
        consume_(consume),
        blocks_(blocks.size()),
        handout_(blocks),
        given_(job.size()),
        busy_(static_cast<std::size_t>(job.size()), true),
        heard_(static_cast<std::size_t>(job.size())),
        incoming_(transfers),
        pool_(
            threads, values_per_row, compute, [this] { return handout_.next(); },
            [this] { handout_.stop(); }) {
    busy_.front() = false;
  }

  /// Returns the seconds in compute, of all threads, and in consume.
  std::pair<double, double> run() {
    job_.open({OrderKind::run, static_cast<std::int64_t>(blocks_)});
    Pause pause;
    while (!finished()) {
      bool active = serve_notices();
      active |= accept_rows();
      active |= finish_transfers();
      if (!failure_ && pool_.failure()) fail(pool_.failure());
      watch();
      const microseconds timeout = active ? microseconds::zero() : pause.next(!pool_.finished());
      if (const auto block = pool_.take_for(timeout)) {
        consume(block->range, block->values);
        active = true;
      }
      if (active) pause.reset();
    }
    const int code = failure_ ? describe(failure_, 0).code : 0;
    job_.send_order_to_all({OrderKind::outcome, code});
    if (failure_) std::rethrow_exception(failure_);
    return {pool_.compute_seconds(), consume_seconds_};
  }

 private:
  struct Incoming {
    bool active = false;
    RowRange range;
    std::vector<double> values;
    std::vector<MPI_Request> requests;
  };

  // The pool is asked first: what it threw is known once it has finished.
  bool finished() {
    if (!pool_.finished() || (pool_.failure() && !failure_)) return false;
    return std::none_of(incoming_.begin(), incoming_.end(),
                        [](const Incoming& incoming) { return incoming.active; }) &&
           std::find(busy_.begin(), busy_.end(), true) == busy_.end();
  }

  bool serve_notices() {
    bool active = false;
    while (const std::optional<Notice> notice = job_.poll_notice()) {
      active = true;
      const auto rank = static_cast<std::size_t>(notice->rank);
      heard_[rank] = time_.seconds();
      switch (notice->head.kind) {
        case NoticeKind::alive:
          break;
        case NoticeKind::text:
          throw std::logic_error("ranks do not make the same calls");
        case NoticeKind::request:
          answer(notice->rank);
          break;
        case NoticeKind::failure:
          fail(make_exception({notice->head.code, notice->text}));
          break;
        case NoticeKind::done:
          if (!failure_ && given_.has_any(notice->rank)) {
            job_.give_up(notice->rank, "ended without rows that it was given");
          }
          busy_[rank] = false;
          break;
        case NoticeKind::left:
          busy_[rank] = false;
          fail(job_.early_leave());
          break;
      }
    }
    return active;
  }

  void watch() {
    const double now = time_.look();
    if (now < next_watch_) return;
    next_watch_ = now + alive_share * job_.patience();
    job_.send_order_to_all({OrderKind::alive});
    for (std::size_t rank = 1; rank < busy_.size(); ++rank) {
      const double since = heard_[rank].value_or(0);
      const double patience = (heard_[rank] ? 1 : long_patience) * job_.patience();
      if (busy_[rank] && now - since > patience) {
        job_.give_up(static_cast<int>(rank),
                     fmt::format("has said nothing for {:.0f} s; it is gone or stands still",
                                 job_.patience()));
      }
    }
  }

  void answer(int rank) {
    if (const std::optional<RowRange> range = handout_.next()) {
      given_.give(rank, *range);
      job_.send_order(rank, {OrderKind::block, range->first, range->last});
    } else {
      job_.send_order(rank, {OrderKind::no_block});
    }
  }

  bool accept_rows() {
    bool active = false;
    for (Incoming& incoming : incoming_) {
      if (incoming.active) continue;
      int arrived = 0;
      MPI_Status status;
      MPI_Iprobe(MPI_ANY_SOURCE, tag_rows, job_.communicator(), &arrived, &status);
      if (!arrived) break;
      BlockHead head{};
      MPI_Recv(&head, sizeof head, MPI_BYTE, status.MPI_SOURCE, tag_rows, job_.communicator(),
               MPI_STATUS_IGNORE);
      if (!given_.take_back(status.MPI_SOURCE, head.range)) {
        job_.give_up(status.MPI_SOURCE, fmt::format("sent rows [{}, {}), which it was not given",
                                                    head.range.first, head.range.last));
      }
      incoming.range = head.range;
      incoming.values.resize(static_cast<std::size_t>(head.range.size()) * values_per_row_);
      incoming.requests.clear();
      if (head.has_values) {
        for_pieces(std::span<double>(incoming.values), [&](double* data, int count) {
          MPI_Irecv(data, count, MPI_DOUBLE, status.MPI_SOURCE, tag_values, job_.communicator(),
                    &incoming.requests.emplace_back());
        });
      } else {
        std::fill(incoming.values.begin(), incoming.values.end(), 0.0);
      }
      incoming.active = true;
      active = true;
    }
    return active;
  }

  bool finish_transfers() {
    bool active = false;
    for (Incoming& incoming : incoming_) {
      if (!incoming.active || !test_all(incoming.requests)) continue;
      incoming.active = false;
      consume(incoming.range, incoming.values);
      active = true;
    }
    return active;
  }

  void consume(RowRange range, std::span<const double> values) {
    if (failure_) return;
    const Clock clock;
    try {
      consume_(range, values);
    } catch (...) {
      fail(std::current_exception());
    }
    consume_seconds_ += clock.seconds();
  }

  void fail(const std::exception_ptr& exception) {
    if (failure_) return;
    failure_ = exception;
    pool_.stop();
    job_.send_order_to_all({OrderKind::abandon});
  }

  MpiJob& job_;
  const std::size_t values_per_row_;
  const Executor::Consume& consume_;
  const std::size_t blocks_;
  RowHandout handout_;
  GivenBlocks given_;                         // to other ranks
  std::vector<bool> busy_;                    // by rank
  std::vector<std::optional<double>> heard_;  // when, by rank
  WatchTime time_;
  double next_watch_ = 0;
  std::vector<Incoming> incoming_;
  std::exception_ptr failure_;
  double consume_seconds_ = 0;
  WorkerPool pool_;
};

/// Another rank's part: asks for blocks ahead, computes and sends.
class Follow {
 public:
  Follow(MpiJob& job, int threads, std::size_t values_per_row, const Executor::Compute& compute)
      : job_(job),
        threads_(threads),
        pool_(
            threads, values_per_row, compute, [this] { return queue_.pop(); },
            [this] { queue_.close_and_drop(); }) {}

  /// Returns the seconds in compute, of all threads.
  double run() {
    const std::int64_t blocks = job_.join(OrderKind::run).first;
    wanted_ = threads_ + prefetched_blocks(blocks, job_.size(), threads_);
    Pause pause;
    while (!outcome_) {
      bool active = obey();
      active |=
          outgoing_.remove_if([](Outgoing& outgoing) { return test_all(outgoing.requests); }) > 0;
      active |= ask();
      report_end();
      watch();
      active |= send_finished(active ? microseconds::zero() : pause.next(!pool_.finished()));
      if (active) pause.reset();
    }
    if (*outcome_ != 0) throw Stopped{*outcome_};
    return pool_.compute_seconds();
  }

 private:
  struct Outgoing {
    BlockHead head;
    std::vector<double> values;
    std::vector<MPI_Request> requests;
  };

  void watch() {
    const double now = time_.look();
    if (now - heard_ > long_patience * job_.patience()) job_.abort();
    if (now < next_word_) return;
    next_word_ = now + alive_share * job_.patience();
    job_.send_notice(NoticeKind::alive);
  }

  bool obey() {
    bool active = false;
    while (!outcome_) {
      const std::optional<Order> order = job_.poll_order();
      if (!order) break;
      active = true;
      heard_ = time_.seconds();
      switch (order->kind) {
        case OrderKind::block:
          queue_.push({static_cast<int>(order->first), static_cast<int>(order->second)});
          break;
        case OrderKind::no_block:
          exhausted_ = true;
          queue_.close();
          break;
        case OrderKind::abandon:
          exhausted_ = true;
          pool_.stop();
          break;
        case OrderKind::alive:
          break;
        case OrderKind::outcome:
          outcome_ = static_cast<int>(order->first);
          break;
        default:
          // Rank 0 has left its run without an outcome; it will take no result that is on its way.
          job_.abort();
      }
    }
    return active;
  }

  bool ask() {
    bool active = false;
    for (; !exhausted_ && held_ < wanted_; ++held_) {
      job_.send_notice(NoticeKind::request);
      active = true;
    }
    return active;
  }

  void report_end() {
    // In this order: what the pool threw is known once it has finished.
    const bool finished = pool_.finished();
    if (!failed_ && pool_.failure()) {
      failed_ = true;
      exhausted_ = true;
      job_.send_notice(NoticeKind::failure, describe(pool_.failure(), job_.rank()));
    }
    if (finished && outgoing_.empty() && !done_) {
      done_ = true;
      job_.send_notice(NoticeKind::done);
    }
  }

  bool send_finished(microseconds timeout) {
    if (outgoing_.size() == transfers) {
      std::this_thread::sleep_for(timeout);
      return false;
    }
    std::optional<FinishedBlock> block = pool_.take_for(timeout);
    if (!block) return false;
    --held_;
    const bool has_values = !is_zero(block->values);
    if (!has_values) block->values.clear();
    Outgoing& outgoing =
        outgoing_.emplace_back(Outgoing{{block->range, has_values}, std::move(block->values), {}});
    MPI_Issend(&outgoing.head, sizeof outgoing.head, MPI_BYTE, 0, tag_rows, job_.communicator(),
               &outgoing.requests.emplace_back());
    for_pieces(std::span<const double>(outgoing.values), [&](const double* data, int count) {
      MPI_Issend(data, count, MPI_DOUBLE, 0, tag_values, job_.communicator(),
                 &outgoing.requests.emplace_back());
    });
    return true;
  }

  MpiJob& job_;
  const int threads_;
  int wanted_ = 0;  // blocks at a time
  int held_ = 0;    // asked for, waiting or being computed
  bool exhausted_ = false;
  bool failed_ = false;
  bool done_ = false;
  WatchTime time_;
  double heard_ = 0;
  double next_word_ = 0;
  std::optional<int> outcome_;
  std::list<Outgoing> outgoing_;
  BlockQueue queue_;
  WorkerPool pool_;
};

class RankExecutor : public Executor {
 public:
  RankExecutor(MpiJob& job, int threads) : job_(job), threads_(threads) {
    if (threads < 1) {
      throw std::invalid_argument(fmt::format("cannot compute in {} threads", threads));
    }
  }

  void run(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override {
    check_blocks(blocks);
    const Clock clock;
    double computing = 0, consuming = 0;
    if (job_.rank() == 0) {
      std::tie(computing, consuming) =
          Lead(job_, threads_, blocks, values_per_row, compute, consume).run();
    } else {
      computing = Follow(job_, threads_, values_per_row, compute).run();
    }
    const double wall = clock.seconds();
    add_times({wall, computing, threads_ * wall - computing, consuming});
  }

  int workers() const override { return job_.size() * threads_; }

 private:
  MpiJob& job_;
  int threads_;
};

std::unique_ptr<Executor> MpiJob::executor(int threads) {
  return std::make_unique<RankExecutor>(*this, threads);
}

/// Whether an MPI launcher started this process: mpirun of Open MPI, PMIx (srun, prun), PMI 1 and 2
/// (MPICH, Intel MPI, srun), MVAPICH and Cray's aprun and PALS each set one of these.
bool started_by_launcher() {
  constexpr std::array variables = {
      "OMPI_COMM_WORLD_SIZE", "PMIX_RANK",   "PMI_RANK",    "PMI_SIZE",
      "MV2_COMM_WORLD_SIZE",  "ALPS_APP_PE", "PALS_RANKID",
  };
  return std::any_of(variables.begin(), variables.end(),
                     [](const char* name) { return std::getenv(name) != nullptr; });
}

}  // namespace

std::unique_ptr<Job> join_job(int* argc, char*** argv) {
  if (!started_by_launcher()) return nullptr;
  return std::make_unique<MpiJob>(argc, argv);
}

std::string mpi_library_version() {
  std::array<char, MPI_MAX_LIBRARY_VERSION_STRING> text{};
  int length = 0;
  MPI_Get_library_version(text.data(), &length);
  const std::string version(text.data(), static_cast<std::size_t>(length));
  // Name and version come first; build details follow after a comma or on lines of their own.
  return version.substr(0, version.find_first_of(",\n"));
}

}  // namespace gamer

#else

namespace gamer {

std::unique_ptr<Job> join_job(int* /*argc*/, char*** /*argv*/) { return nullptr; }

std::string mpi_library_version() { return {}; }

}  // namespace gamer

#endif
