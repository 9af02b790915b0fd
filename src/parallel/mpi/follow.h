#pragma once

#include <cstddef>

#include "gamer/parallel/executor.h"
#include "parallel/mpi/mpi_group.h"

namespace gamer::mpi {

/// The part of a rank other than 0 in a run: it asks for blocks ahead of need, computes them and
/// sends the values. Returns the seconds in compute, of all threads. Throws Stopped when the run
/// ends with a failure.
double follow(MpiGroup& job, int threads, std::size_t values_per_row,
              const Executor::Compute& compute);

}  // namespace gamer::mpi
