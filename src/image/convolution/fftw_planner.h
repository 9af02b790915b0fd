#pragma once

#include <mutex>

namespace gamer {

/// FFTW's planner is not thread-safe: lock this to make or destroy a plan.
inline std::mutex& fftw_planner_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace gamer
