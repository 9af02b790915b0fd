#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

namespace gamer {

/// How a child process ended.
struct ChildEnd {
  int code = 0;    ///< its exit code
  int signal = 0;  ///< the signal that ended it, or 0
};

/// Runs a program with nothing on its standard input and calls `take` with each line of its output
/// and errors. `started` is called with its process number at the beginning, and with 0 once it has
/// ended. The child inherits no files and ends with this program. Its exit code is 127 where it
/// cannot be started. Throws RunError.
ChildEnd run_child(const std::vector<std::string>& words, const std::function<void(pid_t)>& started,
                   const std::function<void(const std::string&)>& take);

/// The path of a program that is installed beside this one, or its name for the search path.
std::string program_beside(const std::string& name);

}  // namespace gamer
