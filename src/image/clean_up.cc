#include "gamer/image/clean_up.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <climits>
#include <csignal>
#include <cstring>
#include <ctime>
#include <list>
#include <mutex>
#include <utility>

#include "gamer/core/utc_time.h"
#include "image/removed_on_signal.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// A path to remove, readable in a signal handler: entries are added and reused, never freed.
struct Entry {
  std::array<char, PATH_MAX> path{};
  bool is_folder = false;
  std::atomic<bool> is_used{false};
  Entry* next = nullptr;
};
std::atomic<Entry*> entries{nullptr};
std::mutex entries_mutex;

void remember(const fs::path& path, bool is_folder) {
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
  entry->is_folder = is_folder;
  entry->is_used = true;
}

void forget(const fs::path& path) {
  const std::lock_guard lock(entries_mutex);
  for (Entry* entry = entries; entry != nullptr; entry = entry->next) {
    if (!entry->is_used || path != entry->path.data()) continue;
    entry->is_used = false;
    return;
  }
}

constexpr std::array<std::pair<int, const char*>, 3> ending_signals = {
    {{SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}, {SIGHUP, "SIGHUP"}}};

/// Messages by signal. Replaced messages are kept, since a handler may be reading them.
using Messages = std::array<StopLine, ending_signals.size()>;
std::atomic<Messages*> messages{nullptr};

/// A signal handler may call it.
void put_time(StopLine& line) {
  const UtcTime now = utc_time(std::time(nullptr));
  if (line.time_at > line.text.size() || now.size() > line.text.size() - line.time_at) return;
  std::memcpy(line.text.data() + line.time_at, now.data(), now.size());
}

/// Uses only functions that a signal handler may call.
extern "C" void remove_and_end(int signal) {
  static std::atomic_flag is_ending;
  // Another thread is handling another signal.
  if (is_ending.test_and_set()) return;
  Messages* texts = messages;
  for (std::size_t i = 0; texts != nullptr && i < texts->size(); ++i) {
    if (ending_signals[i].first != signal) continue;
    StopLine& line = (*texts)[i];
    put_time(line);
    const std::string& text = line.text;
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
  }
  // Files are removed first, since only empty folders can be removed.
  for (const Entry* entry = entries; entry != nullptr; entry = entry->next) {
    if (entry->is_used && !entry->is_folder) unlink(entry->path.data());
  }
  for (const Entry* entry = entries; entry != nullptr; entry = entry->next) {
    if (entry->is_used && entry->is_folder) rmdir(entry->path.data());
  }
  std::signal(signal, SIG_DFL);
  raise(signal);
}

}  // namespace

RemovedOnSignal::RemovedOnSignal(fs::path path, bool is_folder) : path_(std::move(path)) {
  remember(path_, is_folder);
}

RemovedOnSignal::~RemovedOnSignal() { forget(path_); }

void clean_up_on_signals() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const auto& [signal, name] : ending_signals) std::signal(signal, remove_and_end);
}

void say_when_stopped(const std::function<StopLine(const std::string& signal)>& line) {
  static auto& all = *new std::list<Messages>;
  Messages texts;
  for (std::size_t i = 0; i < texts.size(); ++i) texts[i] = line(ending_signals[i].second);
  const std::lock_guard lock(entries_mutex);
  messages = &all.emplace_back(std::move(texts));
}

void say_nothing_when_stopped() { messages = nullptr; }

}  // namespace gamer
