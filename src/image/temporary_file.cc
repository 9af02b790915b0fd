#include "image/temporary_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <list>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>

#include "gamer/core/error.h"
#include "gamer/image/clean_up.h"

namespace gamer {
namespace {

/// Leaves room for the prefix and the random end within the usual limit of 255 bytes.
constexpr std::size_t kLongestStem = 200;

/// A path in the making, where a signal handler finds it: entries are added and reused, never
/// freed.
struct Entry {
  std::array<char, PATH_MAX> path{};
  std::atomic<bool> is_used{false};
  Entry* next = nullptr;
};
std::atomic<Entry*> entries{nullptr};
std::mutex entries_mutex;

void remember(const std::filesystem::path& path) {
  const std::lock_guard lock(entries_mutex);
  Entry* entry = entries;
  while (entry != nullptr && entry->is_used) entry = entry->next;
  if (entry == nullptr) {
    entry = new Entry;
    entry->next = entries;
    entries = entry;
  }
  const std::string text = path.string();
  if (text.size() >= entry->path.size()) return;
  std::memcpy(entry->path.data(), text.c_str(), text.size() + 1);
  entry->is_used = true;
}

void forget(const std::filesystem::path& path) {
  const std::lock_guard lock(entries_mutex);
  for (Entry* entry = entries; entry != nullptr; entry = entry->next) {
    if (entry->is_used && path == entry->path.data()) entry->is_used = false;
  }
}

constexpr std::array<std::pair<int, const char*>, 3> ending_signals = {
    {{SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}, {SIGHUP, "SIGHUP"}}};

/// What to say, by signal. Those that were replaced are kept: a handler may be reading them.
using Messages = std::array<std::string, ending_signals.size()>;
std::atomic<const Messages*> messages{nullptr};

/// Only what is allowed in a signal handler.
extern "C" void remove_and_end(int signal) {
  static std::atomic_flag is_ending;
  // Another signal, in another thread.
  if (is_ending.test_and_set()) return;
  const Messages* texts = messages;
  for (std::size_t i = 0; texts != nullptr && i < texts->size(); ++i) {
    if (ending_signals[i].first != signal) continue;
    const std::string& text = (*texts)[i];
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
  }
  for (const Entry* entry = entries; entry != nullptr; entry = entry->next) {
    if (entry->is_used) unlink(entry->path.data());
  }
  std::signal(signal, SIG_DFL);
  raise(signal);
}

RunError failure(const std::filesystem::path& path, const std::string& action, int error) {
  return RunError(fmt::format("{}: {}: {}", path.string(), action, std::strerror(error)));
}

}  // namespace

TemporaryFile::TemporaryFile(const std::filesystem::path& final_path) : final_path_(final_path) {
  const std::string stem = final_path.filename().string().substr(0, kLongestStem);
  std::string name =
      (std::filesystem::absolute(final_path).parent_path() / ("." + stem + ".XXXXXX")).string();
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) throw failure(final_path, "cannot write", errno);
  // The file is made again by whoever writes it, with the permissions that the user's umask gives.
  close(descriptor);
  unlink(name.c_str());
  path_ = name;
  remember(path_);
}

TemporaryFile::~TemporaryFile() {
  if (!moved_) unlink(path_.c_str());
  forget(path_);
}

void TemporaryFile::move_to_final(bool overwrite) {
  const int descriptor = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw failure(final_path_, "cannot write", errno);
  const int synced = fsync(descriptor);
  const int error = errno;
  close(descriptor);
  if (synced != 0) throw failure(final_path_, "cannot write", error);
  if (!overwrite && std::filesystem::exists(std::filesystem::symlink_status(final_path_))) {
    throw failure(final_path_, "cannot move the finished file there", EEXIST);
  }
  if (rename(path_.c_str(), final_path_.c_str()) != 0) {
    throw failure(final_path_, "cannot move the finished file there", errno);
  }
  moved_ = true;
}

SpoolFile::SpoolFile() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) folder = "/tmp";
  std::string name = (folder / "gutil.XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) throw failure(folder, "cannot write a temporary file", errno);
  close(descriptor);
  path_ = name;
  remember(path_);
}

SpoolFile::~SpoolFile() {
  unlink(path_.c_str());
  forget(path_);
}

void clean_up_on_signals() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const auto& [signal, name] : ending_signals) std::signal(signal, remove_and_end);
}

void say_when_stopped(const std::string& program, const std::string& rest) {
  static auto& all = *new std::list<Messages>;
  // A progress bar may stand in the line.
  const char* start = isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "";
  Messages texts;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    texts[i] =
        fmt::format("{}{}: stopped by {}{}\n", start, program, ending_signals[i].second, rest);
  }
  const std::lock_guard lock(entries_mutex);
  messages = &all.emplace_back(std::move(texts));
}

void say_nothing_when_stopped() { messages = nullptr; }

std::vector<std::filesystem::path> files_in_the_making() {
  const std::lock_guard lock(entries_mutex);
  std::vector<std::filesystem::path> files;
  for (const Entry* entry = entries; entry != nullptr; entry = entry->next) {
    if (entry->is_used) files.emplace_back(entry->path.data());
  }
  return files;
}

}  // namespace gamer
