#include "studio/output_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_file_name_bytes = 100, most_entries = 1000;

}  // namespace

bool OutputFolder::is_name(std::string_view name) {
  const auto is_plain = [](char c) {
    return is_letter_or_digit(c) || std::string_view(" ._-+").find(c) != std::string_view::npos;
  };
  return !name.empty() && name.size() <= most_file_name_bytes && name.front() != '.' &&
         name.front() != '-' && name.front() != ' ' && name.back() != ' ' &&
         std::ranges::all_of(name, is_plain);
}

std::optional<fs::path> OutputFolder::find(std::string_view name) const {
  if (!is_name(name)) return std::nullopt;
  const fs::path path = folder_ / name;
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::regular) return std::nullopt;
  return path;
}

fs::path OutputFolder::place(std::string_view name,
                             const std::vector<std::string>& suffixes) const {
  const bool has_suffix = std::ranges::any_of(suffixes, [&](const std::string& suffix) {
    return name.size() > suffix.size() && name.ends_with(suffix);
  });
  if (!is_name(name) || !has_suffix) {
    throw input_error("{} is no name of a file here: letters, digits, blanks and ._-+, then {}",
                      in_quotes(name), fmt::join(suffixes, " or "));
  }
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw run_error("cannot make the folder '{}': {}", folder_.string(), error.message());
  return folder_ / name;
}

std::vector<OutputFolder::Entry> OutputFolder::list() const {
  std::vector<std::pair<fs::file_time_type, Entry>> found;
  std::error_code error;
  for (const auto& one : fs::directory_iterator(folder_, error)) {
    const std::string name = one.path().filename().string();
    if (!find(name)) continue;
    found.emplace_back(one.last_write_time(error), Entry{name, one.file_size(error)});
  }
  std::ranges::sort(found, [](const auto& a, const auto& b) {
    return std::pair(b.first, a.second.name) < std::pair(a.first, b.second.name);
  });
  if (found.size() > most_entries) found.resize(most_entries);
  std::vector<Entry> entries;
  for (auto& [time, entry] : found) entries.push_back(std::move(entry));
  return entries;
}

}  // namespace gamer
