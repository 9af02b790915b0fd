#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "gamer/parallel/executor.h"
#include "gamer/render/medium.h"

namespace gamer {

/// Where the time of one rank went, seconds.
struct RankReport {
  int threads = 1;
  double wall = 0;     ///< from the program's start until the files were complete
  RunTimes runs;       ///< in executors
  double writing = 0;  ///< with the output files, also outside of runs
  RenderCounts counts;
  std::uint64_t peak_memory = 0;  ///< bytes
};

/// Packs a report for another rank of the same program.
std::string pack_report(const RankReport& report);
/// Throws RunError when `packed` is none of pack_report().
RankReport unpack_report(std::string_view packed);

/// The most memory that this process has had resident, bytes.
std::uint64_t peak_memory();

/// A table: a line per rank, one for all where there are several, then what a pixel took. `pixels`
/// are those of the image.
std::string report_text(std::span<const RankReport> ranks, double pixels);

}  // namespace gamer
