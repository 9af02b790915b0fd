#pragma once

#include <optional>

#include "gamer/job/image_task.h"
#include "gamer/job/job.h"
#include "gamer/job/message_log.h"
#include "gamer/parallel/ranks.h"

namespace gamer {

/// What a run of the program is to do, besides answers that need no job.
struct RunOptions {
  JobRequest request;
  std::optional<int> threads;  ///< per process; by default all cores, one under a launcher
  bool print_config = false;   ///< print the resolved parameters instead
  bool print_mapping = false;  ///< print which columns of the catalogue are used instead
  JobOptions work;
  bool quiet = false;    ///< say nothing but errors
  bool verbose = false;  ///< say more, and where the time went
};

/// Runs a job from its files to the finished image or film, and tells about it in the log. Every
/// rank calls it with equal options. Throws InputError, RunError and Stopped.
void run_job(const Ranks& ranks, const RunOptions& options, MessageLog& log);

}  // namespace gamer
