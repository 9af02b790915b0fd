#include "gamer/job/message_log.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "gamer/core/printable.h"
#include "gamer/core/utc_time.h"
#include "gamer/image/clean_up.h"

namespace gamer {
namespace {

constexpr std::string_view program = "gamer: ";
/// The text of a JSON object before the time.
constexpr std::string_view object_start = R"({"time":")";

/// A JSON object without its closing brace.
std::string object_of(const std::string& time, const std::string& level, const std::string& text) {
  return fmt::format(R"({}{}","level":"{}","text":{})", object_start, time, level,
                     json_string(printable(text)));
}

void print(std::FILE* stream, const std::string& line) {
  std::fwrite(line.data(), 1, line.size(), stream);
}

}  // namespace

MessageLog::MessageLog(Format format, std::FILE* out, std::FILE* err,
                       std::function<std::time_t()> now)
    : format_(format), out_(out), err_(err), now_(std::move(now)) {
  if (!now_) now_ = [] { return std::time(nullptr); };
}

void MessageLog::print_json(const char* level, const std::string& text) const {
  print(err_, json_message(utc_time_text(now_()), level, text));
  std::fflush(err_);
}

void MessageLog::answer(const std::string& text) const {
  if (format_ == Format::json) return print_json("info", text);
  print(out_, printable(text) + "\n");
}

void MessageLog::result(const std::string& text) const {
  if (!is_quiet_) answer(text);
}

void MessageLog::info(const std::string& text) const {
  if (is_quiet_) return;
  if (format_ == Format::json) return print_json("info", text);
  print(err_, fmt::format("{}{}\n", program, printable(text)));
}

void MessageLog::warning(const std::string& text) const {
  if (is_quiet_) return;
  if (format_ == Format::json) return print_json("warning", text);
  print(err_, fmt::format("{}warning: {}\n", program, printable(text)));
}

void MessageLog::error(const std::string& text) const {
  if (format_ == Format::json) return print_json("error", text);
  print(err_, printable(text) + "\n");
}

void MessageLog::table(const std::string& lines) const {
  if (format_ == Format::text) return print(err_, lines);
  std::string_view rest = lines;
  while (!rest.empty()) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    if (line.starts_with(program)) line.remove_prefix(program.size());
    print_json("info", std::string(line));
  }
}

void MessageLog::say_when_stopped(const std::string& rest) const {
  const bool is_json = format_ == Format::json;
  // The cursor may be behind a progress bar.
  const std::string line_start = isatty(fileno(err_)) != 0 ? "\r\x1b[K" : "";
  gamer::say_when_stopped([&](const std::string& signal) {
    const std::string text = fmt::format("{}stopped by {}{}", program, signal, rest);
    if (!is_json) return StopLine{line_start + printable(text) + "\n"};
    return StopLine{json_message(utc_time_text(0), "error", text), object_start.size()};
  });
}

std::string json_message(const std::string& time, const std::string& level,
                         const std::string& text) {
  return object_of(time, level, text) + "}\n";
}

std::string json_message(const std::string& time, const std::string& text,
                         const ProgressNumbers& numbers) {
  const std::string left = numbers.left < 0 ? "null" : fmt::format("{:.1f}", numbers.left);
  return fmt::format(R"({},"done":{},"total":{},"unit":{},"rate":{:.6g},"left":{}}})"
                     "\n",
                     object_of(time, "progress", text), numbers.done, numbers.total,
                     json_string(printable(numbers.unit)), numbers.rate, left);
}

MessageLog::Format log_format(std::span<char* const> arguments) {
  MessageLog::Format format = MessageLog::Format::text;
  std::string_view before;
  for (const std::string_view word : arguments) {
    const std::string_view value = before == "--log"            ? word
                                   : word.starts_with("--log=") ? word.substr(6)
                                                                : "";
    if (!value.empty())
      format = value == "json" ? MessageLog::Format::json : MessageLog::Format::text;
    before = word;
  }
  return format;
}

}  // namespace gamer
