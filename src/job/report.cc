#include "gamer/job/report.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "gamer/core/error.h"

namespace gamer {
namespace {

constexpr double mebibyte = 1024.0 * 1024.0;

/// A line of the table: of a rank, or the sum of several.
struct Line {
  int threads = 0;
  double wall = 0;
  double available = 0;  ///< time of all threads; the following times are parts of it
  double set_up = 0, compute = 0, waiting = 0;
  double writing = 0;
  RenderCounts counts, layer_counts;
  std::uint64_t peak_memory = 0;

  void add(const RankReport& rank) {
    // Outside of parallel loops one thread works, and all others wait for it.
    const double writing_outside = std::max(0.0, rank.writing - rank.runs.consume);
    threads += rank.threads;
    wall = std::max(wall, rank.wall);
    available += rank.threads * rank.wall;
    set_up += rank.threads * (rank.wall - rank.runs.wall - writing_outside);
    compute += rank.runs.compute;
    waiting += rank.runs.waiting;
    writing += rank.writing;
    counts += rank.counts;
    layer_counts += rank.layer_counts;
    peak_memory = std::max(peak_memory, rank.peak_memory);
  }
};

double ratio(double part, double whole) { return whole > 0 ? part / whole : 0; }

std::string line_text(const Line& line, const std::string& name) {
  const RenderCounts& counts = line.counts;
  const auto percent = [&](double seconds) { return 100 * ratio(seconds, line.available); };
  const double named = counts.noise_seconds + counts.envelope_seconds + counts.transfer_seconds;
  return fmt::format(
      "gamer: {:>5}{:>8}{:>9.2f}{:>8.1f}{:>7.1f}{:>10.1f}{:>10.1f}{:>7.1f}{:>9.1f}{:>6.1f}{:>9.0f}"
      "{:>8.0f}\n",
      name, line.threads, line.wall, percent(line.set_up), percent(counts.noise_seconds),
      percent(counts.envelope_seconds), percent(counts.transfer_seconds),
      percent(line.compute - named), percent(line.waiting), 100 * ratio(line.writing, line.wall),
      1e-6 * ratio(static_cast<double>(counts.noise_evaluations), counts.noise_seconds),
      static_cast<double>(line.peak_memory) / mebibyte);
}

/// The counted work per pixel.
std::string work_text(const RenderCounts& counts, double pixels) {
  return fmt::format("{:.2f} rays, {:.1f} samples, {:.1f} noise evaluations",
                     ratio(static_cast<double>(counts.rays), pixels),
                     ratio(static_cast<double>(counts.nodes), pixels),
                     ratio(static_cast<double>(counts.noise_evaluations), pixels));
}

}  // namespace

std::string pack_report(const RankReport& report) {
  static_assert(std::is_trivially_copyable_v<RankReport>);
  std::string packed(sizeof report, '\0');
  std::memcpy(packed.data(), &report, sizeof report);
  return packed;
}

RankReport unpack_report(std::string_view packed) {
  RankReport report;
  if (packed.size() != sizeof report) throw RunError("a rank's report is damaged");
  std::memcpy(&report, packed.data(), sizeof report);
  return report;
}

std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr std::uint64_t kibibyte = 1024;
  return kibibyte * static_cast<std::uint64_t>(usage.ru_maxrss);
}

std::string report_text(std::span<const RankReport> ranks, double pixels) {
  if (ranks.empty()) return {};
  std::string text = fmt::format(
      "gamer: where the time went, % of a rank's threads x wall time (I/O: of the wall time)\n"
      "gamer: {:>5}{:>8}{:>9}{:>8}{:>7}{:>10}{:>10}{:>7}{:>9}{:>6}{:>9}{:>8}\n",
      "rank", "threads", "wall s", "set-up", "noise", "envelopes", "transfer", "other", "waiting",
      "I/O", "Mnoise/s", "MiB");
  Line all;
  for (std::size_t rank = 0; rank < ranks.size(); ++rank) {
    Line line;
    line.add(ranks[rank]);
    all.add(ranks[rank]);
    text += line_text(line, fmt::format("{}", rank));
  }
  if (ranks.size() > 1) text += line_text(all, "all");
  text += fmt::format("gamer: per pixel {}, {:.3f} us of a core\n", work_text(all.counts, pixels),
                      1e6 * ratio(all.compute, pixels));
  if (all.layer_counts.rays > 0) {
    text += fmt::format("gamer: per pixel {} in the set-up, which fixes fluxes\n",
                        work_text(all.layer_counts, pixels));
  }
  return text;
}

}  // namespace gamer
