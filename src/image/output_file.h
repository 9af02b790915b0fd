#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "image/temporary_file.h"

namespace gamer {

/// An unfinished output: a file beside its final name. The caller makes the file. The output "-" is
/// a file in the system's folder for temporary files; deliver() copies it to standard output.
class OutputFile {
 public:
  /// Throws RunError.
  explicit OutputFile(const std::filesystem::path& name);

  /// Path of the unfinished file.
  const std::filesystem::path& path() const;
  /// The output in messages: its name, or "standard output".
  const std::string& label() const { return label_; }
  /// Gives the complete and closed file its name, or copies it to standard output. Throws RunError.
  void deliver(bool overwrite);

 private:
  std::string label_;
  std::optional<TemporaryFile> temporary_;
  std::optional<SpoolFile> spool_;
};

/// The name of an output in messages.
std::string output_label(const std::filesystem::path& name);

}  // namespace gamer
