#include "image/private_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/message.h"
#include "gamer/image/new_file.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Longest part of the file's name in a folder's name; with prefix and number it fits 255 bytes.
constexpr std::size_t longest_stem = 200;
/// Old folders are looked for under this many numbers, even after a gap. More processes that work
/// on one file are rare.
constexpr int numbers_looked_at = 4;

constexpr std::string_view part_suffix = ".part";

/// Name of the lock file, "lock.<host>", for this machine's processes. File systems may not share
/// locks between machines.
const std::string& lock_name() {
  static const std::string name = [] {
    std::array<char, HOST_NAME_MAX + 1> host{};
    gethostname(host.data(), host.size() - 1);
    std::ranges::replace(host, '/', '_');
    return fmt::format("lock.{}", host.data());
  }();
  return name;
}

/// Path of folder `number` (from 1) beside a file.
fs::path folder_path(const fs::path& final_path, int number) {
  const std::string stem = final_path.filename().string().substr(0, longest_stem);
  return fs::absolute(final_path).parent_path() / fmt::format(".{}.{}", stem, number);
}

/// Whether this error of a new folder means that another process has removed or replaced it.
bool is_others_doing(int error) {
  return error == EEXIST || error == ENOENT || error == ENOTDIR || error == ELOOP ||
         error == EWOULDBLOCK;
}

}  // namespace

/// Descriptors of a folder and its lock file.
class PrivateFolder::Opened {
 public:
  explicit Opened(const fs::path& path)
      : path_(path), folder_(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)) {}
  ~Opened() {
    for (const int descriptor : {folder_, lock_}) {
      if (descriptor >= 0) close(descriptor);
    }
  }
  Opened& operator=(Opened&&) = delete;

  /// Locks a new folder; returns an errno, 0 for success.
  int lock_new() {
    if (folder_ < 0 || !open_lock(O_CREAT | O_EXCL)) return errno;
    struct stat folder {
    }, lock{};
    if (fstat(folder_, &folder) != 0 || fstat(lock_, &lock) != 0) return errno;
    // Servers that change the owner of all files give both the same wrong owner.
    if (folder.st_uid != lock.st_uid) return EPERM;
    // Some file systems have no locks.
    if (flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return errno;
    return has_lock() ? 0 : ENOENT;
  }
  /// Whether the folder is accessible to this user alone.
  bool is_own() const {
    struct stat folder {};
    return folder_ >= 0 && fstat(folder_, &folder) == 0 && folder.st_uid == geteuid() &&
           (folder.st_mode & (S_IRWXG | S_IRWXO)) == 0;
  }
  /// Locks a folder of this machine whose owner process has ended.
  bool lock_left() { return open_lock(0) && flock(lock_, LOCK_EX | LOCK_NB) == 0 && has_lock(); }

  /// Path of the folder by its descriptor.
  fs::path inside() const {
    const fs::path name = fmt::format("/proc/self/fd/{}", folder_);
    return access(name.c_str(), X_OK) == 0 ? name : path_;
  }
  void remove_parts() const {
    std::error_code error;
    fs::directory_iterator entry(inside(), error);
    for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
      const std::string name = entry->path().filename().string();
      if (name.ends_with(part_suffix)) unlinkat(folder_, name.c_str(), 0);
    }
  }
  void remove_folder() const {
    unlinkat(folder_, lock_name().c_str(), 0);
    remove_empty();
  }
  void remove_empty() const { rmdir(path_.c_str()); }

 private:
  bool open_lock(int flags) {
    lock_ = openat(folder_, lock_name().c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC | flags,
                   S_IRUSR | S_IWUSR);
    return lock_ >= 0;
  }
  /// Whether the locked file is still in the folder; its previous owner may have removed it.
  bool has_lock() const {
    struct stat by_name {
    }, locked{};
    return fstatat(folder_, lock_name().c_str(), &by_name, AT_SYMLINK_NOFOLLOW) == 0 &&
           fstat(lock_, &locked) == 0 && by_name.st_dev == locked.st_dev &&
           by_name.st_ino == locked.st_ino;
  }

  fs::path path_;
  int folder_;
  int lock_ = -1;
};

PrivateFolder::PrivateFolder(std::unique_ptr<Opened> opened, const fs::path& path)
    : opened_(std::move(opened)),
      inside_(opened_->inside()),
      folder_(path, true),
      lock_(inside_ / lock_name()) {}

PrivateFolder::~PrivateFolder() { opened_->remove_folder(); }

std::unique_ptr<PrivateFolder> PrivateFolder::make(const fs::path& final_path) {
  for (int number = 1;; ++number) {
    const fs::path path = folder_path(final_path, number);
    // Registered before mkdir(), so that a signal at any time removes the folder. A signal may
    // remove another process' empty folder; that process then makes a new one.
    const RemovedOnSignal folder(path, true);
    int error = mkdir(path.c_str(), S_IRWXU) == 0 ? 0 : errno;
    if (error == EEXIST) continue;
    if (error == 0) {
      auto opened = std::make_unique<Opened>(path);
      const RemovedOnSignal lock(opened->inside() / lock_name());
      error = opened->lock_new();
      if (error == 0) {
        return std::unique_ptr<PrivateFolder>(new PrivateFolder(std::move(opened), path));
      }
      if (is_others_doing(error)) continue;
      opened->remove_folder();
    }
    throw run_error("{}: cannot write: {}", final_path.string(), std::strerror(error));
  }
}

void PrivateFolder::remove_left_behind(const fs::path& final_path) {
  for (int number = 1;; ++number) {
    const fs::path path = folder_path(final_path, number);
    if (!is_there(path)) {
      if (number >= numbers_looked_at) return;
      continue;
    }
    Opened folder(path);
    if (!folder.is_own()) continue;
    if (folder.lock_left()) {
      folder.remove_parts();
      folder.remove_folder();
    } else {
      // The process ended before it made its lock file, or after it removed the file.
      folder.remove_empty();
    }
  }
}

fs::path PrivateFolder::new_path() { return inside_ / fmt::format("{}{}", ++files_, part_suffix); }

}  // namespace gamer
