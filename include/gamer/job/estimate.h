#pragma once

#include <cstdint>
#include <string>

#include "gamer/job/job.h"
#include "gamer/job/journal.h"

namespace gamer {

/// The time and memory that a job will take, extrapolated from a part of it.
struct JobEstimate {
  double preparing = 0;            ///< core seconds: reading, statistics of noise, placing
  double rendering = 0;            ///< seconds of one core
  double truth = 0;                ///< seconds of one core, for the table TRUTH
  double wall = 0;                 ///< seconds, where each thread has a core
  std::uint64_t memory = 0;        ///< the most that rank 0 has resident, bytes
  std::uint64_t other_memory = 0;  ///< each other rank
};

/// What was done before a job is rendered, seconds on cores.
struct Preparation {
  double reading = 0;    ///< by rank 0, then by the others
  double measuring = 0;  ///< by all together (complete())
};

/// Estimates a job that has been read and completed. It renders tiles of 16 x 16 pixels for up to
/// `most_seconds`. A place is chosen with a probability proportional to its cost by probe_pixels().
/// With `truth` it measures a few galaxies for as long. Times are those of the thread, not of the
/// clock. Rank 0 is taken to hand out and write while its threads render. The file system's own
/// time is left out. Work that is `done` costs no more than its writing.
JobEstimate estimate_job(const RenderJob& job, bool truth, int ranks, int threads,
                         const Preparation& preparation, const FinishedWork& done = {},
                         double most_seconds = 2);

/// One line.
std::string estimate_text(const JobEstimate& estimate, int ranks, int threads);

/// Seconds that the process, and the calling thread, have spent on cores.
double process_seconds();
double thread_seconds();

}  // namespace gamer
