#pragma once

#include <cstdint>
#include <string>

#include "gamer/job/job.h"
#include "gamer/job/journal.h"

namespace gamer {

/// The time and memory that a job will take, extrapolated from a part of the job.
struct JobEstimate {
  double preparing = 0;            ///< core seconds: reading, statistics of noise, placing
  double rendering = 0;            ///< seconds of one core
  double truth = 0;                ///< seconds of one core, for the table TRUTH
  double wall = 0;                 ///< seconds, if each thread has a core
  std::uint64_t memory = 0;        ///< peak resident memory of rank 0, bytes
  std::uint64_t other_memory = 0;  ///< peak of each other rank, bytes
};

/// The cost of preparing a job, core seconds.
struct Preparation {
  double reading = 0;    ///< by rank 0, then by the others
  double measuring = 0;  ///< by all ranks together (complete())
};

/// Estimates a job that has been read and completed. For about `most_seconds` this function renders
/// squares of up to 16 x 16 pixels, and at least one pixel. A place is chosen with a probability
/// proportional to the cost that sample_costs() gives it. With `truth` a few galaxies are also
/// measured, for up to `most_seconds`. Times are processor times of the thread. The estimate
/// assumes that rank 0 hands out blocks and writes while its threads render. The time of the file
/// system is left out. Rows and objects that are `done` cost only their writing.
JobEstimate estimate_job(const RenderJob& job, bool truth, int ranks, int threads,
                         const Preparation& preparation, const FinishedWork& done = {},
                         double most_seconds = 2);

/// The estimate for stamps, from a few of them.
JobEstimate estimate_stamps(const RenderJob& job, bool truth, int ranks, int threads,
                            const Preparation& preparation, double most_seconds = 2);

/// The estimate as one line of text.
std::string estimate_text(const JobEstimate& estimate, int ranks, int threads);

/// Processor seconds of the process, and of the calling thread.
double process_seconds();
double thread_seconds();

}  // namespace gamer
