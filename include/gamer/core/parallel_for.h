#pragma once

#include <cstddef>
#include <functional>
#include <optional>

namespace gamer {

/// Threads of this process that parallel_for() may work in; 1 until it is called. Where images are
/// rendered an Executor has threads of its own.
void use_threads(int threads);

/// Calls work(i) for every i in [0, count), in any order and from several threads at a time;
/// returns when all are done. Where work throws the loop ends, and what it threw for the least
/// index is thrown on. Results must not depend on the threads: what is summed is kept by index and
/// summed afterwards.
///
/// Loops may be nested. With `at_a_time` no more indices than that are worked on at any time, and
/// threads take them one by one, as large work, or such as needs much memory, asks for; the other
/// threads help in the loops within it.
void parallel_for(std::size_t count, const std::function<void(std::size_t i)>& work,
                  std::optional<std::size_t> at_a_time = {});

}  // namespace gamer
