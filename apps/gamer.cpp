// The command-line renderer: options in, library calls, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include "gamer/core/error.h"
#include "gamer/core/manual.h"
#include "gamer/core/resources.h"
#include "gamer/core/shell_word.h"
#include "gamer/core/simd.h"
#include "gamer/core/version.h"
#include "gamer/image/clean_up.h"
#include "gamer/job/gamer_manual.h"
#include "gamer/job/listing.h"
#include "gamer/job/message_log.h"
#include "gamer/job/resume.h"
#include "gamer/job/run_job.h"
#include "gamer/job/status.h"
#include "gamer/parallel/ranks.h"

namespace {

using gamer::InputError;

enum ExitCode { done = 0, failed = 1, wrong_input = 2 };

struct Options {
  gamer::RunOptions run;
  bool lists_components = false, lists_galaxies = false, lists_seds = false;
  bool lists_bands = false, lists_instruments = false, lists_noises = false;
  std::string sample_galaxy;
  std::string status;                      ///< a journal to tell about
  std::optional<std::string> listed_kind;  ///< --list-parameters; empty for all
  bool markdown = false;
  bool sample_config = false;
  bool version = false;
  std::string help;  ///< what --help prints; empty when it was not asked for

  /// Whether the program answers without a job.
  bool only_tells() const {
    return !help.empty() || version || lists_components || lists_galaxies || lists_seds ||
           lists_bands || lists_instruments || lists_noises || !sample_galaxy.empty() ||
           !status.empty() || listed_kind || sample_config;
  }
};

constexpr int most_threads = 4096;

std::string resume_command(int argc, char** argv) {
  std::string command = gamer::shell_word(argv[0]) + " --resume";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word != "--resume" && word != "--overwrite") command += " " + gamer::shell_word(word);
  }
  return command;
}

/// Adds the options that are answered without a job; returns that of --list-parameters.
CLI::Option* add_answers(CLI::App& app, std::string& kind, Options& options) {
  app.add_flag("--list-components", options.lists_components, "list the kinds of components");
  app.add_flag("--list-galaxies", options.lists_galaxies, "list the galaxy types");
  app.add_flag("--list-seds", options.lists_seds, "list the spectra");
  app.add_flag("--list-bands", options.lists_bands, "list the bandpasses");
  app.add_flag("--list-instruments", options.lists_instruments, "list the instruments");
  app.add_flag("--list-noises", options.lists_noises, "list the base noises");
  CLI::Option* list_option =
      app.add_option("--list-parameters", kind,
                     "list all parameters, or those of a section or a kind of component")
          ->expected(0, 1)
          ->type_name("[KIND]");
  app.add_flag("--markdown", options.markdown, "with --list-parameters: Markdown tables");
  app.add_flag("--sample-config", options.sample_config, "print a complete parameter file");
  app.add_option("--status", options.status,
                 "tell how far the job of this journal is, also while it runs")
      ->type_name("JOURNAL");
  app.add_flag("--print-config", options.run.print_config, "print the resolved parameters");
  app.add_flag("--print-mapping", options.run.print_mapping,
               "print which columns of the catalogue are used as which of a scene");
  return list_option;
}

/// The commands that need no parameter file. Options of renders follow them, too.
struct Commands {
  gamer::Look look;
  CLI::App* look_command;

  Commands(CLI::App& app, Options& options) {
    look_command = app.add_subcommand("look", "render a picture of one galaxy, NAME.png");
    look_command->add_option("galaxy", look.galaxy, "a type, or its file")
        ->required()
        ->type_name("GALAXY");
    look_command->add_option("--inclination", look.inclination, "deg; 0 is face-on")
        ->capture_default_str();
    look_command->add_option("--pa", look.position_angle, "position angle of the major axis, deg")
        ->capture_default_str();
    CLI::App* new_command =
        app.add_subcommand("new", "print the file of a galaxy type, to begin one's own with");
    new_command->add_option("type", options.sample_galaxy, "see --list-galaxies")
        ->required()
        ->type_name("GALAXY");
    look_command->fallthrough();
    new_command->fallthrough();
    app.require_subcommand(0, 1);
  }
};

/// Throws InputError.
Options parse_options(int argc, char** argv) {
  Options options;
  gamer::JobRequest& request = options.run.request;
  std::string parameters, scene, output, from_header, kind, truth_table;
  std::string log_format;  // main reads it before, for messages about wrong options
  int threads = 0;

  CLI::App app{"Renders a scene of synthetic galaxies to a FITS image or a picture.", "gamer"};
  app.add_option("render.par", parameters, "parameter file (TOML)")->type_name("FILE");
  app.add_option("scene.lst", scene,
                 "scene list or catalogue, one galaxy per row; - is standard input")
      ->type_name("FILE");
  CLI::Option* output_option =
      app.add_option("-o,--output", output,
                     "write to this file instead of image.output; - is standard output")
          ->type_name("FILE");
  app.add_option("-s,--set", request.settings, "override a key: section.key=value (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_flag("--stamps", request.stamps,
               "a FITS file with a stamp of each object alone instead of an image; see [stamps]");
  app.add_option("--region", request.region,
                 "render only this window of the image: x, y of its lower left pixel, counted "
                 "from 1, width and height")
      ->type_name("X,Y,W,H")
      ->delimiter(',')
      ->allow_extra_args(false);
  CLI::Option* threads_option =
      app.add_option("-j,--threads", threads,
                     "threads per process (default: all cores, one under mpirun)")
          ->check(CLI::Range(1, most_threads));
  app.add_flag("--preview", request.preview,
               "a quarter of the size on each side, tolerance 1e-2, no supersampling");
  CLI::Option* list_option = add_answers(app, kind, options);
  app.add_flag("--dry-run", options.run.work.dry_run,
               "read and check everything; say what time and memory the job will take");
  CLI::Option* from_header_option = app.add_option(
      "--from-header", from_header, "make the image of this FITS file or PNG picture again");
  from_header_option->type_name("IMAGE");
  app.add_flag("--truth", options.run.work.truth,
               "also write table TRUTH, what every object is, and the images of [truth]");
  app.add_option("--truth-table", truth_table,
                 "write that table to this file (.fits, .ecsv) instead of into the image's")
      ->type_name("PATH");
  app.add_flag("--overwrite", request.overwrite, "replace an existing output");
  app.add_flag("--resume", options.run.work.resume,
               "go on with a job that was interrupted, from OUTPUT.journal; without one start it, "
               "and leave a complete output as it is");
  app.add_option("--journal", options.run.work.journal_interval,
                 "keep finished rows in OUTPUT.journal once the job is so old, and force them to "
                 "disk as often; inf: never (default: 10)")
      ->type_name("SECONDS");
  CLI::Option* quiet_option =
      app.add_flag("-q,--quiet", options.run.quiet, "say nothing but errors");
  app.add_flag("-v,--verbose", options.run.verbose, "say more, and where the time went")
      ->excludes(quiet_option);
  app.add_option("--log", log_format,
                 "messages as text or, for machines, as JSON: an object a line on standard error")
      ->check(CLI::IsMember({"text", "json"}))
      ->default_str("text");
  app.add_flag("--version", options.version, "print versions");

  const Commands commands(app, options);
  std::string manual;
  app.add_option("--print-manual", manual)->group("");  // man, bash or zsh, for the build

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    options.help = app.help();
    return options;
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("gamer: {} (gamer --help lists the options)", error.what()));
  }
  if (!manual.empty()) {
    options.help = gamer::manual_text(gamer::gamer_manual(app), manual);
    return options;
  }
  request.parameters = parameters;
  request.scene = scene;
  if (output_option->count() > 0) request.output = output;
  if (threads_option->count() > 0) options.run.threads = threads;
  if (list_option->count() > 0) options.listed_kind = kind;
  if (from_header_option->count() > 0) request.from_header = from_header;

  if (!(options.run.work.journal_interval >= 0)) {
    throw InputError("gamer: --journal: the seconds must be 0 or more, or inf");
  }
  options.run.work.overwrite = request.overwrite;
  options.run.work.resume_command = resume_command(argc, argv);
  if (!truth_table.empty()) {
    options.run.work.truth = true;
    options.run.work.truth_table = truth_table;
  }
  if (options.run.work.resume && options.run.work.overwrite) {
    throw InputError(
        "gamer: --resume goes on with what is there, --overwrite starts anew; give one of them");
  }
  if (options.markdown && !options.listed_kind) {
    throw InputError("gamer: --markdown goes with --list-parameters");
  }
  if (options.only_tells()) return options;
  if (commands.look_command->parsed()) {
    if (!parameters.empty() || !request.from_header.empty()) {
      throw InputError("gamer: look takes one galaxy, no parameter file and no --from-header");
    }
    request.look = commands.look;
  } else if (!request.from_header.empty()) {
    if (!parameters.empty()) {
      throw InputError("gamer: --from-header takes no parameter file and no scene list");
    }
  } else if (parameters.empty() || (scene.empty() && !options.run.print_config)) {
    throw InputError(
        "gamer: needs a parameter file and a scene list: gamer [options] render.par scene.lst "
        "(gamer --help lists the options)");
  }
  return options;
}

std::string version_text() {
  const std::string mpi = gamer::Ranks::library_version();
  return fmt::format("gamer {}\nSIMD: {}\nMPI: {}\n", gamer::version(),
                     gamer::simd_target_name(gamer::current_simd_target()),
                     mpi.empty() ? "none" : mpi);
}

/// Answers that need no job.
void tell(const Options& options) {
  if (!options.help.empty()) fmt::print("{}", options.help);
  if (options.version) fmt::print("{}", version_text());
  if (options.lists_components) fmt::print("{}", gamer::list_components());
  gamer::Resources data(gamer::default_data_folders());
  if (options.lists_galaxies) fmt::print("{}", gamer::list_galaxies(data));
  if (options.lists_seds) fmt::print("{}", gamer::list_seds(data));
  if (options.lists_bands) fmt::print("{}", gamer::list_bands(data));
  if (options.lists_instruments) fmt::print("{}", gamer::list_instruments(data));
  if (options.lists_noises) fmt::print("{}", gamer::list_noises());
  if (!options.sample_galaxy.empty()) {
    fmt::print("{}", gamer::sample_galaxy(options.sample_galaxy, data));
  }
  if (!options.status.empty()) fmt::print("{}", gamer::status_text(options.status));
  if (options.listed_kind) {
    fmt::print("{}", gamer::list_parameters(*options.listed_kind, options.markdown));
  }
  if (options.sample_config) fmt::print("{}", gamer::sample_parameters());
}

/// Every rank's part of the run.
void run(const gamer::Ranks& ranks, int argc, char** argv, gamer::MessageLog& log) {
  gamer::check_same_program(ranks);
  const Options options = parse_options(argc, argv);
  if (options.only_tells()) {
    if (ranks.rank() == 0) tell(options);
    return;
  }
  gamer::run_job(ranks, options.run, log);
}

/// The one place where errors are reported.
int run_and_report(gamer::Ranks& ranks, int argc, char** argv, gamer::MessageLog& log) {
  const auto report = [&](const std::string& message) { log.error(message); };
  const auto end = [&](int code, const std::string& message) {
    // Launchers end the other ranks when one of them ends with an error, which is told by now.
    gamer::say_nothing_when_stopped();
    return ranks.end(code, message, report);
  };
  try {
    run(ranks, argc, argv, log);
    if (std::fflush(stdout) != 0) throw gamer::RunError("gamer: cannot print");
    return end(done, {});
  } catch (const gamer::Stopped& stopped) {
    return end(stopped.code, {});
  } catch (const InputError& error) {
    return end(wrong_input, error.what());
  } catch (const gamer::RunError& error) {
    return end(failed, error.what());
  } catch (const std::bad_alloc&) {
    return end(failed, "gamer: out of memory");
  } catch (const std::exception& error) {
    return end(failed, fmt::format("gamer: {}", error.what()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  gamer::open_standard_streams();
  gamer::clean_up_on_signals();
  gamer::MessageLog log(gamer::log_format({argv, argv + argc}));
  try {
    gamer::Ranks ranks(&argc, &argv);
    if (ranks.rank() == 0) log.say_when_stopped("");
    return run_and_report(ranks, argc, argv, log);
  } catch (const std::exception& error) {
    log.error(fmt::format("gamer: {}", error.what()));
    return failed;
  }
}
