#include "gamer/job/resume.h"

#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <utility>

#include "core/message.h"
#include "gamer/core/simd.h"
#include "gamer/core/version.h"
#include "gamer/image/fits/fits.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

constexpr std::size_t longest_quote = 60;

std::string quote(std::string_view line) {
  if (line.size() <= longest_quote) return std::string(line);
  return fmt::format("{}...", line.substr(0, longest_quote));
}

/// Takes the next line off a text.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

std::string text_difference(const std::string& name, std::string_view then, std::string_view now) {
  for (int line = 1;; ++line) {
    const std::string_view old_line = next_line(then), new_line = next_line(now);
    if (old_line != new_line || (then.empty() && now.empty())) {
      return fmt::format("{} has changed (line {}: '{}' then, '{}' now)", name, line,
                         quote(old_line), quote(new_line));
    }
  }
}

/// Keys of the resolved parameters with their values, as TOML writes them.
std::map<std::string, std::string> parameter_values(const std::string& toml) {
  const RenderParameters parameters = RenderParameters::read(parse_toml(toml, ""));
  std::map<std::string, std::string> values;
  for (const ParameterSection& section : render_parameter_sections()) {
    const ParameterSet& set = parameters.section(section.name);
    for (const Parameter& parameter : section.table) {
      if (!set.has(parameter.name) || !parameters.applies(section.name, parameter.name)) continue;
      values[fmt::format("{}.{}", section.name, parameter.name)] =
          value_text(set.value(parameter.name));
    }
  }
  return values;
}

/// Calls take(key, then, now) for each key whose values differ or that only one map has. A missing
/// value is null.
template <class Value, class Take>
void for_differences(const std::map<std::string, Value>& then,
                     const std::map<std::string, Value>& now, const Take& take) {
  std::map<std::string, std::pair<const Value*, const Value*>> both;
  for (const auto& [key, value] : then) both[key].first = &value;
  for (const auto& [key, value] : now) both[key].second = &value;
  for (const auto& [key, values] : both) {
    const auto [old_value, new_value] = values;
    if (old_value == nullptr || new_value == nullptr || *old_value != *new_value) {
      take(key, old_value, new_value);
    }
  }
}

std::vector<std::string> record_differences(const Record& then, const Record& now) {
  const auto texts = [](const Record& record) {
    std::map<std::string, std::string> map;
    for (const Resources::Text& text : record) map[text.name] = text.content;
    return map;
  };
  std::vector<std::string> differences;
  const auto value_or_none = [](const std::string* value) { return value ? *value : "not given"; };
  for_differences(
      texts(then), texts(now),
      [&](const std::string& name, const std::string* old_text, const std::string* new_text) {
        if (old_text == nullptr) {
          differences.push_back(fmt::format("{} is new", name));
        } else if (new_text == nullptr) {
          differences.push_back(fmt::format("{} is gone", name));
        } else if (name == recorded_parameters) {
          for_differences(
              parameter_values(*old_text), parameter_values(*new_text),
              [&](const std::string& key, const std::string* old_value,
                  const std::string* new_value) {
                differences.push_back(fmt::format("{} was {}, is {}", key, value_or_none(old_value),
                                                  value_or_none(new_value)));
              });
        } else {
          differences.push_back(text_difference(name, *old_text, *new_text));
        }
      });
  return differences;
}

void fail_where_different(const std::vector<std::string>& differences, const std::string& label) {
  if (differences.empty()) return;
  throw input_error("{}: the job has changed since it began: {}; --overwrite starts anew", label,
                    fmt::join(differences, "; "));
}

/// A checksum that distinguishes builds of one version; empty where the program cannot read its own
/// file.
std::string build_text() {
  std::ifstream program("/proc/self/exe", std::ios::binary);
  std::vector<char> bytes(std::size_t{1} << 16);
  uLong sum = 0;
  bool is_read = false;
  while (program.read(bytes.data(), static_cast<std::streamsize>(bytes.size())),
         program.gcount() > 0) {
    is_read = true;
    sum = crc32(sum, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uInt>(program.gcount()));
  }
  return is_read ? fmt::format(", build {:08x}", sum) : "";
}

}  // namespace

std::filesystem::path journal_path(const OutputOptions& output) {
  return output.path.string() + ".journal";
}

std::string program_text() { return fmt::format("gamer {}{}", version(), build_text()); }

void check_same_program(const Ranks& ranks) {
  if (ranks.size() == 1) return;
  const std::vector<std::string> programs = ranks.gather(program_text());
  for (std::size_t rank = 1; rank < programs.size(); ++rank) {
    if (programs[rank] == programs.front()) continue;
    throw input_error("gamer: rank {} is {}, rank 0 is {}; all ranks must be the same build", rank,
                      programs[rank], programs.front());
  }
}

JournalHead make_journal_head(const RenderJob& job, std::string truth) {
  return {program_text(),   simd_target_name(current_simd_target()), fits_date(),
          std::move(truth), job.parameters.image.output.overwrite,   job.record};
}

void check_same_job(const JournalHead& then, const JournalHead& now, const std::string& label) {
  if (then.program != now.program) {
    throw input_error(
        "{}: begun by {}, this is {}; finish the job with that program; --overwrite starts anew",
        label, then.program, now.program);
  }
  std::vector<std::string> differences = record_differences(then.record, now.record);
  if (then.truth != now.truth) {
    const auto text = [](const std::string& truth) {
      return truth.empty() ? "not asked for" : truth;
    };
    differences.push_back(fmt::format("--truth was {}, is {}", text(then.truth), text(now.truth)));
  }
  fail_where_different(differences, label);
}

void check_same_job(const std::filesystem::path& image, const Record& now) {
  if (keeps_record(image)) check_same_job(image, read_record(image), now);
}

void check_same_job(const std::filesystem::path& image, const Record& then, const Record& now) {
  fail_where_different(record_differences(then, now), image.string());
}

std::int64_t journal_simd_targets(const Journal& journal) {
  for (const std::int64_t target : simd_targets()) {
    if (simd_target_name(target) == journal.head().simd) return target;
  }
  throw input_error({journal.path().string(), 0, 0},
                    "its rows were made with {} instructions, which this machine has not; their "
                    "last digits would differ",
                    journal.head().simd);
}

bool is_single_precision(const OutputOptions& output) {
  const std::optional<ImageSuffix> suffix = image_suffix(output.path);
  const bool is_fits = suffix == ImageSuffix::fits || suffix == ImageSuffix::fits_compressed;
  return is_fits && output.bitpix == -32;
}

std::vector<RowRange> unfinished_blocks(std::span<const RowRange> blocks,
                                        std::span<const RowRange> finished) {
  std::vector<RowRange> result;
  for (const RowRange& block : blocks) {
    int first = block.first;
    auto next = std::ranges::upper_bound(finished, first, {}, &RowRange::last);
    for (; next != finished.end() && next->first < block.last; ++next) {
      if (first < next->first) result.push_back({first, next->first});
      first = next->last;
    }
    if (first < block.last) result.push_back({first, block.last});
  }
  return result;
}

JournaledExecutor::JournaledExecutor(Executor& executor, Journal* journal)
    : executor_(executor), journal_(journal) {}

void JournaledExecutor::run(std::span<const RowRange> blocks, std::size_t values_per_row,
                            const Compute& compute, const Consume& consume) {
  if (journal_ == nullptr) {
    executor_.run(blocks, values_per_row, compute, consume);
    return;
  }
  const int section = section_++;
  const std::vector<RowRange> finished = journal_->finished(section);
  std::vector<RowRange> all(blocks.begin(), blocks.end());
  std::ranges::sort(all, {}, &RowRange::first);
  if (!unfinished_blocks(finished, all).empty()) {
    throw InputError({journal_->path().string(), 0, 0},
                     "holds rows that the job has not; --overwrite starts anew");
  }
  replaying_ = true;
  journal_->replay(section, values_per_row, consume);
  replaying_ = false;
  executor_.run(unfinished_blocks(blocks, finished), values_per_row, compute,
                [&](RowRange rows, std::span<const double> values) {
                  // The journal comes first, so that a row that cannot be written is not lost.
                  journal_->add_rows(section, rows, values, single_);
                  consume(rows, values);
                });
}

}  // namespace gamer
