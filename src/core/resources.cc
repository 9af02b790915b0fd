#include "gamer/core/resources.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t max_text_bytes = std::uintmax_t{1} << 30;

/// Whether a path exists. A loop of links counts, since skipping it would find another file of that
/// name.
bool exists_or_loops(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error) || error == std::errc::too_many_symbolic_link_levels;
}

std::string read_file(const fs::path& path) {
  const std::string label = in_quotes(path.generic_string());
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) throw input_error("there is no file {}", label);
  if (fs::is_directory(status)) throw input_error("{} is a directory", label);
  // A pipe or device could block or never end.
  if (status.type() != fs::file_type::none && !fs::is_regular_file(status)) {
    throw input_error("{} is not a regular file", label);
  }
  std::ifstream stream(path, std::ios::binary);
  const std::uintmax_t size = fs::file_size(path, error);
  if (!stream || error) throw input_error("cannot read {}", label);
  if (size > max_text_bytes) {
    throw input_error("{} is larger than {} MiB", label, max_text_bytes >> 20);
  }
  std::string content(static_cast<std::size_t>(size), '\0');
  stream.read(content.data(), static_cast<std::streamsize>(size));
  if (stream.gcount() != static_cast<std::streamsize>(size)) {
    throw input_error("cannot read {}", label);
  }
  if (content.find('\0') != std::string::npos) {
    throw input_error("{} has NUL bytes; it is not a text file", label);
  }
  return content;
}

bool has_suffix(std::string_view name, std::span<const std::string> suffixes) {
  return std::ranges::any_of(suffixes, [&](const std::string& suffix) {
    return name.size() > suffix.size() && name.ends_with(suffix);
  });
}

/// File names to try for a `name` that a file gives.
std::vector<std::string> file_names(const std::string& name,
                                    std::span<const std::string> suffixes) {
  std::vector<std::string> result;
  const bool is_path = name.find('/') != std::string::npos;
  const bool is_complete = has_suffix(name, suffixes);
  if (is_path || is_complete) result.push_back(name);
  if (!is_complete) {
    for (const std::string& suffix : suffixes) result.push_back(name + suffix);
  }
  return result;
}

/// Record key of a file found by its path. A name looked up in the data folders has no further '/',
/// so the two kinds of keys differ: "seds/E", "seds/./E.sed", "seds/../E.sed", "seds//home/E.sed".
std::string path_key(const std::string& kind, const fs::path& path) {
  const std::string text = path.generic_string();
  const bool is_below = path.is_relative() && !text.starts_with("../");
  return kind + (is_below ? "/./" : "/") + text;
}

std::string noun(const std::string& kind) {
  if (kind == "galaxies") return "galaxy";
  if (kind == "seds") return "SED";
  if (kind == "bandpasses") return "bandpass";
  if (kind == "instruments") return "instrument";
  if (kind == "luminosities") return "luminosity function";
  return kind;
}

/// Adds the names, without suffix, of a folder's files that have one of the suffixes.
void collect_names(const fs::path& folder, std::span<const std::string> suffixes,
                   std::set<std::string>& names) {
  std::error_code error;
  fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string file = entry->path().filename().generic_string();
    for (const std::string& suffix : suffixes) {
      if (file.size() > suffix.size() && file.ends_with(suffix)) {
        names.insert(file.substr(0, file.size() - suffix.size()));
        break;
      }
    }
  }
}

}  // namespace

Resources::Resources(std::vector<fs::path> folders) : folders_(std::move(folders)) {}

Resources Resources::from_record(std::vector<Text> record) {
  Resources result({});
  result.disk_ = false;
  for (Text& text : record) result.add(std::move(text));
  return result;
}

const Resources::Text& Resources::find(const std::string& kind, const std::string& name,
                                       const std::string& beside,
                                       std::span<const std::string> suffixes) {
  const Text& found = search(kind, name, beside, suffixes);
  if (lookups_ != nullptr) {
    lookups_->push_back({kind, name, beside, {suffixes.begin(), suffixes.end()}, found.content});
  }
  return found;
}

const Resources::Text& Resources::search(const std::string& kind, const std::string& name,
                                         const std::string& beside,
                                         std::span<const std::string> suffixes) {
  if (name.empty()) throw input_error("the {}'s name is empty", noun(kind));
  const fs::path folder = fs::path(beside).parent_path();

  const auto recorded_or_read = [&](const std::string& key, const fs::path& path) -> const Text* {
    if (const auto known = texts_.find(key); known != texts_.end()) return &known->second;
    if (!disk_ || !exists_or_loops(path)) return nullptr;
    return &read(key, path);
  };

  for (const std::string& file : file_names(name, suffixes)) {
    const fs::path path = (folder / file).lexically_normal();
    if (const Text* text = recorded_or_read(path_key(kind, path), path)) return *text;
  }
  if (name.find('/') != std::string::npos) {
    throw input_error("there is no file {} for {} {}",
                      in_quotes((folder / name).lexically_normal().generic_string()), noun(kind),
                      in_quotes(name));
  }
  const std::string key = kind + "/" + name;
  if (const Text* text = recorded_or_read(key, {})) return *text;
  for (const fs::path& data : folders_) {
    for (const std::string& file : file_names(name, suffixes)) {
      const fs::path path = (data / kind / file).lexically_normal();
      if (const Text* text = recorded_or_read(key, path)) return *text;
    }
  }

  const std::vector<std::string> in_folders = names(kind, suffixes);
  std::set<std::string> known(in_folders.begin(), in_folders.end());
  if (disk_) collect_names(folder, suffixes, known);
  const std::vector<std::string> candidates(known.begin(), known.end());
  std::string hint = did_you_mean(name, candidates);
  if (hint.empty() && disk_) {
    std::vector<std::string> places = {in_quotes(folder.empty() ? "." : folder.generic_string())};
    for (const fs::path& data : folders_) {
      std::string place = in_quotes((data / kind).lexically_normal().generic_string());
      if (std::ranges::find(places, place) == places.end()) places.push_back(std::move(place));
    }
    hint = fmt::format("; there is no {} in {}", fmt::join(file_names(name, suffixes), ", "),
                       fmt::join(places, ", "));
  }
  throw input_error("unknown {} {}{}", noun(kind), in_quotes(name), hint);
}

const Resources::Text& Resources::read(const std::string& name, const fs::path& path) {
  if (const auto known = texts_.find(name); known != texts_.end()) return known->second;
  if (!disk_) throw input_error("the record holds no {}", in_quotes(name));
  add_file(path);
  return add({name, path.generic_string(), read_file(path)});
}

const Resources::Text& Resources::add(Text text) {
  std::string name = text.name;
  return texts_.insert_or_assign(std::move(name), std::move(text)).first->second;
}

const Resources::Text* Resources::recorded(const std::string& name) const {
  const auto found = texts_.find(name);
  return found == texts_.end() ? nullptr : &found->second;
}

std::vector<std::string> Resources::names(const std::string& kind,
                                          std::span<const std::string> suffixes) const {
  std::set<std::string> result;
  for (const fs::path& data : folders_) collect_names(data / kind, suffixes, result);
  if (!disk_) {
    const std::string prefix = kind + "/";
    for (const auto& [key, text] : texts_) {
      const bool is_named = key.starts_with(prefix) && key.find('/', prefix.size()) == key.npos;
      if (is_named) result.insert(key.substr(prefix.size()));
    }
  }
  return {result.begin(), result.end()};
}

std::vector<Resources::Text> Resources::record() const {
  std::vector<Text> result;
  for (const auto& [key, text] : texts_) result.push_back(text);
  return result;
}

std::vector<fs::path> default_data_folders() {
  std::vector<fs::path> result = {"."};
  if (const char* data = std::getenv("GAMER_DATA"); data != nullptr && *data != '\0') {
    result.emplace_back(data);
  }
  const fs::path installed = GAMER_INSTALL_DATA_DIR;
  result.push_back(exists_or_loops(installed) ? installed : fs::path(GAMER_SOURCE_DATA_DIR));
  return result;
}

}  // namespace gamer
