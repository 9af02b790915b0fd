#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "gamer/core/cancellation.h"

namespace gamer::python {

/// Work in a thread of its own, while the caller's thread checks for signals.
class Background {
 public:
  /// The work ends early when its argument is requested.
  using Work = std::function<void(const Cancellation&)>;

  explicit Background(Work work)
      : thread_([this, own = std::move(work)] {
          try {
            own(cancellation_);
          } catch (...) {
            failure_ = std::current_exception();
          }
          const std::lock_guard lock(mutex_);
          is_done_ = true;
          changed_.notify_all();
        }) {}
  ~Background() {
    cancellation_.request();
    if (thread_.joinable()) thread_.join();
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Returns when the work is done, and meanwhile calls `tell` every 30 ms. Throws what the work
  /// throws. An exception of `tell` or of a signal's handler cancels the work. Called and left with
  /// the GIL.
  void finish(const std::function<void()>& tell = [] {}) {
    std::optional<pybind11::error_already_set> raised;
    while (!wait()) {
      try {
        if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
        tell();
      } catch (pybind11::error_already_set& error) {
        raised.emplace(error);
        cancellation_.request();
        break;
      }
    }
    {
      const pybind11::gil_scoped_release release;
      thread_.join();
    }
    if (raised) throw *raised;
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  /// Whether the work is done, after a moment at most.
  bool wait() {
    constexpr std::chrono::milliseconds moment(30);
    const pybind11::gil_scoped_release release;
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, moment, [this] { return is_done_; });
  }

  Cancellation cancellation_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_done_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  ///< last member, since it uses all others
};

}  // namespace gamer::python
