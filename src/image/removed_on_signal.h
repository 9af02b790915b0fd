#pragma once

#include <filesystem>

namespace gamer {

/// A file, or a folder that is empty by then, which a signal that ends the program removes as long
/// as this object lives.
class RemovedOnSignal {
 public:
  explicit RemovedOnSignal(std::filesystem::path path, bool is_folder = false);
  ~RemovedOnSignal();
  RemovedOnSignal(const RemovedOnSignal&) = delete;
  RemovedOnSignal& operator=(const RemovedOnSignal&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace gamer
