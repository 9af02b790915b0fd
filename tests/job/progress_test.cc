#include "gamer/job/progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>

namespace gamer::progress_test {
namespace {

/// The output of a run of blocks of ten rows, each `seconds` long.
std::string output_of(Progress::Style style, double seconds, int blocks = 10, int skipped = 0) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  {
    double now = 1000;
    Progress progress(
        100, "rows", style, stream, [&] { return now; }, [] { return "12:30"; });
    progress.skip(skipped);
    EXPECT_EQ(progress.skipped(), skipped);
    for (int i = 0; i < blocks; ++i) {
      now += seconds;
      progress.add(10);
    }
    EXPECT_NEAR(progress.seconds(), blocks * seconds, 1e-9);
  }
  std::fclose(stream);
  const std::unique_ptr<char, decltype(&std::free)> owner(text, &std::free);
  return std::string(text, size);
}

// After a minute a line appears each minute and each tenth of the rows, at most every 5 s.
TEST(Progress, LinesAreDated) {
  EXPECT_EQ(output_of(Progress::Style::lines, 25, 4),
            "gamer: 12:30  30 %  0.4 rows/s  2:55 left\n"
            "gamer: 12:30  40 %  0.4 rows/s  2:30 left\n");
  EXPECT_EQ(output_of(Progress::Style::lines, 5.9), "");
  const std::string quick = output_of(Progress::Style::lines, 7);
  EXPECT_EQ(std::count(quick.begin(), quick.end(), '\n'), 2);
  EXPECT_TRUE(quick.starts_with("gamer: 12:30  90 %")) << quick;
}

TEST(Progress, RowsThatWereDoneBeforeDoNotCountForTheRate) {
  EXPECT_EQ(output_of(Progress::Style::lines, 100, 1, 80),
            "gamer: 12:30  90 %  0.1 rows/s  1:40 left\n");
}

TEST(Progress, LongTimesHaveHours) {
  EXPECT_EQ(output_of(Progress::Style::lines, 1000, 1),
            "gamer: 12:30  10 %  0.0 rows/s  2:30:00 left\n");
}

TEST(Progress, BarIsDrawnAgainAndEndsItsLine) {
  const std::string text = output_of(Progress::Style::bar, 2);
  EXPECT_TRUE(
      text.starts_with("\r[###...........................]  10 %  5.0 rows/s  0:18 left\x1b[K\r["));
  EXPECT_TRUE(
      text.ends_with("\r[##############################] 100 %  5.0 rows/s  0:00 left\x1b[K\n"));
}

TEST(Progress, BarIsDrawnTenTimesASecondAtMost) {
  // A bar of blocks of 0.04 s is drawn at 0.12 s, 0.24 s, 0.36 s and at the end, 0.4 s.
  const std::string text = output_of(Progress::Style::bar, 0.04);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 4);
}

TEST(Progress, ObjectsComeAtOnceThenEachTenthOfTheTimeAndAtTheEnd) {
  const auto object = [](const std::string& text, int done, const std::string& numbers) {
    return R"({"time":"12:30","level":"progress","text":")" + text + R"(","done":)" +
           std::to_string(done) + R"(,"total":100,"unit":"rows",)" + numbers + "}\n";
  };
  EXPECT_EQ(output_of(Progress::Style::json, 6, 3),
            object("0 %  0.0 rows/s", 0, R"("rate":0,"left":null)") +
                object("10 %  1.7 rows/s  0:54 left", 10, R"("rate":1.66667,"left":54.0)") +
                object("20 %  1.7 rows/s  0:48 left", 20, R"("rate":1.66667,"left":48.0)") +
                object("30 %  1.7 rows/s  0:42 left", 30, R"("rate":1.66667,"left":42.0)"));
  // Blocks of 0.3 s give an object at once, at 1.2 s, at 2.4 s and at the end.
  const std::string quick = output_of(Progress::Style::json, 0.3, 10);
  EXPECT_EQ(std::count(quick.begin(), quick.end(), '\n'), 4);
  // The last object is not repeated at the end.
  const std::string text = output_of(Progress::Style::json, 10, 10, 0);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 11);
}

TEST(Progress, NothingToDoIsAllDone) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  { const Progress progress(0, "rows", Progress::Style::json, stream); }
  std::fclose(stream);
  const std::unique_ptr<char, decltype(&std::free)> owner(text, &std::free);
  EXPECT_NE(std::string(text, size).find("100 %"), std::string::npos);
}

TEST(Progress, NoneIsSilent) { EXPECT_EQ(output_of(Progress::Style::none, 100), ""); }

TEST(Progress, AFileIsNoTerminal) {
  std::FILE* file = std::tmpfile();
  EXPECT_EQ(Progress::style_for(file), Progress::Style::lines);
  std::fclose(file);
}

}  // namespace
}  // namespace gamer::progress_test
