#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/job/image_task.h"
#include "gamer/job/journal.h"
#include "gamer/job/resume.h"

namespace gamer::journal_damage_test {
namespace {

namespace fs = std::filesystem;

/// The number of damages; the n-th is made with the seed plus n.
constexpr int damages = 500;
constexpr unsigned seed = 2014;
/// Each outcome must occur at least this often, so that the damages test both.
constexpr int least_of_each_outcome = damages / 10;

constexpr std::size_t magic_size = 16;

/// An entry as the journal's file holds it (journal.h).
struct Entry {
  enum Field { kind, section, first, last, values, bytes, fields };
  std::array<std::uint64_t, fields> head{};
  std::string payload;
};

constexpr std::uint64_t files_kind = 4;  // kind of an entry of earlier versions

std::string packed(const Entry& entry) {
  std::string text(sizeof entry.head, '\0');
  std::memcpy(text.data(), entry.head.data(), sizeof entry.head);
  text += entry.payload;
  const auto sum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size())));
  text.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  return text;
}

std::vector<Entry> entries_of(const std::string& journal) {
  std::vector<Entry> entries;
  for (std::size_t at = magic_size; at < journal.size();) {
    Entry& entry = entries.emplace_back();
    std::memcpy(entry.head.data(), journal.data() + at, sizeof entry.head);
    entry.payload = journal.substr(at + sizeof entry.head, entry.head[Entry::bytes]);
    at += packed(entry).size();
  }
  return entries;
}

/// An executor that ends a run once so many blocks are in a journal.
class InterruptedExecutor : public Executor {
 public:
  InterruptedExecutor(fs::path journal, int blocks) : journal_(std::move(journal)), left_(blocks) {}

  void run(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override {
    inner_.run(blocks, values_per_row, compute, [&](RowRange rows, std::span<const double> values) {
      consume(rows, values);
      std::error_code none;
      const std::uintmax_t size = fs::file_size(journal_, none);
      if (none || size == std::exchange(size_, size)) return;
      if (--left_ == 0) throw RunError("interrupted");
    });
  }
  int workers() const override { return 1; }
  const RunTimes& times() const override { return inner_.times(); }

 private:
  ThreadExecutor inner_{1};
  fs::path journal_;
  std::uintmax_t size_ = 0;
  int left_;
};

class JournalDamageTest : public testing::Test {
 protected:
  JournalDamageTest() {
    std::string name = (fs::temp_directory_path() / "damage.XXXXXX").string();
    folder_ = mkdtemp(name.data());
    fs::create_directory(folder_ / "job");
    fs::create_directory(folder_ / "elsewhere");
    image_ = folder_ / "job/x.fits";
    journal_ = folder_ / "job/x.fits.journal";
    for (const char* victim : {"job/precious", "job/.x.fits.AbCdEf", "elsewhere/precious"}) {
      std::ofstream(folder_ / victim) << victim;
      victims_.push_back((folder_ / victim).string());
    }
  }
  ~JournalDamageTest() override { fs::remove_all(folder_); }

  RenderJob job() const {
    Resources data = Resources::from_record(
        {{"render.par", "render.par",
          "[image]\nsize = [6, 192]\n[spectrum]\nwavelengths = [5000, 6000]\n"},
         {"scene.lst", "scene.lst", "galaxy x y z\nsmooth 0 0 0\nsmooth 1 0 0\n"},
         {"galaxies/smooth", "smooth.toml",
          "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n"}});
    JobRequest request;
    request.output = image_;
    return load_job(request, data);
  }

  /// Runs the job as the program does.
  void do_job(Executor& executor, bool resume) const {
    JobOptions options;
    options.truth = true;
    options.resume = resume;
    // The journal begins with the first row, and need not be forced to disk once it is there.
    options.journal_interval = resume ? std::numeric_limits<double>::infinity() : 0;
    std::unique_ptr<Journal> journal;
    if (resume) {
      journal = Journal::open(journal_, options.journal_interval);
      if (journal) journal_simd_targets(*journal);
    }
    ImageTask work(job(), options, 1, 1, std::move(journal));
    if (work.is_complete()) return;
    RankReport report;
    work.begin();
    work.render(executor, Progress::Style::none, report);
  }

  std::map<std::string, std::string> content() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.is_regular_file()) files[entry.path().string()] = bytes(entry.path());
    }
    return files;
  }
  static std::string bytes(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::string damaged(const std::string& journal, std::mt19937& random) const;

  fs::path folder_, image_, journal_;
  std::vector<std::string> victims_;
};

std::size_t below(std::mt19937& random, std::size_t end) {
  return static_cast<std::size_t>(random()) % end;
}

/// A journal whose bytes are wrong in one of four ways.
std::string with_wrong_bytes(const std::string& journal, int way, std::mt19937& random) {
  std::string bytes = journal;
  switch (way) {
    case 0:  // a cut
      return journal.substr(0, below(random, journal.size()));
    case 1:  // wrong bits
      for (std::size_t left = 1 + below(random, 3); left > 0; --left) {
        char& byte = bytes[below(random, bytes.size())];
        byte = static_cast<char>(byte ^ (1 << below(random, 8)));
      }
      return bytes;
    case 2: {  // a stretch of other bytes
      const std::size_t from = below(random, bytes.size());
      const bool is_random = random() % 2 == 0;
      for (std::size_t at = from; at < std::min(bytes.size(), from + 1 + below(random, 600));
           ++at) {
        bytes[at] = is_random ? static_cast<char>(random()) : '\0';
      }
      return bytes;
    }
    default: {  // bytes that are missing, or too many
      const std::size_t from = below(random, bytes.size());
      if (random() % 2 == 0) return bytes.erase(from, 1 + below(random, 100));
      return bytes.insert(from, std::string(1 + below(random, 100), static_cast<char>(random())));
    }
  }
}

/// A number that a journal may not expect.
std::uint64_t forged_number(std::mt19937& random) {
  constexpr std::uint64_t one = 1;
  constexpr std::array<std::uint64_t, 14> numbers = {0,         1,
                                                     2,         3,
                                                     4,         5,
                                                     6,         100,
                                                     one << 20, (one << 31) - 1,
                                                     one << 31, one << 32,
                                                     one << 63, ~std::uint64_t{0}};
  return numbers[below(random, numbers.size())];
}

std::string JournalDamageTest::damaged(const std::string& journal, std::mt19937& random) const {
  const auto way = static_cast<int>(random() % 8);
  if (way < 4) return with_wrong_bytes(journal, way, random);
  const auto joined = [&](const std::vector<Entry>& entries) {
    std::string text = journal.substr(0, magic_size);
    for (const Entry& entry : entries) text += packed(entry);
    return text;
  };
  std::vector<Entry> entries = entries_of(journal);
  switch (way) {
    case 4: {  // a forged number
      Entry& entry = entries[below(random, entries.size())];
      entry.head[below(random, Entry::fields)] = forged_number(random);
      return joined(entries);
    }
    case 5: {  // a forged length of zeros or values
      Entry& entry = entries[1 + below(random, entries.size() - 1)];
      const std::uint64_t number = forged_number(random);
      const std::size_t at = sizeof number * below(random, 2);
      std::memcpy(entry.payload.data() + at, &number, sizeof number);
      return joined(entries);
    }
    case 6: {  // entries that are repeated, missing or elsewhere
      const Entry moved = entries[below(random, entries.size())];
      if (random() % 2 == 0)
        entries.erase(entries.begin() + static_cast<int>(below(random, entries.size())));
      const auto to = entries.begin() + static_cast<int>(below(random, entries.size() + 1));
      entries.insert(to, 1 + below(random, 3), moved);
      return joined(entries);
    }
    default: {  // files to remove
      Entry entry;
      for (const std::string& victim : victims_) entry.payload += victim + '\0';
      entry.head[Entry::kind] = files_kind;
      entry.head[Entry::bytes] = entry.payload.size();
      const auto to = entries.begin() + static_cast<int>(below(random, entries.size() + 1));
      entries.insert(to, entry);
      return joined(entries);
    }
  }
}

TEST_F(JournalDamageTest, AJournalIsRefusedOrContinued) {
  InterruptedExecutor interrupted(journal_, 8);
  EXPECT_THROW(do_job(interrupted, false), RunError);
  const std::string journal = bytes(journal_);
  ASSERT_GT(entries_of(journal).size(), 8u);
  fs::remove(journal_);
  const auto nothing_made = content();
  ASSERT_EQ(nothing_made.size(), victims_.size());

  ThreadExecutor executor(1);
  std::ofstream(journal_, std::ios::binary) << journal;
  do_job(executor, true);
  const std::string expected = bytes(image_);
  ASSERT_FALSE(expected.empty());

  int refused = 0, resumed = 0;
  for (unsigned damage = 0; damage < damages; ++damage) {
    SCOPED_TRACE(fmt::format("seed {}, damage {}", seed, damage));
    std::mt19937 random(seed + damage);
    fs::remove(image_);
    std::ofstream(journal_, std::ios::binary) << damaged(journal, random);
    try {
      do_job(executor, true);
      EXPECT_TRUE(bytes(image_) == expected);
      EXPECT_FALSE(fs::exists(journal_));
      ++resumed;
    } catch (const InputError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with(journal_.string() + ": ")) << error.what();
      EXPECT_FALSE(fs::exists(image_));
      ++refused;
    }
    fs::remove(image_);
    fs::remove(journal_);
    ASSERT_EQ(content(), nothing_made);
    // Discarding a damaged journal removes no other file.
    std::ofstream(journal_, std::ios::binary) << damaged(journal, random);
    try {
      Journal::discard(journal_);
    } catch (const InputError&) {
      fs::remove(journal_);
    }
    ASSERT_EQ(content(), nothing_made);
  }
  EXPECT_GE(refused, least_of_each_outcome);
  EXPECT_GE(resumed, least_of_each_outcome);
}

}  // namespace
}  // namespace gamer::journal_damage_test
