#pragma once

#include <mutex>

namespace gamer {

/// FFTW's planner is not safe from several threads: whoever makes or destroys a plan holds this.
inline std::mutex& fftw_planner_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace gamer
