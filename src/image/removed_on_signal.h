#pragma once

#include <filesystem>

namespace gamer {

/// Registers a file, or a folder that will be empty. While this object lives, a signal that ends
/// the program removes it.
class RemovedOnSignal {
 public:
  explicit RemovedOnSignal(std::filesystem::path path, bool is_folder = false);
  ~RemovedOnSignal();
  RemovedOnSignal& operator=(RemovedOnSignal&&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace gamer
