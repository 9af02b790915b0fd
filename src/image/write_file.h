#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>

#include "core/message.h"
#include "gamer/core/error.h"
#include "image/temporary_file.h"

namespace gamer {

inline RunError write_failure(const std::filesystem::path& path, const std::string& reason) {
  return run_error("{}: cannot write: {}", path.string(), reason);
}

/// Runs `write(std::FILE*)` on a new file, which is moved to `path` if all went well.
template <class Write>
void write_file(const std::filesystem::path& path, bool overwrite, Write write) {
  TemporaryFile temporary(path);
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(temporary.path().c_str(), "wb"),
                                                       &std::fclose);
  if (!file) throw write_failure(path, std::strerror(errno));
  write(file.get());
  if (std::fclose(file.release()) != 0) throw write_failure(path, std::strerror(errno));
  temporary.move_to_final(overwrite);
}

}  // namespace gamer
