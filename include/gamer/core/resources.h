#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace gamer {

/// Where the texts that a job needs come from: parameter files, galaxies, SEDs. On rank 0 they are
/// read from disk and recorded; the record travels to the other ranks and into the FITS file, where
/// it is all that is needed to make the image again.
class Resources {
 public:
  struct Text {
    std::string name;     ///< key of the record, e.g. "galaxies/ngc4321"
    std::string label;    ///< what messages call it: a path
    std::string content;
  };

  /// Reads from disk. Named data are searched in the folder of the file that names them, then in
  /// each of `folders`/<kind> in turn.
  explicit Resources(std::vector<std::filesystem::path> folders);
  /// Serves a record; never touches the disk.
  static Resources from_record(std::vector<Text> record);

  /// The text of a named datum: `kind` is "galaxies" or "seds", `name` a bare name or a file name
  /// (`suffixes` are tried, e.g. ".toml"), `beside` the label of the file that names it. Throws
  /// InputError without a location (the caller adds it), with near names when nothing is found.
  const Text& find(const std::string& kind, const std::string& name, const std::string& beside,
                   std::span<const std::string> suffixes);

  /// The text of a file given by path, recorded under `name`. Throws InputError.
  const Text& read(const std::string& name, const std::filesystem::path& path);

  /// Records a text that was made, not read.
  const Text& add(Text text);

  /// Names of kind's data in all folders, for messages and lists.
  std::vector<std::string> names(const std::string& kind, std::span<const std::string> suffixes) const;

  /// Everything handed out so far, ordered by name.
  std::vector<Text> record() const;

 private:
  bool disk_ = true;
  std::vector<std::filesystem::path> folders_;
  std::map<std::string, Text> texts_;
};

/// The folders of a normal run: the working directory, then the one where data were installed (or,
/// in a build tree, the source tree).
std::vector<std::filesystem::path> default_data_folders();

}  // namespace gamer
