#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "image/private_folder.h"
#include "image/removed_on_signal.h"

namespace gamer {

/// An unfinished file in a private folder beside the final file, so that moving it is one step of
/// the file system. It is removed on destruction unless it was moved. The unfinished files of a
/// process that belong in one folder share a private folder, named after the first of them.
class TemporaryFile {
 public:
  /// Checks that the folder can be written, and removes what killed processes left beside this
  /// file. The caller makes the file. Throws RunError.
  explicit TemporaryFile(const std::filesystem::path& final_path);
  ~TemporaryFile();
  TemporaryFile& operator=(TemporaryFile&&) = delete;

  /// Path of the file before it is moved.
  const std::filesystem::path& path() const { return file_->path(); }
  const std::filesystem::path& final_path() const { return final_path_; }

  /// Writes the file to disk (fsync) and moves it to its final name. Throws RunError, also when a
  /// file there must not be overwritten.
  void move_to_final(bool overwrite);

 private:
  std::filesystem::path final_path_;
  std::shared_ptr<PrivateFolder> folder_;
  std::optional<RemovedOnSignal> file_;
};

/// A path in the system's folder for temporary files, for the bytes of a stream. The caller makes
/// the file; it is removed with this object.
class SpoolFile {
 public:
  /// Throws RunError.
  SpoolFile();

  const std::filesystem::path& path() const { return file_.path(); }

 private:
  TemporaryFile file_;
};

}  // namespace gamer
