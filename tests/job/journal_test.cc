#include "gamer/job/journal.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "gamer/core/error.h"

namespace gamer::journal_test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t width = 40;  // values per row
constexpr double never = std::numeric_limits<double>::infinity();

class JournalTest : public testing::Test {
 protected:
  JournalTest() {
    std::string name = (fs::temp_directory_path() / "journal.XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~JournalTest() override { fs::remove_all(folder_); }

  fs::path path() const { return folder_ / "x.fits.journal"; }

  std::string content() const {
    std::ifstream file(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void set_content(const std::string& bytes) const {
    std::ofstream(path(), std::ios::binary) << bytes;
  }

  fs::path folder_;
};

const JournalHead head = {
    "gamer 1",   "AVX2", "2020-02-02T02:02:02",
    "in t.ecsv", true,   {{"render.par", "a/render.par", "[image]\n"}, {"seds/E", "", "\1\n"}}};

/// Rows with runs of zeros of all lengths, and with -0, NaN and infinities.
std::vector<double> rows_of(RowRange range) {
  std::vector<double> values;
  for (int row = range.first; row < range.last; ++row) {
    std::mt19937 random(static_cast<unsigned>(row));
    std::vector<double> row_values(width, 0.0);
    for (std::size_t i = 0; i < width && row % 4 != 3; i += 1 + random() % 15) {
      row_values[i] = std::ldexp(1 + static_cast<double>(random() % 1000), row % 20 - 10);
    }
    if (row % 4 == 0) row_values[5] = -0.0;
    if (row % 4 == 1) row_values[width - 1] = std::numeric_limits<double>::quiet_NaN();
    if (row % 4 == 2) row_values[0] = -std::numeric_limits<double>::infinity();
    values.insert(values.end(), row_values.begin(), row_values.end());
  }
  return values;
}

void add(Journal& journal, int section, RowRange range, bool single = false) {
  journal.add_rows(section, range, rows_of(range), single);
}

/// Expects equal bits; a NaN only needs to be a NaN.
void expect_equal(std::span<const double> a, std::span<const double> b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(b[i])) {
      EXPECT_TRUE(std::isnan(a[i]));
    } else {
      EXPECT_EQ(a[i], b[i]);
      EXPECT_EQ(std::signbit(a[i]), std::signbit(b[i]));
    }
  }
}

/// Replays a section and checks its rows.
std::vector<RowRange> replayed(const Journal& journal, int section) {
  std::vector<RowRange> ranges;
  journal.replay(section, width, [&](RowRange range, std::span<const double> values) {
    ranges.push_back(range);
    expect_equal(values, rows_of(range));
  });
  return ranges;
}

using Ranges = std::vector<RowRange>;

TEST_F(JournalTest, KeepsEverything) {
  EXPECT_EQ(Journal::open(path(), 0), nullptr);
  {
    Journal journal(path(), head, 0);
    EXPECT_FALSE(journal.is_begun());
    int begun = 0;
    journal.when_begun([&] { ++begun; });
    for (const RowRange range : {RowRange{0, 1}, {3, 6}}) add(journal, 0, range);
    EXPECT_TRUE(journal.is_begun());
    EXPECT_EQ(begun, 1);
    for (const RowRange range : {RowRange{8, 9}, {2, 8}, {20, 25}}) add(journal, 1, range, true);
  }
  const auto journal = Journal::open(path(), 0);
  ASSERT_NE(journal, nullptr);
  EXPECT_EQ(journal->head().program, head.program);
  EXPECT_EQ(journal->head().simd, head.simd);
  EXPECT_EQ(journal->head().date, head.date);
  EXPECT_EQ(journal->head().truth, head.truth);
  EXPECT_TRUE(journal->head().overwrite);
  EXPECT_EQ(pack_record(journal->head().record), pack_record(head.record));
  EXPECT_FALSE(journal->has_end());
  EXPECT_EQ(replayed(*journal, 0), (Ranges{{0, 1}, {3, 6}}));
  EXPECT_EQ(replayed(*journal, 1), (Ranges{{8, 9}, {2, 8}, {20, 25}}));
  EXPECT_EQ(replayed(*journal, 2), Ranges{});
  EXPECT_EQ(journal->finished(0), (Ranges{{0, 1}, {3, 6}}));
  EXPECT_EQ(journal->finished(1), (Ranges{{2, 9}, {20, 25}}));
}

TEST_F(JournalTest, IsContinuedAfterOpening) {
  { add(*std::make_unique<Journal>(path(), head, 0), 0, {0, 2}); }
  for (int i = 1; i < 4; ++i) {
    const auto journal = Journal::open(path(), 0);
    EXPECT_EQ(journal->finished(0), (Ranges{{0, 2 * i}}));
    add(*journal, 0, {2 * i, 2 * i + 2});
    if (i == 3) journal->add_end();
  }
  const auto journal = Journal::open(path(), 0);
  EXPECT_TRUE(journal->has_end());
  EXPECT_EQ(replayed(*journal, 0), (Ranges{{0, 2}, {2, 4}, {4, 6}, {6, 8}}));
  journal->remove();
  EXPECT_FALSE(journal->is_begun());
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(JournalTest, SinglePrecisionIsHalfAsLarge) {
  const std::vector<double> values(100 * width, 1 / 3.0);
  for (const bool single : {false, true}) {
    {
      Journal journal(path(), head, 0);
      journal.add_rows(0, {0, 100}, values, single);
    }
    const double expected = single ? static_cast<double>(1 / 3.0F) : 1 / 3.0;
    Journal::open(path(), 0)->replay(0, width, [&](RowRange, std::span<const double> read) {
      for (const double value : read) EXPECT_EQ(value, expected);
    });
    EXPECT_NEAR(static_cast<double>(fs::file_size(path())), (single ? 4.0 : 8.0) * 100 * width,
                500);
    fs::remove(path());
  }
}

TEST_F(JournalTest, ZerosTakeNoRoom) {
  Journal journal(path(), head, 0);
  add(journal, 0, {0, 1});
  const auto before = fs::file_size(path());
  journal.add_rows(0, {1, 10001}, std::vector<double>(10000 * width), false);
  EXPECT_LT(fs::file_size(path()) - before, 100U);
}

TEST_F(JournalTest, ATailThatIsCutOffEndsIt) {
  std::vector<std::uintmax_t> ends;
  {
    Journal journal(path(), head, 0);
    for (int i = 0; i < 3; ++i) {
      add(journal, 0, {i, i + 1}, i == 1);
      ends.push_back(fs::file_size(path()));
    }
  }
  const std::string whole = content();
  ASSERT_EQ(whole.size(), ends.back());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    set_content(whole.substr(0, size));
    const auto whole_entries = static_cast<int>(
        std::count_if(ends.begin(), ends.end(), [&](auto end) { return end <= size; }));
    std::unique_ptr<Journal> journal;
    try {
      journal = Journal::open(path(), never);
    } catch (const InputError&) {
      EXPECT_EQ(whole_entries, 0) << size;
      continue;
    }
    ASSERT_EQ(replayed(*journal, 0).size(), static_cast<std::size_t>(whole_entries)) << size;
    // New entries take the place of the damaged tail.
    for (int i = whole_entries; i < 3; ++i) add(*journal, 0, {i, i + 1}, i == 1);
    journal.reset();
    EXPECT_EQ(content(), whole) << size;
  }
}

TEST_F(JournalTest, AWrongByteEndsIt) {
  std::uintmax_t first_end = 0, second_end = 0;
  {
    Journal journal(path(), head, 0);
    add(journal, 0, {0, 1});
    first_end = fs::file_size(path());
    add(journal, 0, {1, 2});
    second_end = fs::file_size(path());
    add(journal, 0, {2, 3});
  }
  const std::string whole = content();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    set_content(damaged);
    try {
      const auto journal = Journal::open(path(), never);
      EXPECT_EQ(replayed(*journal, 0).size(), at < first_end ? 0U : at < second_end ? 1U : 2U);
    } catch (const InputError&) {
      EXPECT_LT(at, first_end);
    }
  }
}

TEST_F(JournalTest, StatusLeavesItAlone) {
  JournalHead planned = head;
  planned.plan = {"x.fits", "40 x 25 pixels, 1 plane", 25, 7, 1000000000,
                  "/there", "gamer --resume"};
  Journal journal(path(), planned, 0);
  add(journal, 0, {0, 1});
  for (const RowRange range : {RowRange{3, 6}, {4, 8}, {20, 25}}) add(journal, 1, range);
  const std::string whole = content();
  const JournalStatus running = Journal::status(path());
  EXPECT_TRUE(running.is_in_use);
  EXPECT_FALSE(running.has_end);
  EXPECT_EQ(running.finished_objects, 1);
  EXPECT_EQ(running.finished_rows, 10);
  EXPECT_EQ(running.damaged_bytes, 0U);
  EXPECT_EQ(running.head.program, head.program);
  EXPECT_EQ(running.head.plan.output, planned.plan.output);
  EXPECT_EQ(running.head.plan.size, planned.plan.size);
  EXPECT_EQ(running.head.plan.rows, 25);
  EXPECT_EQ(running.head.plan.objects, 7);
  EXPECT_EQ(running.head.plan.begun, 1000000000);
  EXPECT_EQ(running.head.plan.folder, "/there");
  EXPECT_EQ(running.head.plan.command, "gamer --resume");
  // Its owner can still write to it.
  add(journal, 1, {0, 3});
  journal.add_end();
  EXPECT_EQ(Journal::status(path()).finished_rows, 13);
  EXPECT_TRUE(Journal::status(path()).has_end);
  EXPECT_EQ(content().substr(0, whole.size()), whole);
}

TEST_F(JournalTest, StatusOfATornOne) {
  std::uintmax_t first_end = 0;
  {
    Journal journal(path(), head, 0);
    add(journal, 1, {0, 2});
    first_end = fs::file_size(path());
    add(journal, 1, {2, 4});
  }
  const std::string torn = content().substr(0, fs::file_size(path()) - 7);
  set_content(torn);
  const JournalStatus status = Journal::status(path());
  EXPECT_FALSE(status.is_in_use);
  EXPECT_EQ(status.finished_rows, 2);
  EXPECT_EQ(status.damaged_bytes, torn.size() - first_end);
  EXPECT_EQ(content(), torn);
  // A process that opens it and adds nothing changes nothing.
  EXPECT_EQ(Journal::open(path(), 0)->finished(1), (Ranges{{0, 2}}));
  EXPECT_EQ(content(), torn);
}

TEST_F(JournalTest, StatusOfOtherFilesIsAnError) {
  EXPECT_NE(error_text([&] { Journal::status(path()); }).find("no such file"), std::string::npos);
  set_content("precious");
  EXPECT_EQ(error_text([&] { Journal::status(path()); }),
            path().string() +
                ": no journal of gamer's, or a damaged one; the journal of x.fits is "
                "x.fits.journal");
  EXPECT_THROW(Journal::status(folder_), InputError);
}

TEST_F(JournalTest, OtherFilesAreErrors) {
  for (const std::string& text :
       std::vector<std::string>{"", "a", "gamer journal 2\n", "SIMPLE  =                    T",
                                std::string(5000, '\0')}) {
    set_content(text);
    EXPECT_EQ(error_text([&] { Journal::open(path(), 0); }),
              path().string() +
                  ": no journal of gamer's, or a damaged one; remove it or choose another output");
    EXPECT_EQ(content(), text);
  }
  set_content("gamer journal 1\n and more");
  EXPECT_NE(error_text([&] { Journal::open(path(), 0); }).find("another version"),
            std::string::npos);
  EXPECT_THROW(Journal::discard(path()), InputError);
  set_content("precious");
  EXPECT_THROW(Journal::discard(path()), InputError);
  EXPECT_EQ(content(), "precious");
  fs::remove(path());
  fs::create_directory(path());
  EXPECT_THROW(Journal::open(path(), 0), InputError);
}

TEST_F(JournalTest, RowsOfAnotherLengthAreAnError) {
  { add(*std::make_unique<Journal>(path(), head, 0), 0, {0, 2}); }
  EXPECT_THROW(Journal::open(path(), 0)->replay(0, width - 1, [](auto...) {}), InputError);
}

TEST_F(JournalTest, HasOneOwner) {
  Journal journal(path(), head, 0);
  add(journal, 0, {0, 1});
  EXPECT_NE(error_text([&] { Journal::open(path(), 0); }).find("another process"),
            std::string::npos);
  EXPECT_THROW(Journal::discard(path()), InputError);
  // A second journal was begun at the same time.
  Journal other(path(), head, 0);
  EXPECT_THROW(add(other, 0, {0, 1}), RunError);
  add(journal, 0, {1, 2});
  EXPECT_TRUE(fs::exists(path()));
}

TEST_F(JournalTest, BeginsWhenItIsDue) {
  double now = 100;
  Journal journal(path(), head, 10, [&] { return now; });
  add(journal, 0, {0, 1});
  now = 109;
  add(journal, 0, {1, 2});
  EXPECT_FALSE(journal.is_begun());
  EXPECT_TRUE(fs::is_empty(folder_));
  now = 110;
  add(journal, 0, {2, 3});
  EXPECT_TRUE(journal.is_begun());
  EXPECT_FALSE(fs::is_empty(folder_));
  // From here on, rows are written at once.
  const auto before = fs::file_size(path());
  add(journal, 0, {3, 4});
  EXPECT_GT(fs::file_size(path()), before);
}

TEST_F(JournalTest, BeginsWhenMuchWaits) {
  Journal journal(path(), head, never);
  const std::vector<double> values(std::size_t{1} << 20, 1.0);
  int blocks = 0;
  for (; !journal.is_begun() && blocks < 100; ++blocks) {
    journal.add_rows(0, {blocks, blocks + 1}, values, false);
  }
  EXPECT_EQ(blocks, 4);
}

TEST_F(JournalTest, IsDiscarded) {
  Journal::discard(path());
  { add(*std::make_unique<Journal>(path(), head, 0), 0, {0, 1}); }
  Journal::discard(path());
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(JournalTest, AFolderThatIsGoneIsAnError) {
  Journal journal(path(), head, 0);
  fs::remove_all(folder_);
  try {
    add(journal, 0, {0, 1});
    ADD_FAILURE() << "no RunError";
  } catch (const RunError& error) {
    EXPECT_EQ(error.what(), path().string() + ": cannot write: No such file or directory");
  }
}

}  // namespace
}  // namespace gamer::journal_test
