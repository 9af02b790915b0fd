#pragma once

#include <atomic>
#include <stdexcept>

namespace gamer {

/// Thrown by work that was cancelled.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

/// A request to stop work, which any thread may make at any time.
class Cancellation {
 public:
  void request() { is_requested_ = true; }
  bool is_requested() const { return is_requested_; }

 private:
  std::atomic<bool> is_requested_ = false;
};

/// While an instance lives, check_cancelled() in this thread looks at its request. Threads of
/// parallel_for() and of executors take the request of the thread that begins the work.
class CancellationScope {
 public:
  /// A null pointer means no request.
  explicit CancellationScope(const Cancellation* cancellation);
  ~CancellationScope();
  CancellationScope& operator=(CancellationScope&&) = delete;

  /// The request of this thread; null for none.
  static const Cancellation* current();

 private:
  const Cancellation* before_;
};

/// Throws Cancelled if this thread's work is to stop. Loops of long work call it between their
/// steps.
void check_cancelled();

}  // namespace gamer
