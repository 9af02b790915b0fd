#pragma once

#include <cstddef>
#include <functional>
#include <optional>

namespace gamer {

/// Sets the number of threads of this process that parallel_for() may use; 1 until it is called.
/// Rendering uses an Executor, which has threads of its own.
void use_threads(int threads);

/// Calls work(i) for every i in [0, count), in any order and from several threads at a time, and
/// returns when all are done. If work throws, the loop ends, and the exception of the lowest index
/// is rethrown. Results must not depend on the threads: keep terms by index and sum them
/// afterwards.
///
/// Loops may be nested. `at_a_time` limits the number of indices in work at any time, for work that
/// is large or needs much memory. Threads then take indices one by one, and the other threads help
/// in inner loops. `threads` replaces the number of use_threads() for a loop that is not nested.
void parallel_for(std::size_t count, const std::function<void(std::size_t i)>& work,
                  std::optional<std::size_t> at_a_time = {}, std::optional<int> threads = {});

}  // namespace gamer
