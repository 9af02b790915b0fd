#include "gamer/core/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace gamer {
namespace {

std::atomic<int> allowed_threads = 1;

// Indices that a thread takes at once: fewer where there are not so many shares for each.
constexpr std::size_t most_share = 4;
constexpr std::size_t shares_per_thread = 4;

}  // namespace

void use_threads(int threads) { allowed_threads = std::max(threads, 1); }

void parallel_for(std::size_t count, const std::function<void(std::size_t i)>& work) {
  const std::size_t threads = std::min(static_cast<std::size_t>(allowed_threads.load()), count);
  if (threads < 2) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  const std::size_t share =
      std::clamp<std::size_t>(count / (shares_per_thread * threads), 1, most_share);
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto take_part = [&] {
    try {
      while (true) {
        const std::size_t first = next.fetch_add(share);
        if (first >= count) return;
        for (std::size_t i = first; i < std::min(first + share, count); ++i) work(i);
      }
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (failure == nullptr) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    try {
      while (others.size() + 1 < threads) others.emplace_back(take_part);
    } catch (const std::system_error&) {
      // Fewer threads do the same.
    }
    take_part();
  }
  if (failure != nullptr) std::rethrow_exception(failure);
}

}  // namespace gamer
