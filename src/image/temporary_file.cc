#include "image/temporary_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "gamer/core/error.h"

namespace gamer {
namespace {

/// Leaves room for the prefix and the random end within the usual limit of 255 bytes.
constexpr std::size_t kLongestStem = 200;

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
}

TemporaryFile::~TemporaryFile() {
  if (!moved_) unlink(path_.c_str());
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

}  // namespace gamer
