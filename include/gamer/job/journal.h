#pragma once

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/job/record.h"
#include "gamer/parallel/executor.h"

namespace gamer {

/// A description of a journal's job for people.
struct JournalPlan {
  std::string output;     ///< "x.fits and 2 more"
  std::string size;       ///< "512 x 512 pixels, 3 planes"
  int rows = 0;           ///< of the image
  int objects = 0;        ///< of table TRUTH; 0 if there is none
  std::time_t begun = 0;  ///< time at which the job began
  std::string folder;     ///< the working folder
  std::string command;    ///< continues the job in that folder; empty if unknown
};

/// The state of a job at its beginning, from which its files follow.
struct JournalHead {
  std::string program;     ///< name and version
  std::string simd;        ///< instruction set, which affects the last bits
  std::string date;        ///< DATE of the files
  std::string truth;       ///< destination of the truth; empty for none
  bool overwrite = false;  ///< whether existing files may be replaced
  Record record;
  JournalPlan plan = {};
};

/// The finished part of an image and of its table TRUTH.
struct FinishedWork {
  std::vector<RowRange> rows;  ///< in ascending order
  int objects = 0;
};

/// The state of a journal.
struct JournalStatus {
  JournalHead head;
  bool is_in_use = false;           ///< a process holds its lock
  bool has_end = false;             ///< all rows are there
  int finished_rows = 0;            ///< of the image
  int finished_objects = 0;         ///< of table TRUTH
  std::time_t changed = 0;          ///< when the file was last written
  std::uint64_t damaged_bytes = 0;  ///< at its end, cut off or damaged
};

/// A file of finished rows, from which an interrupted job continues.
///
/// The file has a line with its name, then entries. An entry has a head, bytes, and the CRC-32 of
/// both. The head is six numbers of 64 bits in the machine's order: kind, section, first and last
/// row, number of values, number of bytes. Values have double or single precision, and runs of
/// zeros are left out. Reading ends at an entry that is cut off or has a wrong CRC; the next entry
/// written replaces it. A section is the number of a run within the job, such as the run of its
/// truth or of its image.
///
/// Entries wait in memory until the job is `interval` seconds old, or until they exceed 32 MiB.
/// Short jobs thus make no file. Afterwards each entry is written at once, so that it survives the
/// end of the process. Every `interval` seconds the file is forced to disk, so that it survives a
/// failure of the machine. The file is locked while a process uses it.
class Journal {
 public:
  /// The clock gives seconds; by default it is a steady one.
  using Clock = std::function<double()>;
  /// Bytes of rows that wait in memory before the file begins.
  static constexpr std::size_t most_pending = std::size_t{32} << 20;

  /// Begins the journal of a job.
  Journal(std::filesystem::path path, const JournalHead& head, double interval, Clock clock = {});
  /// Opens the journal of a job that continues; null if there is none. Throws InputError if the
  /// file is no journal, has a damaged head or is in use.
  static std::unique_ptr<Journal> open(const std::filesystem::path& path, double interval,
                                       Clock clock = {});
  /// Reads a journal without changing it, also while a process works on it. Throws InputError if
  /// there is none, RunError.
  static JournalStatus status(const std::filesystem::path& path);
  /// Whether a process works on the journal's job. False where that cannot be known, as on file
  /// systems without locks.
  static bool is_in_use(const std::filesystem::path& path);
  /// Removes the journal of an earlier job, if it exists. Throws InputError if the file is no
  /// journal or is in use, RunError if it cannot be removed.
  static void discard(const std::filesystem::path& path);
  /// Closes the journal and keeps the file.
  ~Journal();
  Journal& operator=(Journal&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Whether there is a file.
  bool is_begun() const { return descriptor_ >= 0; }
  /// Sets a function that is called just before the file gets its name.
  void when_begun(std::function<void()> call) { when_begun_ = std::move(call); }

  // The functions below throw RunError "<path>: cannot write: ...".
  void add_rows(int section, RowRange rows, std::span<const double> values, bool single);
  /// Records that all rows are there. From now on files get their final names.
  void add_end();
  /// Removes the file of a finished job.
  void remove();

  // The functions below give the contents that open() found.
  const JournalHead& head() const { return head_; }
  /// The finished rows in ascending order, with neighbours joined.
  std::vector<RowRange> finished(int section) const;
  FinishedWork finished_work() const;
  bool has_end() const { return has_end_; }
  /// Gives the rows of a section to `consume`. Throws InputError if rows do not have
  /// `values_per_row` values, RunError if they cannot be read.
  void replay(int section, std::size_t values_per_row, const Executor::Consume& consume) const;

 private:
  struct Entry;
  struct Block;

  Journal(std::filesystem::path path, double interval, Clock clock);
  /// Writes an entry. Its bytes are in `entry_`, after room for the head.
  void add(Entry entry);
  void begin();
  void write_head();
  void write(std::span<const std::byte> bytes);
  void cut_tail();
  void sync_when_due();
  void read_entries();
  bool is_sound(const Entry& entry, std::uint64_t payload);
  std::string read_text(const Entry& entry, std::uint64_t payload) const;

  std::filesystem::path path_;
  JournalHead head_;
  double interval_;
  Clock clock_;
  double start_ = 0;
  double synced_ = 0;
  int descriptor_ = -1;
  std::function<void()> when_begun_;
  std::vector<std::byte> pending_;  ///< entries before there is a file
  std::vector<std::byte> entry_;    ///< entry being made
  std::vector<float> floats_;

  std::vector<Block> blocks_;
  bool has_end_ = false;
  std::uint64_t size_ = 0;  ///< size of the undamaged entries, bytes
  std::uint64_t tail_ = 0;  ///< damaged bytes behind them
};

/// Number of rows in ranges that do not overlap.
int count_rows(std::span<const RowRange> ranges);

}  // namespace gamer
