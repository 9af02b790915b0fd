// The studio: options in, one library call that serves the page, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/manual.h"
#include "gamer/core/version.h"
#include "gamer/studio/studio.h"
#include "gamer/studio/studio_manual.h"
#include "program.h"

namespace {

constexpr int most_threads = 4096, most_port = 65535;

void say(const std::string& text) {
  fmt::print("{}\n", text);
  if (std::fflush(stdout) != 0) throw gamer::RunError("gstudio: cannot print");
}

/// The command line: declares all options, and reads the arguments.
class CommandLine {
 public:
  CommandLine();
  CommandLine& operator=(CommandLine&&) = delete;

  /// Throws InputError.
  void parse(int argc, char** argv);

  const gamer::StudioOptions& options() const { return options_; }
  /// What is printed instead of serving; empty for nothing.
  const std::string& answer() const { return answer_; }

 private:
  gamer::StudioOptions options_;
  std::string answer_, manual_;
  std::vector<std::string> files_;
  bool shows_version_ = false, has_no_browser_ = false, has_no_cache_ = false;
  CLI::App app_{"Designs a galaxy on a page in the browser, and shows it.", "gstudio"};
};

CommandLine::CommandLine() {
  app_.add_option("files", files_,
                  "a galaxy, which is a type or its file; or a parameter file and its scene")
      ->expected(0, 2)
      ->type_name("FILE");
  app_.add_option("--port", options_.port, "port of 127.0.0.1 (default: one that is free)")
      ->check(CLI::Range(1, most_port))
      ->type_name("PORT");
  app_.add_option("--folder", options_.folder,
                  "the only folder that the page writes into, but for the galaxies' own files "
                  "(default: gstudio-output)")
      ->type_name("PATH");
  app_.add_option("--token-file", options_.token_file,
                  "keep the secret of the address in this file, so that an open page comes back "
                  "after a restart on its port")
      ->type_name("PATH");
  app_.add_option("-j,--threads", options_.threads, "threads (default: all cores)")
      ->check(CLI::Range(1, most_threads));
  app_.add_flag("--no-browser", has_no_browser_, "open no browser");
  app_.add_flag("--no-cache", has_no_cache_,
                "measure galaxies anew, without the cache of earlier jobs (GAMER_CACHE)");
  app_.add_flag("--version", shows_version_, "print the version");
  app_.add_option("--print-manual", manual_)->group("");  // man, bash or zsh, for the build
}

void CommandLine::parse(int argc, char** argv) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    answer_ = app_.help();
    return;
  } catch (const CLI::ParseError& error) {
    throw gamer::InputError(
        fmt::format("gstudio: {} (gstudio --help lists the options)", error.what()));
  }
  if (shows_version_) answer_ = fmt::format("gstudio {}\n", gamer::version());
  if (!manual_.empty()) answer_ = gamer::manual_text(gamer::studio_manual(app_), manual_);
  options_.opens_browser = !has_no_browser_;
  // Renders, which are runs of gamer, inherit the variable.
  if (has_no_cache_) setenv("GAMER_CACHE", "off", 1);
  if (files_.size() == 2) {
    options_.parameters = files_[0];
    options_.scene = files_[1];
  } else {
    options_.galaxy = files_.empty() ? "spiral" : files_.front();
  }
}

int run(int argc, char** argv) {
  CommandLine line;
  line.parse(argc, argv);
  if (line.answer().empty()) gamer::run_studio(line.options(), say);
  fmt::print("{}", line.answer());
  if (std::fflush(stdout) != 0) throw gamer::RunError("gstudio: cannot print");
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  return run_program("gstudio", [&] { return run(argc, argv); });
}
