#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "gamer/parallel/executor.h"
#include "gamer/render/medium.h"

namespace gamer {

/// The times of one rank, seconds.
struct RankReport {
  int threads = 1;
  double wall = 0;     ///< from the program's start until the files were complete
  RunTimes runs;       ///< in executors
  double writing = 0;  ///< writing of output files, also outside of runs
  RenderCounts counts;
  RenderCounts layer_counts;      ///< of layers of galaxies of fixed flux, a part of the set-up
  std::uint64_t peak_memory = 0;  ///< bytes
};

/// Packs a report for another rank of the same program.
std::string pack_report(const RankReport& report);
/// Unpacks a report of pack_report(). Throws RunError if `packed` is something else.
RankReport unpack_report(std::string_view packed);

/// Peak resident memory of this process, bytes.
std::uint64_t peak_memory();

/// A table with a line per rank, a line for all ranks if there are several, and the work per pixel.
/// Layers of the set-up have a line of their own. `pixels` is the number of the image's pixels.
std::string report_text(std::span<const RankReport> ranks, double pixels);

}  // namespace gamer
