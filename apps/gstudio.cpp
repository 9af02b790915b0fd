// The studio: options in, one library call that serves the page, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/printable.h"
#include "gamer/core/version.h"
#include "gamer/image/clean_up.h"
#include "gamer/studio/studio.h"

namespace {

enum ExitCode { done = 0, failed = 1, wrong_input = 2 };

constexpr int most_threads = 4096, most_port = 65535;

void say(const std::string& text) {
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  CLI::App app("Designs a galaxy in the browser, and shows it.", "gstudio");
  gamer::StudioOptions options;
  std::vector<std::string> files;
  std::string folder = options.folder.string();
  bool shows_version = false, has_no_browser = false;
  app.add_option("files", files, "render.par scene.lst, or a galaxy: a type or its file")
      ->expected(0, 2)
      ->type_name("FILE");
  app.add_option("--port", options.port, "port of 127.0.0.1; by default one that is free")
      ->check(CLI::Range(0, most_port))
      ->type_name("PORT");
  app.add_option("--folder", folder, "the folder that the page writes into")
      ->type_name("FOLDER")
      ->capture_default_str();
  app.add_option("-j,--threads", options.threads, "threads (default: all cores)")
      ->check(CLI::Range(1, most_threads));
  app.add_flag("--no-browser", has_no_browser, "print the address alone");
  app.add_flag("--version", shows_version, "print the version");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    fmt::print("{}", app.help());
    return done;
  } catch (const CLI::ParseError& error) {
    throw gamer::InputError(
        fmt::format("gstudio: {} (gstudio --help lists the options)", error.what()));
  }
  if (shows_version) {
    fmt::print("gstudio {}\n", gamer::version());
    return done;
  }
  options.folder = folder;
  options.opens_browser = !has_no_browser;
  if (files.size() == 2) {
    options.parameters = files[0];
    options.scene = files[1];
  } else {
    options.galaxy = files.empty() ? "spiral" : files.front();
  }
  gamer::run_studio(options, say);
  return done;
}

}  // namespace

/// The one place where errors are reported.
int main(int argc, char** argv) {
  const auto report = [](const std::string& message) {
    fmt::print(stderr, "{}\n", gamer::printable(message));
  };
  gamer::open_standard_streams();
  gamer::clean_up_on_signals();
  try {
    return run(argc, argv);
  } catch (const gamer::InputError& error) {
    report(error.what());
    return wrong_input;
  } catch (const gamer::RunError& error) {
    report(error.what());
  } catch (const std::bad_alloc&) {
    report("gstudio: out of memory");
  } catch (const std::exception& error) {
    report(fmt::format("gstudio: {}", error.what()));
  }
  return failed;
}
