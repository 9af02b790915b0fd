#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "parallel/mpi/failure.h"
#include "parallel/mpi/protocol.h"
#include "parallel/rank_group.h"

namespace gamer::mpi {

/// The ranks of an MPI job: the calls that all make together, and the end of the job.
class MpiGroup : public RankGroup {
 public:
  MpiGroup(int* argc, char*** argv);
  ~MpiGroup() override { end(run_error_code, {}, {}); }
  MpiGroup& operator=(MpiGroup&&) = delete;

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
  /// The exception of rank 0 once a rank has left.
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

  /// Kills all ranks, where no orderly end is possible.
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

}  // namespace gamer::mpi
