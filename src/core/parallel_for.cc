#include "gamer/core/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "gamer/core/cancellation.h"

namespace gamer {
namespace {

std::atomic<int> allowed_threads = 1;

// The largest share, the indices that a thread takes at once. Shares are smaller where a thread
// would get less than shares_per_thread of them.
constexpr std::size_t most_share = 4;
constexpr std::size_t shares_per_thread = 4;

/// A call of parallel_for().
class Loop {
 public:
  Loop(std::size_t count, std::size_t share, std::size_t most_workers,
       const std::function<void(std::size_t i)>& work, const Loop* outer)
      : count_(count), share_(share), most_workers_(most_workers), work_(work), outer_(outer) {}

  bool has_room() const { return workers < most_workers_ && next_ < count_; }
  bool is_within(const Loop* loop) const {
    for (const Loop* own = this; own != nullptr; own = own->outer_) {
      if (own == loop) return true;
    }
    return false;
  }
  /// Number of threads that could work in the loop besides the one that began it.
  std::size_t room() const { return std::min(most_workers_, (count_ + share_ - 1) / share_) - 1; }

  void work_off() {
    const CancellationScope scope(cancellation_);
    std::size_t i = 0;
    try {
      while (true) {
        check_cancelled();
        const std::size_t first = next_.fetch_add(share_);
        if (first >= count_) return;
        for (i = first; i < std::min(first + share_, count_); ++i) work_(i);
      }
    } catch (...) {
      next_ = count_;
      // All lower indices were begun, so the lowest that fails does not depend on the threads.
      const std::lock_guard lock(mutex_);
      if (i < failed_) {
        failed_ = i;
        failure_ = std::current_exception();
      }
    }
  }
  void rethrow() const {
    if (failure_ != nullptr) std::rethrow_exception(failure_);
  }

  std::size_t workers = 0;  ///< guarded by the team's lock

 private:
  std::size_t count_, share_, most_workers_;
  const std::function<void(std::size_t i)>& work_;
  const Loop* outer_;
  const Cancellation* cancellation_ = CancellationScope::current();
  std::atomic<std::size_t> next_ = 0;
  std::mutex mutex_;
  std::size_t failed_ = std::numeric_limits<std::size_t>::max();
  std::exception_ptr failure_;
};

class Team;
// This thread's team, and the innermost loop that it works in.
thread_local Team* own_team = nullptr;
thread_local const Loop* own_loop = nullptr;

/// A team is the thread that constructs it and further threads. They work in loops that any of them
/// begins.
class Team {
 public:
  explicit Team(std::size_t threads) {
    others_.reserve(threads - 1);
    own_team = this;
    try {
      while (others_.size() + 1 < threads) others_.emplace_back([this] { help(); });
    } catch (const std::exception&) {
      // A team with fewer threads than asked for still works.
    }
  }
  ~Team() {
    own_team = nullptr;
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    begun_.notify_all();
  }
  Team& operator=(Team&&) = delete;

  std::size_t size() const { return others_.size() + 1; }

  /// Returns when the whole loop is done.
  void run(Loop& loop) {
    std::unique_lock lock(mutex_);
    open_.push_back(&loop);
    for (std::size_t i = 0; i < std::min(loop.room(), idle_); ++i) begun_.notify_one();
    if (waiting_ > 0) changed_.notify_all();
    work_in(loop, lock);
    while (loop.workers > 0) {
      // This thread helps only in loops within this one. Others may take longer, and would nest on
      // this thread's stack.
      if (Loop* inner = find(&loop)) {
        work_in(*inner, lock);
      } else {
        ++waiting_;
        changed_.wait(lock);
        --waiting_;
      }
    }
    open_.erase(std::ranges::find(open_, &loop));
  }

 private:
  void help() {
    own_team = this;
    std::unique_lock lock(mutex_);
    while (!is_over_) {
      if (Loop* loop = find(nullptr)) {
        work_in(*loop, lock);
      } else {
        ++idle_;
        begun_.wait(lock);
        --idle_;
      }
    }
  }

  /// The newest loop within `outer` (if null, any loop) that has work for one more thread.
  Loop* find(const Loop* outer) const {
    for (auto loop = open_.rbegin(); loop != open_.rend(); ++loop) {
      if ((*loop)->has_room() && (outer == nullptr || (*loop)->is_within(outer))) return *loop;
    }
    return nullptr;
  }

  void work_in(Loop& loop, std::unique_lock<std::mutex>& lock) {
    ++loop.workers;
    lock.unlock();
    const Loop* const outer = std::exchange(own_loop, &loop);
    loop.work_off();
    own_loop = outer;
    lock.lock();
    if (--loop.workers == 0 && waiting_ > 0) changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable begun_;    ///< a loop has begun or the team ends; idle threads wait
  std::condition_variable changed_;  ///< a loop has begun or ended; threads that run loops wait
  std::vector<Loop*> open_;
  std::size_t idle_ = 0, waiting_ = 0;
  bool is_over_ = false;
  std::vector<std::jthread> others_;  ///< last member, so that its threads are joined first
};

}  // namespace

void use_threads(int threads) { allowed_threads = std::max(threads, 1); }

void parallel_for(std::size_t count, const std::function<void(std::size_t i)>& work,
                  std::optional<std::size_t> at_a_time, std::optional<int> threads) {
  const std::size_t most = std::min(at_a_time.value_or(count), count);
  const int allowed = threads.value_or(allowed_threads);
  // A single index needs a team only for inner loops, which `at_a_time` announces.
  std::optional<Team> team;
  if (own_team == nullptr && allowed > 1 && (most > 1 || at_a_time)) {
    const auto all = static_cast<std::size_t>(allowed);
    team.emplace(at_a_time ? all : std::min(all, count));
  }
  if (own_team == nullptr || most < 2) {
    for (std::size_t i = 0; i < count; ++i) {
      check_cancelled();
      work(i);
    }
    return;
  }
  const std::size_t share =
      at_a_time
          ? 1
          : std::clamp<std::size_t>(count / (shares_per_thread * own_team->size()), 1, most_share);
  Loop loop(count, share, most, work, own_loop);
  own_team->run(loop);
  loop.rethrow();
}

}  // namespace gamer
