#include "image/temporary_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <climits>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "gamer/core/error.h"
#include "gamer/image/new_file.h"
#include "image/image_test_util.h"

namespace gamer::temporary_file_test {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

using Names = std::set<std::string>;

std::string lock_name() {
  char host[HOST_NAME_MAX + 1] = {};
  gethostname(host, HOST_NAME_MAX);
  return std::string("lock.") + host;
}

/// Another process, which makes these files and then waits.
class OtherProcess {
 public:
  explicit OtherProcess(const std::vector<fs::path>& files) {
    int ready[2] = {};
    if (pipe(ready) != 0) return;
    process_ = fork();
    if (process_ == 0) {
      std::vector<std::unique_ptr<TemporaryFile>> made;
      for (const fs::path& file : files) {
        made.push_back(std::make_unique<TemporaryFile>(file));
        write(made.back()->path(), "some of it");
      }
      close(ready[1]);
      while (true) pause();
    }
    close(ready[1]);
    char byte = 0;
    [[maybe_unused]] const ssize_t end = read(ready[0], &byte, 1);
    close(ready[0]);
  }
  ~OtherProcess() { stop(); }
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  /// Kills the process.
  void stop() {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }

 private:
  pid_t process_ = -1;
};

TEST(TemporaryFile, IsInAFolderOfTheUsersOwn) {
  const TemporaryFolder folder;
  {
    TemporaryFile file(folder / "x.fits"), other(folder / "y.fits");
    ASSERT_EQ(names_in(folder.path()), Names{".x.fits.1"});
    struct stat status {};
    ASSERT_EQ(stat((folder / ".x.fits.1").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, mode_t{S_IRWXU});
    write(file.path(), "x");
    write(other.path(), "y");
    // A change of the name by another user has no effect.
    fs::rename(folder / ".x.fits.1", folder / "moved");
    fs::create_directory(folder / "elsewhere");
    fs::create_directory_symlink(folder / "elsewhere", folder / ".x.fits.1");
    file.move_to_final(false);
    EXPECT_TRUE(fs::is_empty(folder / "elsewhere"));
    fs::remove(folder / ".x.fits.1");
    fs::rename(folder / "moved", folder / ".x.fits.1");
    fs::remove(folder / "elsewhere");
  }
  EXPECT_EQ(names_in(folder.path()), Names{"x.fits"});
  EXPECT_EQ(file_bytes(folder / "x.fits"), "x");
}

TEST(TemporaryFile, HasTheUsersPermissionsInTheEnd) {
  const TemporaryFolder folder;
  const mode_t before = umask(027);
  TemporaryFile file(folder / "x.fits");
  write(file.path(), "x");
  file.move_to_final(false);
  umask(before);
  struct stat status {};
  ASSERT_EQ(stat((folder / "x.fits").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, mode_t{0640});
}

TEST(TemporaryFile, ReplacesOnlyWhatItMay) {
  const TemporaryFolder folder;
  const fs::path path = folder / "x.fits";
  write(path, "old");
  TemporaryFile file(path);
  write(file.path(), "new");
  try {
    file.move_to_final(false);
    ADD_FAILURE() << "no RunError";
  } catch (const RunError& error) {
    EXPECT_EQ(error.what(), path.string() + ": cannot move the finished file there: File exists");
  }
  EXPECT_EQ(file_bytes(path), "old");
  file.move_to_final(true);
  EXPECT_EQ(file_bytes(path), "new");
}

TEST(TemporaryFile, WhatAKilledProcessLeftIsRemoved) {
  const TemporaryFolder folder;
  OtherProcess process({folder / "x.fits", folder / "x_truth.fits"});
  ASSERT_EQ(names_in(folder.path()), Names{".x.fits.1"});
  EXPECT_EQ(names_in(folder / ".x.fits.1"), (Names{"1.part", "2.part", lock_name()}));
  process.stop();
  { const TemporaryFile other(folder / "y.fits"); }
  EXPECT_EQ(names_in(folder.path()), Names{".x.fits.1"});
  { const TemporaryFile again(folder / "x.fits"); }
  EXPECT_EQ(names_in(folder.path()), Names{});
}

TEST(TemporaryFile, ChecksOfAFileChangeNothing) {
  const TemporaryFolder folder;
  OtherProcess process({folder / "x.fits"});
  process.stop();
  check_new_file(folder / "x.fits", false);
  EXPECT_EQ(names_in(folder.path()), Names{".x.fits.1"});
  EXPECT_EQ(names_in(folder / ".x.fits.1"), (Names{"1.part", lock_name()}));
}

TEST(TemporaryFile, WhatAnotherMachineMakesStays) {
  const TemporaryFolder folder;
  OtherProcess process({folder / "x.fits"});
  process.stop();
  // The renamed lock is like that of another machine, whose locks are not seen here.
  const fs::path made = folder / ".x.fits.1";
  fs::rename(made / lock_name(), made / "lock.elsewhere");
  {
    const TemporaryFile file(folder / "x.fits");
    EXPECT_EQ(names_in(folder.path()), (Names{".x.fits.1", ".x.fits.2"}));
  }
  EXPECT_EQ(names_in(folder.path()), Names{".x.fits.1"});
  EXPECT_EQ(names_in(made), (Names{"1.part", "lock.elsewhere"}));
}

TEST(TemporaryFile, AFolderThatIsEmptyIsRemoved) {
  const TemporaryFolder folder;
  fs::create_directory(folder / ".x.fits.1");
  fs::permissions(folder / ".x.fits.1", fs::perms::owner_all);
  { const TemporaryFile file(folder / "x.fits"); }
  EXPECT_EQ(names_in(folder.path()), Names{});
}

TEST(TemporaryFile, WhatALivingProcessMakesStays) {
  const TemporaryFolder folder;
  const fs::path path = folder / "x.fits";
  OtherProcess first({path});
  OtherProcess second({path});
  EXPECT_EQ(names_in(folder.path()), (Names{".x.fits.1", ".x.fits.2"}));
  {
    const TemporaryFile file(path);
    EXPECT_EQ(names_in(folder.path()), (Names{".x.fits.1", ".x.fits.2", ".x.fits.3"}));
  }
  first.stop();
  { const TemporaryFile file(path); }
  EXPECT_EQ(names_in(folder.path()), Names{".x.fits.2"});
  EXPECT_EQ(names_in(folder / ".x.fits.2"), (Names{"1.part", lock_name()}));
  second.stop();
  { const TemporaryFile file(path); }
  EXPECT_EQ(names_in(folder.path()), Names{});
}

TEST(TemporaryFile, WhatIsNotItsOwnStays) {
  const TemporaryFolder folder;
  const fs::path path = folder / "x.fits";
  // A file, a link to a folder, a folder that others may enter, and a folder with further contents.
  write(folder / ".x.fits.1", "precious");
  fs::create_directory(folder / "other");
  fs::permissions(folder / "other", fs::perms::owner_all);
  write(folder / "other/1.part", "precious");
  fs::create_directory_symlink(folder / "other", folder / ".x.fits.2");
  fs::create_directory(folder / ".x.fits.3");
  fs::permissions(folder / ".x.fits.3", fs::perms::all);
  write(folder / ".x.fits.3/1.part", "precious");
  fs::create_directory(folder / ".x.fits.4");
  fs::permissions(folder / ".x.fits.4", fs::perms::owner_all);
  write(folder / ".x.fits.4/mine", "precious");
  {
    TemporaryFile file(path);
    EXPECT_TRUE(fs::exists(folder / ".x.fits.5"));
    write(file.path(), "x");
    file.move_to_final(false);
  }
  EXPECT_EQ(names_in(folder.path()),
            (Names{".x.fits.1", ".x.fits.2", ".x.fits.3", ".x.fits.4", "other", "x.fits"}));
  for (const char* name : {".x.fits.1", "other/1.part", ".x.fits.3/1.part", ".x.fits.4/mine"}) {
    EXPECT_EQ(file_bytes(folder / name), "precious") << name;
  }
}

TEST(TemporaryFile, LongNamesAreMade) {
  const TemporaryFolder folder;
  const fs::path path = folder / (std::string(250, 'x') + ".fits");
  TemporaryFile file(path);
  write(file.path(), "x");
  file.move_to_final(false);
  EXPECT_EQ(file_bytes(path), "x");
}

TEST(TemporaryFile, AFolderThatIsGoneIsAnError) {
  const TemporaryFolder folder;
  const fs::path path = folder / "none/x.fits";
  try {
    const TemporaryFile file(path);
    ADD_FAILURE() << "no RunError";
  } catch (const RunError& error) {
    EXPECT_EQ(error.what(), path.string() + ": cannot write: No such file or directory");
  }
}

TEST(SpoolFile, LeavesNothing) {
  const TemporaryFolder folder;
  const char* before = getenv("TMPDIR");
  const std::string text = before != nullptr ? before : "/tmp";
  ASSERT_EQ(setenv("TMPDIR", folder.path().c_str(), 1), 0);
  {
    const SpoolFile file;
    write(file.path(), "x");
    EXPECT_EQ(names_in(folder.path()), Names{".gutil.1"});
  }
  EXPECT_EQ(names_in(folder.path()), Names{});
  ASSERT_EQ(setenv("TMPDIR", text.c_str(), 1), 0);
}

}  // namespace
}  // namespace gamer::temporary_file_test
