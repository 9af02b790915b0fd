#include "gamer/job/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <string_view>
#include <thread>
#include <utility>

#include "core/message.h"
#include "core/text.h"
#include "image/temporary_file.h"
#include "image/write_file.h"

namespace gamer {
namespace {

constexpr std::string_view magic = "gamer journal 2\n";
/// The first bytes of journals of all versions.
constexpr std::string_view magic_start = "gamer journal ";
/// Tries for a lock, with a pause between: a killed process may take two seconds to be gone.
constexpr int lock_tries = 20;
constexpr std::chrono::milliseconds lock_pause{100};
/// A shorter row of zeros costs less as values than as a run.
constexpr std::size_t shortest_run = 8;

enum class EntryKind : std::uint64_t { head = 1, rows = 2, single_rows = 3, end = 5 };

using Checksum = std::uint32_t;

Checksum checksum(std::span<const std::byte> bytes, Checksum before = 0) {
  // zlib's lengths have 32 bits.
  constexpr std::size_t most = std::size_t{1} << 30;
  uLong sum = before;
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), most))) {
    sum = crc32(sum, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uInt>(std::min(bytes.size(), most)));
  }
  return static_cast<Checksum>(sum);
}

template <class Value>
std::span<const std::byte> bytes_of(const Value& value) {
  return std::as_bytes(std::span(&value, 1));
}

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

void append(std::span<const std::byte> bytes, std::vector<std::byte>& out) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

// A negative zero is a value.
bool is_zero(float value) { return std::bit_cast<std::uint32_t>(value) == 0; }
bool is_zero(double value) { return std::bit_cast<std::uint64_t>(value) == 0; }

struct Piece {
  std::uint64_t zeros;
  std::uint64_t values;  ///< that follow
};

/// Pieces of zeros and values, without the long runs of zeros.
template <class Value>
void pack_values(std::span<const Value> values, std::vector<std::byte>& out) {
  const auto zeros_from = [&](std::size_t from) {
    std::size_t end = from;
    while (end < values.size() && is_zero(values[end])) ++end;
    return end - from;
  };
  for (std::size_t at = 0; at < values.size();) {
    const std::size_t zeros = zeros_from(at);
    const std::size_t first = at + zeros;
    at = first;
    while (at < values.size()) {
      const std::size_t run = zeros_from(at);
      if (run >= shortest_run || at + run == values.size()) break;
      at += run + 1;
    }
    append(bytes_of(Piece{zeros, at - first}), out);
    append(std::as_bytes(values.subspan(first, at - first)), out);
  }
}

/// Returns false when `packed` does not hold exactly these.
template <class Value>
bool unpack_values(std::span<const std::byte> packed, std::span<double> values) {
  while (!packed.empty()) {
    Piece piece{};
    if (packed.size() < sizeof piece) return false;
    std::memcpy(&piece, packed.data(), sizeof piece);
    packed = packed.subspan(sizeof piece);
    if (piece.zeros > values.size() || piece.values > values.size() - piece.zeros ||
        piece.values > packed.size() / sizeof(Value)) {
      return false;
    }
    std::fill_n(values.begin(), piece.zeros, 0.0);
    values = values.subspan(piece.zeros);
    for (std::size_t i = 0; i < piece.values; ++i) {
      Value value{};
      std::memcpy(&value, packed.data() + i * sizeof value, sizeof value);
      values[i] = value;
    }
    values = values.subspan(piece.values);
    packed = packed.subspan(piece.values * sizeof(Value));
  }
  return values.empty();
}

/// The head in pieces.
void pack_head(const JournalHead& head, const std::function<void(std::string_view)>& take) {
  const Record facts = {{"program", "", head.program},
                        {"simd", "", head.simd},
                        {"date", "", head.date},
                        {"truth", "", head.truth},
                        {"overwrite", "", head.overwrite ? "yes" : ""},
                        {"output", "", head.plan.output},
                        {"size", "", head.plan.size},
                        {"rows", "", fmt::format("{}", head.plan.rows)},
                        {"objects", "", fmt::format("{}", head.plan.objects)},
                        {"begun", "", fmt::format("{}", head.plan.begun)},
                        {"folder", "", head.plan.folder},
                        {"command", "", head.plan.command}};
  pack_record(facts, take);
  pack_record(head.record, take);
}

/// Throws RunError.
template <class Number>
Number fact_of(const std::string& text) {
  const std::optional<Number> number = number_of<Number>(text);
  if (!number || *number < 0) throw RunError("a fact is no number");
  return *number;
}

/// Throws RunError.
JournalHead unpack_head(std::string_view packed) {
  Record record = unpack_record(packed);
  JournalHead head;
  constexpr std::size_t facts = 12;
  if (record.size() < facts) throw RunError("a fact is missing");
  head.program = record[0].content;
  head.simd = record[1].content;
  head.date = record[2].content;
  head.truth = record[3].content;
  head.overwrite = !record[4].content.empty();
  head.plan = {record[5].content,
               record[6].content,
               fact_of<int>(record[7].content),
               fact_of<int>(record[8].content),
               fact_of<std::time_t>(record[9].content),
               record[10].content,
               record[11].content};
  head.record.assign(record.begin() + facts, record.end());
  return head;
}

/// The error of a file that is no journal.
class NoJournal : public InputError {
 public:
  explicit NoJournal(const std::filesystem::path& path,
                     const char* advice = "; remove it or choose another output")
      : InputError({path.string(), 0, 0},
                   fmt::format("no journal of gamer's, or a damaged one{}", advice)) {}
};

RunError read_failure(const std::filesystem::path& path, int error) {
  return run_error("{}: cannot read: {}", path.string(), std::strerror(error));
}

/// Reads up to `bytes.size()` bytes, fewer at the end of the file. Throws RunError.
std::size_t read_at(int descriptor, std::uint64_t offset, std::span<std::byte> bytes,
                    const std::filesystem::path& path) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = pread(descriptor, bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw read_failure(path, errno);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

/// Checks how the file begins.
void check_magic(int descriptor, const std::filesystem::path& path) {
  std::string start(magic.size(), '\0');
  start.resize(read_at(descriptor, 0, std::as_writable_bytes(std::span(start)), path));
  if (start == magic) return;
  if (!start.starts_with(magic_start)) throw NoJournal(path);
  throw InputError({path.string(), 0, 0},
                   "a journal of another version of gamer; finish the job with that one, or remove "
                   "the file to start anew");
}

/// Whether the file of that name is the one that is open. Another process may have removed it, or
/// made another one.
bool has_name(int descriptor, const std::filesystem::path& path) {
  struct stat opened {
  }, named{};
  return fstat(descriptor, &opened) == 0 && lstat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

/// The opened file; -1 when there is none.
int open_file(const std::filesystem::path& path) {
  // O_NONBLOCK: the call does not wait for a pipe's writer.
  const int descriptor =
      ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOCTTY | O_NOFOLLOW);
  if (descriptor < 0) {
    if (errno == ENOENT) return -1;
    if (errno == ELOOP) throw NoJournal(path);
    throw InputError({path.string(), 0, 0}, std::strerror(errno));
  }
  struct stat status {};
  if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(descriptor);
    throw NoJournal(path);
  }
  return descriptor;
}

/// The file, opened to be read.
int open_to_read(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor >= 0) return descriptor;
  if (errno != ENOENT) throw InputError({path.string(), 0, 0}, std::strerror(errno));
  throw InputError({path.string(), 0, 0},
                   "no such file; a job makes its journal, OUTPUT.journal, after ten seconds and "
                   "removes it when it is done");
}

/// Whether a process holds the lock, found by a shared lock that is released at once.
bool is_locked(int descriptor) {
  if (flock(descriptor, LOCK_SH | LOCK_NB) != 0) return errno == EWOULDBLOCK;
  flock(descriptor, LOCK_UN);
  return false;
}

/// The opened and locked file; -1 when there is none.
int open_locked(const std::filesystem::path& path) {
  int descriptor = open_file(path);
  for (int tries = 0; descriptor >= 0;) {
    // Not every file system has locks.
    if (flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) {
      if (has_name(descriptor, path)) break;
      // The process that had the lock has finished with the file.
      close(descriptor);
      descriptor = open_file(path);
      continue;
    }
    if (++tries > lock_tries) {
      close(descriptor);
      throw InputError({path.string(), 0, 0}, "another process is working on this job");
    }
    std::this_thread::sleep_for(lock_pause);
  }
  return descriptor;
}

/// Forces the names in the file's folder to disk, so that they survive a crash of the machine.
void sync_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

}  // namespace

struct Journal::Entry {
  EntryKind kind = EntryKind::end;
  std::uint64_t section = 0;
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t values = 0;
  std::uint64_t bytes = 0;
};

/// Place of an entry's rows in the file.
struct Journal::Block {
  Entry entry;
  std::uint64_t offset;
};

Journal::Journal(std::filesystem::path path, double interval, Clock clock)
    : path_(std::move(path)), interval_(interval), clock_(std::move(clock)) {
  if (!clock_) {
    clock_ = [] {
      using std::chrono::steady_clock;
      return std::chrono::duration<double>(steady_clock::now().time_since_epoch()).count();
    };
  }
  start_ = synced_ = clock_();
}

Journal::Journal(std::filesystem::path path, const JournalHead& head, double interval, Clock clock)
    : Journal(std::move(path), interval, std::move(clock)) {
  head_ = head;
}

std::unique_ptr<Journal> Journal::open(const std::filesystem::path& path, double interval,
                                       Clock clock) {
  const int descriptor = open_locked(path);
  if (descriptor < 0) return nullptr;
  std::unique_ptr<Journal> journal(new Journal(path, interval, std::move(clock)));
  journal->descriptor_ = descriptor;
  journal->read_entries();
  return journal;
}

JournalStatus Journal::status(const std::filesystem::path& path) {
  Journal journal(path, 0, {});
  journal.descriptor_ = open_to_read(path);
  JournalStatus status;
  try {
    struct stat file {};
    if (fstat(journal.descriptor_, &file) != 0) throw read_failure(path, errno);
    if (!S_ISREG(file.st_mode)) throw NoJournal(path);
    status.is_in_use = is_locked(journal.descriptor_);
    status.changed = file.st_mtime;
    journal.read_entries();
  } catch (const NoJournal&) {
    throw NoJournal(path, "; the journal of x.fits is x.fits.journal");
  }
  status.head = journal.head_;
  status.has_end = journal.has_end_;
  const FinishedWork work = journal.finished_work();
  status.finished_rows = count_rows(work.rows);
  status.finished_objects = work.objects;
  status.damaged_bytes = journal.tail_;
  return status;
}

bool Journal::is_in_use(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor < 0) return false;
  const bool is_in_use = is_locked(descriptor);
  close(descriptor);
  return is_in_use;
}

void Journal::discard(const std::filesystem::path& path) {
  const std::unique_ptr<Journal> journal(new Journal(path, 0, {}));
  journal->descriptor_ = open_locked(path);
  if (!journal->is_begun()) return;
  check_magic(journal->descriptor_, path);
  try {
    journal->read_entries();
  } catch (const InputError&) {
    // A damaged journal is removed, too.
  }
  journal->remove();
}

Journal::~Journal() {
  if (descriptor_ >= 0) close(descriptor_);
}

void Journal::add_rows(int section, RowRange rows, std::span<const double> values, bool single) {
  const Entry entry{single ? EntryKind::single_rows : EntryKind::rows,
                    static_cast<std::uint64_t>(section), static_cast<std::uint64_t>(rows.first),
                    static_cast<std::uint64_t>(rows.last), values.size()};
  entry_.assign(sizeof entry, std::byte{0});
  if (single) {
    floats_.resize(values.size());
    std::transform(values.begin(), values.end(), floats_.begin(),
                   [](double value) { return static_cast<float>(value); });
    pack_values<float>(floats_, entry_);
  } else {
    pack_values<double>(values, entry_);
  }
  add(entry);
  if (is_begun()) {
    sync_when_due();
  } else if (clock_() - start_ >= interval_ || pending_.size() > most_pending) {
    begin();
  }
}

void Journal::add_end() {
  const Entry entry{EntryKind::end};
  entry_.assign(sizeof entry, std::byte{0});
  add(entry);
  if (is_begun() && fdatasync(descriptor_) != 0) throw write_failure(path_);
}

void Journal::remove() {
  if (!is_begun()) return;
  // The files that the job made must have their names first.
  sync_folder(path_);
  if (has_name(descriptor_, path_) && unlink(path_.c_str()) != 0) {
    throw run_error("{}: cannot remove: {}", path_.string(), std::strerror(errno));
  }
  close(std::exchange(descriptor_, -1));
}

void Journal::add(Entry entry) {
  entry.bytes = entry_.size() - sizeof entry;
  std::memcpy(entry_.data(), &entry, sizeof entry);
  append(bytes_of(checksum(entry_)), entry_);
  if (is_begun()) {
    write(entry_);
  } else {
    append(entry_, pending_);
  }
}

void Journal::begin() {
  // The file has another name until its head is on disk, so that no journal lacks its head.
  TemporaryFile temporary(path_);
  descriptor_ = ::open(temporary.path().c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw write_failure(path_);
  try {
    flock(descriptor_, LOCK_EX | LOCK_NB);
    write_head();
    write(pending_);
    if (when_begun_) when_begun_();
    temporary.move_to_final(false);
  } catch (const RunError&) {
    close(std::exchange(descriptor_, -1));
    if (!std::filesystem::exists(std::filesystem::symlink_status(path_))) throw;
    throw run_error("{}: another process has begun this job meanwhile", path_.string());
  }
  sync_folder(path_);
  pending_ = {};
  synced_ = clock_();
}

void Journal::write_head() {
  // The head holds the list of the scene, which may be long, so that it is written in pieces.
  Entry entry{EntryKind::head};
  pack_head(head_, [&](std::string_view piece) { entry.bytes += piece.size(); });
  write(bytes_of(magic));
  write(bytes_of(entry));
  Checksum sum = checksum(bytes_of(entry));
  pack_head(head_, [&](std::string_view piece) {
    sum = checksum(bytes_of(piece), sum);
    write(bytes_of(piece));
  });
  write(bytes_of(sum));
}

void Journal::cut_tail() {
  if (ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) throw write_failure(path_);
  tail_ = 0;
}

void Journal::write(std::span<const std::byte> bytes) {
  if (tail_ > 0) cut_tail();
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw write_failure(path_);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

void Journal::sync_when_due() {
  const double now = clock_();
  if (now - synced_ < interval_) return;
  if (fdatasync(descriptor_) != 0) throw write_failure(path_);
  synced_ = clock_();
}

bool Journal::is_sound(const Entry& entry, std::uint64_t payload) {
  constexpr std::uint64_t at_once = std::uint64_t{1} << 20;
  Checksum sum = checksum(bytes_of(entry));
  for (std::uint64_t done = 0; done < entry.bytes; done += entry_.size()) {
    entry_.resize(std::min(at_once, entry.bytes - done));
    if (read_at(descriptor_, payload + done, entry_, path_) < entry_.size()) return false;
    sum = checksum(entry_, sum);
  }
  Checksum expected = 0;
  const auto bytes = std::as_writable_bytes(std::span(&expected, 1));
  if (read_at(descriptor_, payload + entry.bytes, bytes, path_) < bytes.size()) return false;
  if (sum != expected) return false;
  constexpr std::uint64_t most_rows = std::numeric_limits<int>::max();
  return entry.first <= entry.last && entry.last <= most_rows;
}

std::string Journal::read_text(const Entry& entry, std::uint64_t payload) const {
  std::string text(entry.bytes, '\0');
  text.resize(read_at(descriptor_, payload, std::as_writable_bytes(std::span(text)), path_));
  return text;
}

void Journal::read_entries() {
  check_magic(descriptor_, path_);
  struct stat status {};
  if (fstat(descriptor_, &status) != 0) throw read_failure(path_, errno);
  const auto size = static_cast<std::uint64_t>(status.st_size);
  std::uint64_t at = magic.size();
  bool has_head = false;
  while (size - at >= sizeof(Entry) + sizeof(Checksum)) {
    Entry entry;
    read_at(descriptor_, at, std::as_writable_bytes(std::span(&entry, 1)), path_);
    const std::uint64_t payload = at + sizeof entry;
    if (entry.bytes > size - payload - sizeof(Checksum) || !is_sound(entry, payload)) break;
    if (has_head == (entry.kind == EntryKind::head)) break;
    at = payload + entry.bytes + sizeof(Checksum);
    if (entry.kind == EntryKind::head) {
      try {
        head_ = unpack_head(read_text(entry, payload));
      } catch (const RunError&) {
        throw NoJournal(path_);
      }
      has_head = true;
    } else if (entry.kind == EntryKind::rows || entry.kind == EntryKind::single_rows) {
      blocks_.push_back({entry, payload});
    } else if (entry.kind == EntryKind::end) {
      has_end_ = true;
    }
    // Other builds' entries may be of other kinds; check_same_job() refuses their journals.
  }
  if (!has_head) throw NoJournal(path_);
  size_ = at;
  tail_ = size - at;
  if (lseek(descriptor_, static_cast<off_t>(at), SEEK_SET) < 0) throw read_failure(path_, errno);
}

int count_rows(std::span<const RowRange> ranges) {
  int rows = 0;
  for (const RowRange& range : ranges) rows += range.size();
  return rows;
}

std::vector<RowRange> Journal::finished(int section) const {
  std::vector<RowRange> ranges;
  for (const Block& block : blocks_) {
    if (block.entry.section != static_cast<std::uint64_t>(section)) continue;
    ranges.push_back({static_cast<int>(block.entry.first), static_cast<int>(block.entry.last)});
  }
  std::ranges::sort(ranges, {}, &RowRange::first);
  std::vector<RowRange> joined;
  for (const RowRange& range : ranges) {
    if (!joined.empty() && range.first <= joined.back().last) {
      joined.back().last = std::max(joined.back().last, range.last);
    } else {
      joined.push_back(range);
    }
  }
  return joined;
}

FinishedWork Journal::finished_work() const {
  // The image's section is behind that of table TRUTH.
  if (head_.truth.empty()) return {finished(0), 0};
  return {finished(1), count_rows(finished(0))};
}

void Journal::replay(int section, std::size_t values_per_row,
                     const Executor::Consume& consume) const {
  std::vector<std::byte> packed;
  std::vector<double> values;
  for (const Block& block : blocks_) {
    const Entry& entry = block.entry;
    if (entry.section != static_cast<std::uint64_t>(section)) continue;
    const RowRange rows{static_cast<int>(entry.first), static_cast<int>(entry.last)};
    packed.resize(entry.bytes);
    values.resize(static_cast<std::size_t>(rows.size()) * values_per_row);
    const bool is_whole =
        rows.size() > 0 && values.size() == entry.values &&
        read_at(descriptor_, block.offset, packed, path_) == packed.size() &&
        (entry.kind == EntryKind::single_rows ? unpack_values<float>(packed, values)
                                              : unpack_values<double>(packed, values));
    if (!is_whole) {
      throw input_error({path_.string(), 0, 0},
                        "rows {} to {} are damaged; --overwrite starts anew", rows.first,
                        rows.last - 1);
    }
    consume(rows, values);
  }
}

}  // namespace gamer
