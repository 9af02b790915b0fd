#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "image/private_folder.h"
#include "image/removed_on_signal.h"

namespace gamer {

/// A file in the making, in a private folder beside the final one, so that moving it there is one
/// step of the file system. Removed on destruction unless it was moved. The files that a process
/// makes at a time beside each other share a folder, which bears the first one's name.
class TemporaryFile {
 public:
  /// Proves that the folder can be written, and removes what killed processes left beside this
  /// file; the file itself is left to the caller. Throws RunError.
  explicit TemporaryFile(const std::filesystem::path& final_path);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Until it is moved.
  const std::filesystem::path& path() const { return file_->path(); }
  const std::filesystem::path& final_path() const { return final_path_; }

  /// Forces the file to disk and moves it to its final name. Throws RunError, also when a file
  /// stands there that may not be overwritten.
  void move_to_final(bool overwrite);

 private:
  std::filesystem::path final_path_;
  std::shared_ptr<PrivateFolder> folder_;
  std::optional<RemovedOnSignal> file_;
};

/// Where a stream's bytes wait, in the system's folder for temporary files: a path, for a file that
/// the caller makes. Removed with the object.
class SpoolFile {
 public:
  /// Throws RunError.
  SpoolFile();

  const std::filesystem::path& path() const { return file_.path(); }

 private:
  TemporaryFile file_;
};

}  // namespace gamer
