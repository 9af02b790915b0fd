// Operations on FITS images: options in, one library call, exit code out.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/manual.h"
#include "gamer/core/version.h"
#include "gamer/parallel/executor.h"
#include "gamer/processing/gutil_manual.h"
#include "gamer/processing/operation.h"
#include "program.h"

namespace {

bool asks_for(const std::vector<std::string>& arguments, const std::string& option) {
  return std::ranges::find(arguments, option) != arguments.end();
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    throw gamer::InputError(
        "gutil: needs an operation: gutil <operation> [options] in.fits ... out.fits (gutil --help "
        "lists them)");
  }
  const std::string& first = arguments.front();
  if (first == "--help" || first == "-h") {
    fmt::print("{}", asks_for(arguments, "--markdown") ? gamer::operations_markdown()
                                                       : gamer::operations_help());
    return done;
  }
  if (first == "--version") {
    fmt::print("gutil {}\n", gamer::version());
    return done;
  }
  // The build asks for man, bash or zsh.
  if (first == "--print-manual" && arguments.size() == 2) {
    fmt::print("{}", gamer::manual_text(gamer::gutil_manual(), arguments.back()));
    return done;
  }
  const gamer::Operation& operation = gamer::find_operation(first);
  const std::vector<std::string> rest(arguments.begin() + 1, arguments.end());
  if (asks_for(rest, "--help") || asks_for(rest, "-h")) {
    fmt::print("{}", gamer::operation_help(operation));
    return done;
  }
  gamer::OperationCall call = gamer::parse_call(operation, rest);
  if (call.threads == 0) call.threads = gamer::available_cores();
  call.print = [](const std::string& text) {
    if (std::fputs(text.c_str(), stdout) < 0) throw gamer::RunError("gutil: cannot print");
  };
  const int answer = operation.run(call);
  if (std::fflush(stdout) != 0) throw gamer::RunError("gutil: cannot print");
  return answer;
}

}  // namespace

int main(int argc, char** argv) {
  return run_program("gutil", [&] { return run({argv + 1, argv + argc}); });
}
