#include "gamer/studio/studio_manual.h"

#include <CLI/CLI.hpp>

#include "gamer/core/version.h"
#include "job/cli_options.h"

namespace gamer {
namespace {

constexpr const char* description =
    "gstudio serves a page on which a galaxy is designed: its components in a list, their "
    "parameters beside a picture that follows. It prints the address, and opens it in a browser "
    "where there is a display. The address holds a secret; whoever knows it may use the page.\n\n"
    "Without a file it begins with the galaxy `spiral`. Galaxies are saved over their own files, "
    "or into a folder, together with images that `gamer` renders.\n\n"
    "On a cluster, a tunnel leads to the page:\n\n"
    "    gstudio --no-browser --port 8765 mine.toml\n"
    "    ssh -L 8765:127.0.0.1:8765 cluster";

}  // namespace

Manual studio_manual(const CLI::App& app) {
  Manual manual;
  manual.program = app.get_name();
  manual.version = version();
  manual.summary = "design a galaxy and see it";
  manual.synopses = {"[options] [galaxy]", "[options] render.par scene.lst"};
  manual.description = description;
  add_cli_options(app, manual.options, manual.arguments);
  manual.sections = {
      {"EXIT STATUS",
       "1 is failed while running, and 2 wrong input. It serves until a signal ends it; shells "
       "then see 128 and its number."},
      {"ENVIRONMENT",
       "`GAMER_DATA` is a folder with galaxies/, seds/, bandpasses/ and instruments/. "
       "`GAMER_CACHE` is the folder that keeps measurements of galaxies between jobs, or `off`."},
      {"EXAMPLES",
       "    gstudio\n    gstudio mine.toml\n    gstudio render.par scene.lst --folder pictures"},
      {"SEE ALSO", "`gamer`(1), `gutil`(1)"}};
  return manual;
}

}  // namespace gamer
