#pragma once

#include <cstdio>
#include <ctime>
#include <functional>
#include <span>
#include <string>

namespace gamer {

/// Numbers of a progress message.
struct ProgressNumbers {
  int done = 0;
  int total = 0;
  std::string unit;  ///< what is counted: "rows"
  double rate = 0;   ///< of the unit, per second
  double left = -1;  ///< seconds; negative where not known
};

/// The messages of a job, for people or for machines.
///
/// In format `text`, results go to `out`, and everything else goes to `err` behind the program's
/// name. In format `json`, every message is an object on a line of `err`. Its keys are `time` (ISO
/// 8601, UTC), `level` (info, warning, error or progress) and `text`. Progress also has `done`,
/// `total`, `unit`, `rate` and `left`, which is null where it is unknown. Both formats escape
/// control characters by printable().
class MessageLog {
 public:
  enum class Format { text, json };
  /// `now` gives seconds since 1970; by default it is the system's clock.
  explicit MessageLog(Format format = Format::text, std::FILE* out = stdout,
                      std::FILE* err = stderr, std::function<std::time_t()> now = {});

  Format format() const { return format_; }
  /// Prints only answers and errors from now on.
  void be_quiet() { is_quiet_ = true; }
  bool is_quiet() const { return is_quiet_; }

  /// Prints a text that the user has asked for.
  void answer(const std::string& text) const;
  /// Prints the line that says which file was made.
  void result(const std::string& text) const;
  void info(const std::string& text) const;
  void warning(const std::string& text) const;
  /// Prints a message that names the program or the place.
  void error(const std::string& text) const;
  /// Prints lines of a table, which begin with the program's name.
  void table(const std::string& lines) const;
  /// Makes signals say "stopped by SIGTERM" and the rest, see clean_up.h.
  void say_when_stopped(const std::string& rest) const;

 private:
  /// Prints one JSON object on a line.
  void print_json(const char* level, const std::string& text) const;

  Format format_;
  std::FILE* out_;
  std::FILE* err_;
  std::function<std::time_t()> now_;
  bool is_quiet_ = false;
};

/// A message or a progress as one JSON object, with a line's end. `time` is in ISO 8601, UTC.
std::string json_message(const std::string& time, const std::string& level,
                         const std::string& text);
std::string json_message(const std::string& time, const std::string& text,
                         const ProgressNumbers& numbers);

/// The format that --log asks for among the program's arguments, even if other arguments are wrong.
MessageLog::Format log_format(std::span<char* const> arguments);

}  // namespace gamer
