#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "gamer/core/shared_text.h"

namespace gamer {

/// Source of the texts that a job needs: parameter files, galaxies, SEDs. On rank 0 they are read
/// from disk and recorded. The record goes to the other ranks and into the FITS file; it suffices
/// to make the image again.
class Resources {
 public:
  struct Text {
    std::string name;   ///< key of the record, e.g. "galaxies/ngc4321"
    std::string label;  ///< name in messages: a path
    SharedText content;
  };

  /// A call of find() and what it found.
  struct Lookup {
    std::string kind, name, beside;
    std::vector<std::string> suffixes;
    SharedText content;
  };

  /// Reads from disk. Named data are searched in the folder of the file that names them, then in
  /// each of `folders`/<kind>.
  explicit Resources(std::vector<std::filesystem::path> folders);
  /// Serves a record; never touches the disk.
  static Resources from_record(std::vector<Text> record);

  /// The text of a named datum. `kind` is a folder of data, such as "galaxies" or "seds". `name` is
  /// a bare name or a file name; `suffixes` are tried, e.g. ".toml". `beside` is the label of the
  /// file that names it. A name with a '/' is a path relative to that file's folder and is found
  /// nowhere else. The key of the record is kind/name for a text found in `folders`. For a text
  /// found by path it is kind/./path, kind/../path or kind//path. Equal names of different files
  /// thus stay apart. Throws InputError without a location (the caller adds it). Its message
  /// proposes similar names if nothing is found. Other errors are files that are not regular, are
  /// unreadable, exceed 1024 MiB or have NUL bytes.
  const Text& find(const std::string& kind, const std::string& name, const std::string& beside,
                   std::span<const std::string> suffixes);

  /// The text of a file given by path, recorded under `name`. A text already recorded is not read
  /// again. Throws InputError if the file cannot be read.
  const Text& read(const std::string& name, const std::filesystem::path& path);

  /// Records a text that the program made; it replaces a text of equal name.
  const Text& add(Text text);

  /// A recorded text, or null.
  const Text* recorded(const std::string& name) const;

  /// Names of all data of a kind in all folders, for messages and lists.
  std::vector<std::string> names(const std::string& kind,
                                 std::span<const std::string> suffixes) const;

  /// Adds to files() a file that the job reads by other means.
  void add_file(const std::filesystem::path& path) { files_.push_back(path); }
  /// The files read, in order.
  const std::vector<std::filesystem::path>& files() const { return files_; }

  /// Adds the calls of find() from now on to a list, until another list or null is given.
  void log_lookups(std::vector<Lookup>* list) { lookups_ = list; }

  /// All texts in use so far, ordered by name.
  std::vector<Text> record() const;

 private:
  /// Does what find() does, without an entry in the list of log_lookups().
  const Text& search(const std::string& kind, const std::string& name, const std::string& beside,
                     std::span<const std::string> suffixes);

  bool disk_ = true;
  std::vector<std::filesystem::path> folders_;
  std::map<std::string, Text> texts_;
  std::vector<Lookup>* lookups_ = nullptr;
  std::vector<std::filesystem::path> files_;
};

/// The folders of a normal run: the working directory, that of the environment variable GAMER_DATA,
/// and the installed data. Without an installation the source tree serves.
std::vector<std::filesystem::path> default_data_folders();

}  // namespace gamer
