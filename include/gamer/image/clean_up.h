#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace gamer {

/// Opens /dev/null for each closed standard stream. Otherwise a file that the program opens would
/// get the stream's number and its messages. main() calls it first.
void open_standard_streams();

/// Prepares the process for signals and full disks. From now on SIGINT, SIGTERM and SIGHUP remove
/// unfinished files, then end the process as the signal does (shells see 128 + its number). Writing
/// into a closed pipe or beyond the limit of a file's size becomes an ordinary error. main() calls
/// it.
void clean_up_on_signals();

/// The lines that a signal prints, with their ends.
struct StopLine {
  std::string text;
  /// Place in the text of a UtcTime that the time of the signal replaces; npos for none.
  std::size_t time_at = std::string::npos;
};

/// Makes these signals also print a line on standard error. The call makes all lines at once, as
/// `line(name of the signal)`. Without it signals print nothing.
void say_when_stopped(const std::function<StopLine(const std::string& signal)>& line);
void say_nothing_when_stopped();

}  // namespace gamer
