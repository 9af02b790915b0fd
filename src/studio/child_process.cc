#include "studio/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "core/message.h"

namespace gamer {
namespace {

constexpr std::size_t most_line_bytes = 1 << 16;

/// Both ends of a pipe, which children do not inherit.
class Pipe {
 public:
  Pipe() {
    if (pipe2(ends_.data(), O_CLOEXEC) != 0) throw RunError("gstudio: cannot make a pipe");
  }
  ~Pipe() {
    close_writing();
    close(ends_[0]);
  }
  Pipe& operator=(Pipe&&) = delete;

  int reading() const { return ends_[0]; }
  int writing() const { return ends_[1]; }
  void close_writing() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

/// Runs in the child, and calls nothing that another thread may have locked.
[[noreturn]] void become(char* const* arguments, int output, pid_t parent) {
  constexpr int not_started = 127;
  // The child ends with this program.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  const int input = open("/dev/null", O_RDONLY);
  const bool is_ready = getppid() == parent && input >= 0 && dup2(input, STDIN_FILENO) >= 0 &&
                        dup2(output, STDOUT_FILENO) >= 0 && dup2(output, STDERR_FILENO) >= 0 &&
                        close_range(STDERR_FILENO + 1, ~0U, 0) == 0;
  if (is_ready) execvp(arguments[0], arguments);
  _exit(not_started);
}

pid_t start(std::vector<std::string> words, int output) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) become(arguments.data(), output, parent);
  if (child < 0) throw run_error("gstudio: cannot start {}", words.front());
  return child;
}

void read_lines(int file, const std::function<void(const std::string&)>& take) {
  std::array<char, 4096> block{};
  std::string line;
  for (;;) {
    const ssize_t count = read(file, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    for (const char c : std::string_view(block.data(), static_cast<std::size_t>(count))) {
      if (c == '\n') {
        take(line);
        line.clear();
      } else if (line.size() < most_line_bytes) {
        line += c;
      }
    }
  }
  if (!line.empty()) take(line);
}

}  // namespace

ChildEnd run_child(const std::vector<std::string>& words, const std::function<void(pid_t)>& started,
                   const std::function<void(const std::string&)>& take) {
  Pipe pipe;
  const pid_t child = start(words, pipe.writing());
  pipe.close_writing();
  started(child);
  read_lines(pipe.reading(), take);
  siginfo_t info{};
  while (waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
  }
  // Until waitpid() its number belongs to no other process.
  started(0);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) return {0, WTERMSIG(status)};
  return {WEXITSTATUS(status), 0};
}

std::string program_beside(const std::string& name) {
  std::error_code error;
  const auto this_program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto program = this_program.parent_path() / name;
  return !error && std::filesystem::exists(program, error) ? program.string() : name;
}

}  // namespace gamer
