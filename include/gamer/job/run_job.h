#pragma once

#include <optional>

#include "gamer/job/image_task.h"
#include "gamer/job/job.h"
#include "gamer/job/message_log.h"
#include "gamer/parallel/ranks.h"

namespace gamer {

/// The options of a run of the program.
struct RunOptions {
  JobRequest request;
  std::optional<int>
      threads;  ///< threads per process; by default all cores, or one under a launcher
  bool print_config = false;   ///< print the resolved parameters instead of rendering
  bool print_mapping = false;  ///< print the use of the catalogue's columns instead of rendering
  JobOptions work;
  bool cache = true;     ///< use CalibrationCache::of_user()
  bool quiet = false;    ///< print only errors
  bool verbose = false;  ///< print more, including times
};

/// Runs a job from its files to the finished image or film, with messages in the log. Every rank
/// calls this function with equal options. Throws InputError for wrong input, RunError if writing
/// fails, and Stopped if the job is stopped.
void run_job(const Ranks& ranks, const RunOptions& options, MessageLog& log);

}  // namespace gamer
