#pragma once

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/message.h"
#include "image/temporary_file.h"

namespace gamer {

/// By default the reason is that of errno.
inline RunError write_failure(const std::filesystem::path& path,
                              const std::string& reason = std::strerror(errno)) {
  return run_error("{}: cannot write: {}", path.string(), reason);
}

/// Throws RunError unless each of a file's parts, such as rows, was written. The number of the
/// first part in messages is `first`.
inline void check_all_written(const std::vector<bool>& written, const std::filesystem::path& path,
                              const char* part, int first) {
  const auto missing = std::find(written.begin(), written.end(), false);
  if (missing == written.end()) return;
  throw run_error("{}: {} {} was never written", path.string(), part,
                  missing - written.begin() + first);
}

/// Runs `write(std::FILE*)` on a new file, which is moved to `path` if all went well.
template <class Write>
void write_file(const std::filesystem::path& path, bool overwrite, Write write) {
  TemporaryFile temporary(path);
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(temporary.path().c_str(), "wb"),
                                                       &std::fclose);
  if (!file) throw write_failure(path);
  write(file.get());
  if (std::fclose(file.release()) != 0) throw write_failure(path);
  temporary.move_to_final(overwrite);
}

}  // namespace gamer
