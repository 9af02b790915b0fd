#pragma once

#include <filesystem>

namespace gamer {

/// A file in the making: a hidden, unique name beside the final one, so that moving it there is one
/// step of the file system. Removed on destruction unless it was moved.
class TemporaryFile {
 public:
  /// Chooses the name, and thereby proves that the folder can be written; the file itself is left
  /// to the caller. Throws RunError.
  explicit TemporaryFile(const std::filesystem::path& final_path);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& final_path() const { return final_path_; }

  /// Forces the file to disk and moves it to its final name. Throws RunError, also when a file
  /// stands there that may not be overwritten.
  void move_to_final(bool overwrite);

 private:
  std::filesystem::path final_path_;
  std::filesystem::path path_;
  bool moved_ = false;
};

/// A file for a stream's bytes, in the system's folder for temporary files; removed with the object.
class SpoolFile {
 public:
  /// Throws RunError.
  SpoolFile();
  ~SpoolFile();
  SpoolFile(const SpoolFile&) = delete;
  SpoolFile& operator=(const SpoolFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace gamer
