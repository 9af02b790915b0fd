#pragma once

#include <cstdint>
#include <string>

#include "gamer/job/job.h"

namespace gamer {

/// What a job will take, as a part of it foretells.
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

/// Estimates a job that has been read and completed. Renders tiles of 16 x 16 pixels for up to
/// `most_seconds`, at places chosen with a probability proportional to what they are thought to
/// cost (probe_pixels()), and with `truth` measures a few galaxies for as long; times are those of
/// the thread, not of the clock. Rank 0 hands out and writes while its threads render; the file
/// system's own time is not in it.
JobEstimate estimate_job(const RenderJob& job, bool truth, int ranks, int threads,
                         const Preparation& preparation, double most_seconds = 2);

/// One line.
std::string estimate_text(const JobEstimate& estimate, int ranks, int threads);

/// Seconds that the process, and the calling thread, have spent on cores.
double process_seconds();
double thread_seconds();

}  // namespace gamer
