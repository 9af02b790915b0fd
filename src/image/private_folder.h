#pragma once

#include <atomic>
#include <filesystem>
#include <memory>

#include "image/removed_on_signal.h"

namespace gamer {

/// A private folder for unfinished files, beside the final file. Only this user may enter it, so
/// nobody else can replace a file by a link.
///
/// The process that owns the folder locks a file in it, whose name contains the machine's name. If
/// that file is there but not locked, the owner process has ended. Where the system allows, files
/// are opened relative to the folder's descriptor. A user who moves the folder then cannot
/// substitute another one.
class PrivateFolder {
 public:
  /// Makes a new folder. Throws RunError "<final path>: cannot write: ...".
  static std::unique_ptr<PrivateFolder> make(const std::filesystem::path& final_path);
  /// Removes folders that earlier processes of this user and machine left beside this file. Folders
  /// of running processes and on file systems without locks stay.
  static void remove_left_behind(const std::filesystem::path& final_path);

  /// Removes the folder; its files must be gone.
  ~PrivateFolder();
  PrivateFolder& operator=(PrivateFolder&&) = delete;

  /// A new path in the folder; the caller makes and removes the file.
  std::filesystem::path new_path();

 private:
  class Opened;
  PrivateFolder(std::unique_ptr<Opened> opened, const std::filesystem::path& path);

  std::unique_ptr<Opened> opened_;
  std::filesystem::path inside_;  ///< path of the folder by its descriptor
  RemovedOnSignal folder_, lock_;
  std::atomic<int> files_{0};
};

}  // namespace gamer
