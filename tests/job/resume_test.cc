#include "gamer/job/resume.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "gamer/core/error.h"
#include "gamer/core/simd.h"

namespace gamer::resume_test {
namespace {

namespace fs = std::filesystem;
using Ranges = std::vector<RowRange>;

TEST(UnfinishedBlocks, AreCutWhereRowsAreFinished) {
  const Ranges blocks = {{8, 12}, {0, 4}, {4, 8}};
  EXPECT_EQ(unfinished_blocks(blocks, {}), blocks);
  EXPECT_EQ(unfinished_blocks(blocks, Ranges{{0, 12}}), Ranges{});
  EXPECT_EQ(unfinished_blocks(blocks, Ranges{{0, 4}, {5, 6}, {10, 40}}),
            (Ranges{{8, 10}, {4, 5}, {6, 8}}));
  EXPECT_EQ(unfinished_blocks(blocks, Ranges{{1, 2}, {3, 9}}), (Ranges{{9, 12}, {0, 1}, {2, 3}}));
}

JournalHead some_head() {
  RenderParameters parameters;
  return {"gamer 1, build 2",
          "AVX2",
          "2020-02-02T02:02:02",
          "",
          false,
          {{"galaxies/spiral", "spiral.toml", "a = 1\nb = 2\n"},
           {"render.par", "my.par", parameters.toml()},
           {"scene.lst", "scene.lst", "galaxy x y z\n"}}};
}

SharedText& text_of(JournalHead& head, const std::string& name) {
  for (Resources::Text& text : head.record) {
    if (text.name == name) return text.content;
  }
  throw std::logic_error(name);
}

std::string change_text(const JournalHead& now) {
  const std::string text = error_text([&] { check_same_job(some_head(), now, "x.journal"); });
  const std::string start = "x.journal: the job has changed since it began: ";
  const std::string end = "; --overwrite starts anew";
  EXPECT_TRUE(text.starts_with(start) && text.ends_with(end)) << text;
  return text.substr(start.size(), text.size() - start.size() - end.size());
}

TEST(SameJob, IsOneWhosePlaceDiffers) {
  JournalHead now = some_head();
  now.date = "2021-01-01T00:00:00";
  now.overwrite = true;
  for (Resources::Text& text : now.record) text.label = "elsewhere/" + text.label;
  EXPECT_NO_THROW(check_same_job(some_head(), now, "x.journal"));
}

TEST(SameJob, NamesParametersWithBothValues) {
  JournalHead now = some_head();
  RenderParameters parameters;
  parameters.set("sampling", "tolerance", 0.01);
  parameters.set("camera", "supersample", std::int64_t{2});
  text_of(now, "render.par") = parameters.toml();
  EXPECT_EQ(change_text(now),
            "camera.supersample was not given, is 2; sampling.tolerance was 0.001, is 0.01");
}

TEST(SameJob, NamesTextsWithTheLineThatDiffers) {
  JournalHead now = some_head();
  text_of(now, "galaxies/spiral") = "a = 1\nb = 3\n";
  text_of(now, "scene.lst") = text_of(now, "scene.lst").str() + "spiral 0 0 0\n";
  EXPECT_EQ(change_text(now),
            "galaxies/spiral has changed (line 2: 'b = 2' then, 'b = 3' now); "
            "scene.lst has changed (line 2: '' then, 'spiral 0 0 0' now)");
  now = some_head();
  text_of(now, "galaxies/spiral") = "a = 1\nb = 2";
  EXPECT_NE(change_text(now).find("galaxies/spiral has changed"), std::string::npos);
  now = some_head();
  now.record[0].name = "galaxies/barred";
  EXPECT_EQ(change_text(now), "galaxies/barred is new; galaxies/spiral is gone");
}

TEST(SameJob, NamesTheTruth) {
  JournalHead now = some_head();
  now.truth = "in t.ecsv";
  EXPECT_EQ(change_text(now), "--truth was not asked for, is in t.ecsv");
}

TEST(SameJob, NeedsTheSameProgram) {
  JournalHead now = some_head();
  now.program = "gamer 1, build 3";
  text_of(now, "render.par") = "of another version";
  EXPECT_EQ(error_text([&] { check_same_job(some_head(), now, "x.journal"); }),
            "x.journal: begun by gamer 1, build 2, this is gamer 1, build 3; finish the job with "
            "that program; --overwrite starts anew");
}

class JournaledTest : public testing::Test {
 protected:
  JournaledTest() {
    std::string name = (fs::temp_directory_path() / "resume.XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~JournaledTest() override { fs::remove_all(folder_); }

  /// Makes two runs of 20 rows of `width` values, the second of which fails once it has consumed
  /// `most` rows. Returns the computed rows of each section.
  std::vector<Ranges> run(Journal* journal, int threads, int most) {
    ThreadExecutor inner(threads);
    JournaledExecutor executor(inner, journal);
    EXPECT_EQ(executor.workers(), threads);
    std::vector<Ranges> computed(2);
    for (int section = 0; section < 2; ++section) {
      int consumed = 0;
      executor.keep_single(section == 1);
      executor.run(
          even_blocks(20, 3), width,
          [&](RowRange range, std::span<double> values) {
            for (std::size_t i = 0; i < values.size(); ++i) {
              values[i] = 100.0 * section + range.first + static_cast<double>(i / width);
            }
          },
          [&](RowRange range, std::span<const double> values) {
            if (!executor.is_replaying()) computed[section].push_back(range);
            if (section == 1 && (consumed += range.size()) > most) throw RunError("disk full");
            for (int row = range.first; row < range.last; ++row) {
              const auto at = static_cast<std::size_t>(row - range.first) * width;
              rows_[{section, row}] = {values.begin() + static_cast<std::ptrdiff_t>(at),
                                       values.begin() + static_cast<std::ptrdiff_t>(at + width)};
            }
          });
    }
    return computed;
  }

  void expect_all_rows() {
    ASSERT_EQ(rows_.size(), 40U);
    for (const auto& [key, values] : rows_) {
      EXPECT_EQ(values, std::vector<double>(width, 100.0 * key.first + key.second));
    }
  }

  fs::path path() const { return folder_ / "x.journal"; }

  static constexpr std::size_t width = 5;
  fs::path folder_;
  std::map<std::pair<int, int>, std::vector<double>> rows_;
};

TEST_F(JournaledTest, RunsWithoutAJournal) {
  run(nullptr, 2, 100);
  expect_all_rows();
}

TEST_F(JournaledTest, ComputesOnlyWhatIsMissing) {
  for (const int threads : {1, 3}) {
    {
      Journal journal(path(), some_head(), 0);
      EXPECT_THROW(run(&journal, threads, 10), RunError);
    }
    rows_.clear();
    const auto journal = Journal::open(path(), 0);
    // The journal has the row that could not be consumed.
    EXPECT_EQ(journal->finished(0), (Ranges{{0, 20}}));
    int kept = 0;
    for (const RowRange& range : journal->finished(1)) kept += range.size();
    EXPECT_GT(kept, 10);
    EXPECT_LT(kept, 20);
    const std::vector<Ranges> computed = run(journal.get(), threads, 100);
    expect_all_rows();
    EXPECT_TRUE(computed[0].empty());
    int left = 0;
    for (const RowRange& range : computed[1]) left += range.size();
    EXPECT_EQ(kept + left, 20);
    journal->remove();
  }
}

TEST_F(JournaledTest, HasTheInstructionsOfTheJournal) {
  for (const std::int64_t target : simd_targets()) {
    JournalHead head = some_head();
    head.simd = simd_target_name(target);
    {
      Journal journal(path(), head, 0);
      run(&journal, 1, 100);
    }
    const auto journal = Journal::open(path(), 0);
    EXPECT_EQ(journal_simd_targets(*journal), target);
    journal->remove();
  }
  JournalHead head = some_head();
  head.simd = "AVX9";
  {
    Journal journal(path(), head, 0);
    run(&journal, 1, 100);
  }
  const auto journal = Journal::open(path(), 0);
  EXPECT_NE(error_text([&] { journal_simd_targets(*journal); }).find("made with AVX9"),
            std::string::npos);
}

TEST(SinglePrecision, IsThatOfFitsFiles) {
  EXPECT_TRUE(is_single_precision({"x.fits", -32}));
  EXPECT_TRUE(is_single_precision({"x.fits.fz", -32}));
  EXPECT_FALSE(is_single_precision({"x.fits", -64}));
  EXPECT_FALSE(is_single_precision({"x.png", -32}));
}

}  // namespace
}  // namespace gamer::resume_test
