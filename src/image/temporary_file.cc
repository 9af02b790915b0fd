#include "image/temporary_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <system_error>

#include "core/message.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

RunError failure(const fs::path& path, const std::string& action, int error) {
  return run_error("{}: {}: {}", path.string(), action, std::strerror(error));
}

/// This process's private folder beside a file.
std::shared_ptr<PrivateFolder> folder_beside(const fs::path& final_path) {
  static std::mutex mutex;
  static auto& folders = *new std::map<fs::path, std::weak_ptr<PrivateFolder>>;
  const std::lock_guard lock(mutex);
  std::weak_ptr<PrivateFolder>& known = folders[fs::absolute(final_path).parent_path()];
  std::shared_ptr<PrivateFolder> folder = known.lock();
  if (folder == nullptr) {
    PrivateFolder::remove_left_behind(final_path);
    known = folder = PrivateFolder::make(final_path);
  }
  return folder;
}

/// Moves a file; returns an errno, 0 for success. Without `overwrite` the system rejects an
/// existing file atomically; on file systems that cannot, the caller must have checked.
int move_file(const fs::path& from, const fs::path& to, bool overwrite) {
  if (!overwrite) {
    if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL && errno != ENOSYS) return errno;
    if (fs::exists(fs::symlink_status(to))) return EEXIST;
  }
  return rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

fs::path spool_path() {
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  return (error ? fs::path("/tmp") : folder) / "gutil";
}

}  // namespace

TemporaryFile::TemporaryFile(const fs::path& final_path)
    : final_path_(final_path), folder_(folder_beside(final_path)), file_(folder_->new_path()) {}

TemporaryFile::~TemporaryFile() {
  if (file_) unlink(path().c_str());
}

void TemporaryFile::move_to_final(bool overwrite) {
  const int descriptor = open(path().c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw failure(final_path_, "cannot write", errno);
  const int synced = fsync(descriptor);
  int error = errno;
  close(descriptor);
  if (synced != 0) throw failure(final_path_, "cannot write", error);
  error = move_file(path(), final_path_, overwrite);
  if (error != 0) throw failure(final_path_, "cannot move the finished file there", error);
  file_.reset();
  folder_.reset();
}

SpoolFile::SpoolFile() : file_(spool_path()) {}

}  // namespace gamer
