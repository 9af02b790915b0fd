#include "image/standard_stream.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "core/message.h"
#include "gamer/image/clean_up.h"

namespace gamer {

void open_standard_streams() {
  // open() returns the lowest free number.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) < 0 && open("/dev/null", O_RDWR) != stream) return;
  }
}

void check_standard_output() {
  if (isatty(STDOUT_FILENO) == 0) return;
  throw InputError("standard output is a terminal; send it to a file or another program");
}

void copy_bytes(std::FILE* from, std::FILE* to, const std::string& what) {
  constexpr std::size_t block_size = std::size_t{1} << 20;
  std::vector<char> block(block_size);
  std::size_t count = 0;
  while ((count = std::fread(block.data(), 1, block.size(), from)) > 0) {
    if (std::fwrite(block.data(), 1, count, to) != count) {
      throw run_error("{}: cannot write: {}", what, std::strerror(errno));
    }
  }
  if (std::ferror(from) != 0) throw run_error("{}: cannot read: {}", what, std::strerror(errno));
  if (std::fflush(to) != 0) throw run_error("{}: cannot write: {}", what, std::strerror(errno));
}

}  // namespace gamer
