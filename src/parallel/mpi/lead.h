#pragma once

#include <cstddef>
#include <span>
#include <utility>

#include "gamer/parallel/executor.h"
#include "parallel/mpi/mpi_group.h"

namespace gamer::mpi {

/// Rank 0's part of a run: it hands out blocks, computes with its own threads, receives and
/// consumes. Returns the seconds in compute, of all threads, and in consume.
std::pair<double, double> lead(MpiGroup& job, int threads, std::span<const RowRange> blocks,
                               std::size_t values_per_row, const Executor::Compute& compute,
                               const Executor::Consume& consume);

}  // namespace gamer::mpi
