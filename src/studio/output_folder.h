#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// The folder of StudioOptions, in which the page writes and reads files by plain names.
class OutputFolder {
 public:
  explicit OutputFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Whether a name is that of a plain file: letters, digits, blanks and . _ - + alone, neither a
  /// dot nor a - at its beginning, at most 100 bytes.
  static bool is_name(std::string_view name);

  /// The file of a name; nothing where there is none or it is no regular file.
  std::optional<std::filesystem::path> find(std::string_view name) const;
  /// The path of a new file. The folder is made if need be. Throws InputError where is_name() is
  /// false or the name has none of these suffixes, and RunError.
  std::filesystem::path place(std::string_view name,
                              const std::vector<std::string>& suffixes) const;
  /// The names of all files with their bytes, the newest first.
  struct Entry {
    std::string name;
    std::uintmax_t bytes = 0;
  };
  std::vector<Entry> list() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace gamer
