#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/shared_text.h"

namespace gamer {

/// Where the texts that a job needs come from: parameter files, galaxies, SEDs. On rank 0 they are
/// read from disk and recorded; the record travels to the other ranks and into the FITS file, where
/// it is all that is needed to make the image again.
class Resources {
 public:
  struct Text {
    std::string name;   ///< key of the record, e.g. "galaxies/ngc4321"
    std::string label;  ///< what messages call it: a path
    SharedText content;
  };

  /// Reads from disk. Named data are searched in the folder of the file that names them, then in
  /// each of `folders`/<kind> in turn.
  explicit Resources(std::vector<std::filesystem::path> folders);
  /// Serves a record; never touches the disk.
  static Resources from_record(std::vector<Text> record);

  /// The text of a named datum: `kind` is "galaxies" or "seds", `name` a bare name or a file name
  /// (`suffixes` are tried, e.g. ".toml"), `beside` the label of the file that names it. A name
  /// with a '/' is a path relative to that file's folder and is searched nowhere else. What is
  /// found in `folders` is recorded as kind/name, what is found by its path as kind/./path
  /// (kind/../path, kind//path), so that equal names of different files stay apart. Throws
  /// InputError without a location (the caller adds it), with near names when nothing is found;
  /// also for a directory or another file that is not regular, one that cannot be read, exceeds
  /// 1024 MiB or has NUL bytes.
  const Text& find(const std::string& kind, const std::string& name, const std::string& beside,
                   std::span<const std::string> suffixes);

  /// The text of a file given by path, recorded under `name`; what is recorded already is not read
  /// again. Throws InputError.
  const Text& read(const std::string& name, const std::filesystem::path& path);

  /// Records a text that was made, not read; replaces one of the same name.
  const Text& add(Text text);

  /// A text of the record, or null.
  const Text* recorded(const std::string& name) const;

  /// Names of kind's data in all folders, for messages and lists.
  std::vector<std::string> names(const std::string& kind,
                                 std::span<const std::string> suffixes) const;

  /// Says that the job reads this file by other means.
  void add_file(const std::filesystem::path& path) { files_.push_back(path); }
  /// The files that were read, in their order.
  const std::vector<std::filesystem::path>& files() const { return files_; }

  /// Everything handed out so far, ordered by name.
  std::vector<Text> record() const;

 private:
  bool disk_ = true;
  std::vector<std::filesystem::path> folders_;
  std::map<std::string, Text> texts_;
  std::vector<std::filesystem::path> files_;
};

/// The folders of a normal run: the working directory, the one that the environment variable
/// GAMER_DATA names, then the one where data were installed (or, where none is, the source tree).
std::vector<std::filesystem::path> default_data_folders();

}  // namespace gamer
