#include "gamer/job/report.h"

#include <gtest/gtest.h>

#include <vector>

#include "gamer/core/error.h"

namespace gamer::report_test {
namespace {

RankReport example(int rank) {
  RankReport report;
  report.threads = 2;
  report.wall = 10;
  report.runs = {.wall = 8, .compute = 12, .waiting = 4, .consume = rank == 0 ? 0.5 : 0.0};
  report.writing = rank == 0 ? 1.0 : 0.0;
  report.counts.rays = 1000;
  report.counts.nodes = 20'000;
  report.counts.noise_evaluations = 300'000'000;
  report.counts.noise_seconds = 6;
  report.counts.envelope_seconds = 2;
  report.counts.transfer_seconds = 1;
  report.peak_memory = std::uint64_t{64} << 20;
  return report;
}

TEST(Report, SaysWhereTheTimeOfEachRankWent) {
  const std::vector<RankReport> ranks = {example(0), example(1)};
  // Set-up takes 10 - 8 s; on rank 0 it leaves out the half second in which the file was completed.
  EXPECT_EQ(
      report_text(ranks, 1000),
      "gamer: where the time went, % of a rank's threads x wall time (I/O: of the wall time)\n"
      "gamer:  rank threads   wall s  set-up  noise envelopes  transfer  other  waiting   I/O "
      "Mnoise/s     MiB\n"
      "gamer:     0       2    10.00    15.0   30.0      10.0       5.0   15.0     20.0  10.0 "
      "      50      64\n"
      "gamer:     1       2    10.00    20.0   30.0      10.0       5.0   15.0     20.0   0.0 "
      "      50      64\n"
      "gamer:   all       4    10.00    17.5   30.0      10.0       5.0   15.0     20.0  10.0 "
      "      50      64\n"
      "gamer: per pixel 2.00 rays, 40.0 samples, 600000.0 noise evaluations, 24000.000 us of a "
      "core\n");
}

TEST(Report, OneRankNeedsNoSum) {
  const std::vector<RankReport> ranks = {example(0)};
  EXPECT_EQ(report_text(ranks, 1000).find("  all "), std::string::npos);
  EXPECT_EQ(report_text({}, 1000), "");
}

TEST(Report, NothingRenderedIsNoNumber) {
  const std::vector<RankReport> ranks = {RankReport()};
  EXPECT_EQ(report_text(ranks, 0).find("nan"), std::string::npos);
}

TEST(Report, TravelsAsText) {
  const std::vector<RankReport> ranks = {unpack_report(pack_report(example(0)))};
  const std::vector<RankReport> expected = {example(0)};
  EXPECT_EQ(report_text(ranks, 10), report_text(expected, 10));
  EXPECT_THROW(unpack_report("short"), RunError);
}

TEST(Report, PeakMemoryHoldsWhatWasUsed) {
  const std::vector<char> block(std::size_t{256} << 20, 'x');
  EXPECT_GE(peak_memory(), block.size());
}

}  // namespace
}  // namespace gamer::report_test
