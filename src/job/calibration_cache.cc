#include "gamer/job/calibration_cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

#include "gamer/core/build_identity.h"
#include "gamer/core/random.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Number of folders over which files are spread, by the first digit of their names.
constexpr std::size_t sub_folders = 16;
/// The files of a build are removed once it has not been used for this time.
constexpr auto longest_disuse = std::chrono::hours(24 * 30);

/// Reads values from bytes; has_failed() once they do not suffice.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  std::string_view take(std::uint64_t count) {
    has_failed_ = has_failed_ || count > bytes_.size();
    if (has_failed_) return {};
    const std::string_view result = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return result;
  }
  std::uint64_t word() {
    std::uint64_t result = 0;
    const std::string_view bytes = take(sizeof result);
    std::ranges::copy(bytes, reinterpret_cast<char*>(&result));
    return result;
  }
  bool has_failed() const { return has_failed_; }
  bool is_at_end() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  bool has_failed_ = false;
};

void append_word(std::uint64_t word, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

std::uint64_t check_sum(std::string_view bytes) { return hash_text(0, bytes); }

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> result;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    result.push_back(entry->path());
  }
  return result;
}

fs::file_time_type time_of(const fs::path& path) {
  std::error_code error;
  const fs::file_time_type time = fs::last_write_time(path, error);
  return error ? fs::file_time_type::min() : time;
}

/// Removes the older half of the files in a folder that holds too many.
void forget_oldest(const fs::path& folder) {
  const std::vector<fs::path> files = entries_of(folder);
  if (files.size() <= CalibrationCache::most_files / sub_folders) return;
  std::vector<std::pair<fs::file_time_type, fs::path>> by_time;
  for (const fs::path& file : files) by_time.emplace_back(time_of(file), file);
  const auto middle = by_time.begin() + static_cast<std::ptrdiff_t>(by_time.size() / 2);
  std::ranges::nth_element(by_time, middle);
  for (auto entry = by_time.begin(); entry != middle; ++entry) {
    std::error_code error;
    fs::remove(entry->second, error);
  }
}

/// Removes the folders of builds that are not in use any more.
void forget_builds(const fs::path& folder) {
  const auto oldest = fs::file_time_type::clock::now() - longest_disuse;
  for (const fs::path& build : entries_of(folder)) {
    std::error_code error;
    if (time_of(build) < oldest) fs::remove_all(build, error);
  }
}

/// A folder named by the environment; none if the variable is not set or empty.
std::optional<fs::path> named_folder(const char* variable) {
  const char* text = std::getenv(variable);
  if (text == nullptr || *text == '\0') return std::nullopt;
  return text;
}

std::unique_ptr<const CalibrationCache>& cache_in_use() {
  static auto& cache = *new std::unique_ptr<const CalibrationCache>;
  return cache;
}

}  // namespace

std::string pack_parts(const CalibrationParts& parts) {
  std::string bytes;
  for (const auto& [name, numbers] : parts) {
    append_word(name.size(), bytes);
    bytes += name;
    append_word(numbers.size(), bytes);
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double));
  }
  append_word(check_sum(bytes), bytes);
  return bytes;
}

CalibrationParts unpack_parts(std::string_view bytes) {
  constexpr std::size_t end = sizeof(std::uint64_t);
  if (bytes.size() < end) return {};
  const std::string_view content = bytes.substr(0, bytes.size() - end);
  if (ByteReader(bytes.substr(content.size())).word() != check_sum(content)) return {};
  CalibrationParts parts;
  ByteReader reader(content);
  while (!reader.is_at_end()) {
    const std::string name(reader.take(reader.word()));
    const std::string_view values = reader.take(reader.word() * sizeof(double));
    if (reader.has_failed()) return {};
    std::vector<double> numbers(values.size() / sizeof(double));
    std::memcpy(numbers.data(), values.data(), values.size());
    parts.emplace(name, std::move(numbers));
  }
  return parts;
}

CalibrationCache::CalibrationCache(const fs::path& folder, std::string identity)
    : identity_(std::move(identity)),
      folder_(folder / "calibration" / fmt::format("{:016x}", hash_text(0, identity_))) {}

std::unique_ptr<CalibrationCache> CalibrationCache::of_user() {
  std::optional<fs::path> folder = named_folder("GAMER_CACHE");
  if (folder == "off") return nullptr;
  if (!folder) {
    folder = named_folder("XDG_CACHE_HOME");
    if (const auto home = named_folder("HOME"); !folder && home) folder = *home / ".cache";
    if (folder) *folder /= "gamer";
  }
  std::string identity = build_identity();
  if (!folder || identity.empty()) return nullptr;
  return std::make_unique<CalibrationCache>(*folder, std::move(identity));
}

fs::path CalibrationCache::file_of(const std::string& shape) const {
  return folder_ / shape.substr(0, 1) / shape;
}

CalibrationParts CalibrationCache::load(const std::string& shape) const {
  const fs::path file = file_of(shape);
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  if (!bytes.starts_with(identity_)) return {};
  CalibrationParts parts = unpack_parts(std::string_view(bytes).substr(identity_.size()));
  std::error_code error;
  if (!parts.empty()) fs::last_write_time(file, fs::file_time_type::clock::now(), error);
  return parts;
}

void CalibrationCache::save(const std::string& shape, const CalibrationParts& parts) const {
  const fs::path file = file_of(shape);
  std::error_code error;
  if (fs::create_directories(folder_, error)) forget_builds(folder_.parent_path());
  fs::create_directories(file.parent_path(), error);
  fs::last_write_time(folder_, fs::file_time_type::clock::now(), error);
  // The file is not synced to disk. After a crash of the machine its check sum tells whether it is
  // whole.
  const fs::path unfinished = file.string() + fmt::format(".{}", getpid());
  std::ofstream stream(unfinished, std::ios::binary);
  stream << identity_ << pack_parts(parts);
  stream.close();
  if (stream) fs::rename(unfinished, file, error);
  if (!stream || error) fs::remove(unfinished, error);
  forget_oldest(file.parent_path());
}

const CalibrationCache* calibration_cache() { return cache_in_use().get(); }

void use_calibration_cache(std::unique_ptr<const CalibrationCache> cache) {
  cache_in_use() = std::move(cache);
}

}  // namespace gamer
