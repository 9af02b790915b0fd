#ifdef GAMER_HAVE_MPI

#include "parallel/mpi/lead.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <stdexcept>
#include <vector>

#include "parallel/given_blocks.h"
#include "parallel/row_handout.h"
#include "parallel/worker_pool.h"

namespace gamer::mpi {
namespace {

class Lead {
 public:
  Lead(MpiGroup& job, int threads, std::span<const RowRange> blocks, std::size_t values_per_row,
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

  // The pool knows of a failure once it has finished.
  bool finished() {
    if (!pool_.finished() || (pool_.failure() && !failure_)) return false;
    return std::ranges::none_of(incoming_,
                                [](const Incoming& incoming) { return incoming.active; }) &&
           std::ranges::find(busy_, true) == busy_.end();
  }

  bool serve_notices() {
    bool active = false;
    while (const std::optional<Notice> notice = job_.poll_notice()) {
      active = true;
      const auto rank = static_cast<std::size_t>(notice->rank);
      heard_[rank] = time_.seconds();
      switch (notice->head.kind) {
        case NoticeKind::alive: break;
        case NoticeKind::text: throw std::logic_error("ranks do not make the same calls");
        case NoticeKind::request: answer(notice->rank); break;
        case NoticeKind::failure: fail(make_exception({notice->head.code, notice->text})); break;
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
        std::ranges::fill(incoming.values, 0.0);
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

  MpiGroup& job_;
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

}  // namespace

std::pair<double, double> lead(MpiGroup& job, int threads, std::span<const RowRange> blocks,
                               std::size_t values_per_row, const Executor::Compute& compute,
                               const Executor::Consume& consume) {
  return Lead(job, threads, blocks, values_per_row, compute, consume).run();
}

}  // namespace gamer::mpi

#endif
