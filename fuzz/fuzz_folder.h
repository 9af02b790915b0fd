#pragma once

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>

/// A temporary folder, in memory where such a file system exists.
class FuzzFolder {
 public:
  FuzzFolder() {
    std::error_code error;
    const bool has_memory = std::filesystem::is_directory("/dev/shm", error);
    std::string name = has_memory ? "/dev/shm/gamer_fuzz_XXXXXX" : "/tmp/gamer_fuzz_XXXXXX";
    path_ = mkdtemp(name.data());
  }
  ~FuzzFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  FuzzFolder(const FuzzFolder&) = delete;
  FuzzFolder& operator=(const FuzzFolder&) = delete;

  /// Makes the folder the working directory. Other paths of a fuzzer must then be absolute.
  void enter() const { std::filesystem::current_path(path_); }
  std::string write(const std::string& name, const std::uint8_t* data, std::size_t size) const {
    std::ofstream file(path_ / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    return (path_ / name).string();
  }
  /// Removes all files but those named in `kept`.
  void clean(std::initializer_list<std::string> kept) const {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      const std::string name = entry.path().filename().string();
      if (std::find(kept.begin(), kept.end(), name) == kept.end()) {
        std::filesystem::remove_all(entry.path());
      }
    }
  }

 private:
  std::filesystem::path path_;
};
