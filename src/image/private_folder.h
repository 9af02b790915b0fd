#pragma once

#include <atomic>
#include <filesystem>
#include <memory>

#include "image/removed_on_signal.h"

namespace gamer {

/// A folder for files in the making, beside the final file. Only this user may enter it, so that
/// nobody else can put a link in a file's place.
///
/// Its owner holds the lock of a file in it, which bears the machine's name. A folder with this
/// machine's file that nobody has locked was left by a process that is gone. Files are named by way
/// of the folder's descriptor where the system allows: another user may be able to move the folder,
/// but not to give another one to the program.
class PrivateFolder {
 public:
  /// A new one. Throws RunError "<final path>: cannot write: ...".
  static std::unique_ptr<PrivateFolder> make(const std::filesystem::path& final_path);
  /// Removes what earlier processes of this user and this machine left beside this file. Folders of
  /// processes at work and on file systems without locks stay.
  static void remove_left_behind(const std::filesystem::path& final_path);

  /// Removes the folder. Its files are gone by then.
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  /// A path in the folder, for a file that the caller makes and removes.
  std::filesystem::path new_path();

 private:
  class Opened;
  PrivateFolder(std::unique_ptr<Opened> opened, const std::filesystem::path& path);

  std::unique_ptr<Opened> opened_;
  std::filesystem::path inside_;  ///< the folder, by its descriptor
  RemovedOnSignal folder_, lock_;
  std::atomic<int> files_{0};
};

}  // namespace gamer
