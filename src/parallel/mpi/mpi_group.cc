#include "parallel/rank_group.h"

#ifdef GAMER_HAVE_MPI

#include "parallel/mpi/mpi_group.h"

#include <array>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <tuple>

#include "core/message.h"
#include "gamer/core/clock.h"
#include "parallel/mpi/follow.h"
#include "parallel/mpi/lead.h"
#include "parallel/row_handout.h"

namespace gamer {
namespace mpi {
namespace {

class RankExecutor : public Executor {
 public:
  RankExecutor(MpiGroup& job, int threads) : job_(job), threads_(threads) {
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
          lead(job_, threads_, blocks, values_per_row, compute, consume);
    } else {
      computing = follow(job_, threads_, values_per_row, compute);
    }
    const double wall = clock.seconds();
    add_times({wall, computing, threads_ * wall - computing, consuming});
  }

  int workers() const override { return job_.size() * threads_; }

 private:
  MpiGroup& job_;
  int threads_;
};

}  // namespace

MpiGroup::MpiGroup(int* argc, char*** argv) {
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

void MpiGroup::send_order(int rank, const Order& order) const {
  MPI_Send(&order, sizeof order, MPI_BYTE, rank, tag_order, communicator_);
}

void MpiGroup::send_order_to_all(const Order& order) const {
  for (int other = 1; other < size_; ++other) send_order(other, order);
}

std::optional<Notice> MpiGroup::poll_notice() {
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

void MpiGroup::take_leave(const Notice& notice) {
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

void MpiGroup::open(const Order& order) {
  while (poll_notice()) {
  }
  if (early_leave_) std::rethrow_exception(early_leave());
  send_order_to_all(order);
}

void MpiGroup::give_up(int rank, const std::string& what) {
  has_lost_ = true;
  throw run_error("rank {} {}", rank, what);
}

std::optional<Order> MpiGroup::poll_order() {
  if (order_request_ == MPI_REQUEST_NULL) {
    MPI_Irecv(&order_, sizeof order_, MPI_BYTE, 0, tag_order, communicator_, &order_request_);
  }
  if (!test(order_request_)) return std::nullopt;
  if (order_.kind == OrderKind::leave) ordered_to_leave_ = true;
  return order_;
}

Order MpiGroup::next_order() {
  Pause pause;
  while (true) {
    if (const std::optional<Order> order = poll_order()) return *order;
    std::this_thread::sleep_for(pause.next());
  }
}

Order MpiGroup::join(OrderKind expected) {
  const Order order = next_order();
  if (order.kind == OrderKind::leave) throw Stopped{static_cast<int>(order.first)};
  if (order.kind != expected) throw std::logic_error("ranks do not make the same calls");
  return order;
}

void MpiGroup::send_notice(NoticeKind kind, const Failure& failure) const {
  const NoticeHead head{kind, failure.code};
  std::string bytes(sizeof head, '\0');
  std::memcpy(bytes.data(), &head, sizeof head);
  bytes += failure.message;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Isend(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, 0, tag_notice, communicator_,
            &request);
  wait(request);
}

void MpiGroup::abort() const {
  MPI_Abort(communicator_, run_error_code);
  std::abort();
}

void MpiGroup::transfer_text(std::string& text) const {
  for (std::size_t start = 0; start < text.size(); start += bytes_per_message) {
    const std::size_t count = std::min(bytes_per_message, text.size() - start);
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibcast(text.data() + start, static_cast<int>(count), MPI_BYTE, 0, communicator_, &request);
    wait(request);
  }
}

std::string MpiGroup::broadcast(std::string text) {
  if (rank_ == 0) {
    open({OrderKind::broadcast, static_cast<std::int64_t>(text.size())});
  } else {
    text.assign(static_cast<std::size_t>(join(OrderKind::broadcast).first), '\0');
  }
  transfer_text(text);
  return text;
}

std::vector<std::string> MpiGroup::gather(const std::string& text) {
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
    // The rank sent this before it saw the end of a run.
    if (notice->head.kind == NoticeKind::alive) continue;
    const auto rank = static_cast<std::size_t>(notice->rank);
    if (notice->head.kind == NoticeKind::left) {
      // A rank may leave after it has sent its text.
      if (!is_here[rank]) std::rethrow_exception(early_leave());
      continue;
    }
    texts[rank] = std::move(notice->text);
    is_here[rank] = true;
    --missing;
  }
  return texts;
}

std::int64_t MpiGroup::reduce_bits(std::int64_t bits) const {
  std::int64_t result = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&bits, &result, 1, MPI_INT64_T, MPI_BAND, communicator_, &request);
  wait(request);
  return result;
}

std::int64_t MpiGroup::common_bits(std::int64_t bits) {
  if (rank_ == 0) {
    open({OrderKind::common_bits});
  } else {
    join(OrderKind::common_bits);
  }
  return reduce_bits(bits);
}

int MpiGroup::end(int code, const std::string& message,
                  const std::function<void(const std::string&)>& report) {
  if (ended_) return code;
  ended_ = true;
  if (has_lost_) {
    // The lost rank would never call end().
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
    // Rank 0 may have opened a call before it sees the notice, and would wait for this rank.
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

std::unique_ptr<Executor> MpiGroup::executor(int threads) {
  return std::make_unique<RankExecutor>(*this, threads);
}

}  // namespace mpi

namespace {

/// Whether an MPI launcher started this process. Each launcher sets one of these variables: mpirun
/// of Open MPI, PMIx (srun, prun), PMI 1 and 2 (MPICH, Intel MPI, srun), MVAPICH, Cray's aprun and
/// PALS.
bool started_by_launcher() {
  constexpr std::array variables = {
      "OMPI_COMM_WORLD_SIZE", "PMIX_RANK",   "PMI_RANK",    "PMI_SIZE",
      "MV2_COMM_WORLD_SIZE",  "ALPS_APP_PE", "PALS_RANKID",
  };
  return std::ranges::any_of(variables,
                             [](const char* name) { return std::getenv(name) != nullptr; });
}

}  // namespace

std::unique_ptr<RankGroup> join_group(int* argc, char*** argv) {
  if (!started_by_launcher()) return nullptr;
  return std::make_unique<mpi::MpiGroup>(argc, argv);
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

std::unique_ptr<RankGroup> join_group(int* /*argc*/, char*** /*argv*/) { return nullptr; }

std::string mpi_library_version() { return {}; }

}  // namespace gamer

#endif
