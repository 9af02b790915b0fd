#pragma once

#include "gamer/job/job.h"

namespace gamer::test {

/// The job of a record, ready to be rendered.
inline RenderJob completed(const Record& record) {
  RenderJob job = read_job(record);
  complete(job, Ranks(), 1);
  return job;
}

}  // namespace gamer::test
