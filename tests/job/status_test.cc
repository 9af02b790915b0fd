#include "gamer/job/status.h"

#include <gtest/gtest.h>

#include <string>

namespace gamer::status_test {
namespace {

JournalStatus some_status() {
  JournalStatus status;
  status.head.program = "gamer 1, build 1";
  status.head.plan = {"x.fits",     "40 x 512 pixels, 1 plane",  512, 0, 1000000000,
                      "/a b/there", "gamer --resume x.par x.lst"};
  status.finished_rows = 130;
  status.changed = 1000000060;
  return status;
}

TEST(Status, OfAnInterruptedJob) {
  EXPECT_EQ(status_text("x.fits.journal", some_status(), "gamer 1, build 1"),
            "x.fits.journal: journal of a job that was interrupted\n"
            "  output   x.fits\n"
            "  size     40 x 512 pixels, 1 plane\n"
            "  program  gamer 1, build 1\n"
            "  rows     130 of 512 finished (25 %)\n"
            "  begun    2001-09-09T01:46:40Z\n"
            "  last row 2001-09-09T01:47:40Z\n"
            "  held     by no job\n"
            "  go on    cd '/a b/there' && gamer --resume x.par x.lst\n");
}

TEST(Status, OfARunningJobWithTruth) {
  JournalStatus status = some_status();
  status.is_in_use = true;
  status.damaged_bytes = 5;
  status.head.plan.objects = 3;
  status.finished_objects = 3;
  status.head.plan.command.clear();
  EXPECT_EQ(status_text("a\nb", status, "gamer 2"),
            "a\\nb: journal of a job that is running\n"
            "  output   x.fits\n"
            "  size     40 x 512 pixels, 1 plane\n"
            "  program  gamer 1, build 1; this is gamer 2, which cannot go on with it\n"
            "  TRUTH    objects: 3 of 3 finished (100 %)\n"
            "  rows     130 of 512 finished (25 %)\n"
            "  begun    2001-09-09T01:46:40Z\n"
            "  last row 2001-09-09T01:47:40Z\n"
            "  held     by a running job\n");
}

TEST(Status, OfADamagedEnd) {
  JournalStatus status = some_status();
  status.damaged_bytes = 5;
  status.has_end = true;
  status.finished_rows = 1000;
  const std::string text = status_text("x", status, "");
  EXPECT_NE(text.find("  rows     512 of 512 finished (100 %); the files are being given"),
            std::string::npos);
  EXPECT_NE(text.find("  damage   the last 5 bytes are cut off or damaged"), std::string::npos);
}

}  // namespace
}  // namespace gamer::status_test
