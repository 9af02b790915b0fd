// The command-line renderer: options in, library calls, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include "gamer/core/config.h"
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
#include "gamer/scene/background.h"
#include "gamer/scene/camera.h"
#include "program.h"

namespace {

using gamer::InputError;

struct Options {
  gamer::RunOptions run;
  bool lists_components = false, lists_galaxies = false, lists_seds = false;
  bool lists_bands = false, lists_instruments = false, lists_noises = false;
  std::string sample_galaxy;
  std::optional<gamer::Background> background;  ///< a list to print
  std::string status;                           ///< a journal to describe
  std::optional<std::string> listed_kind;       ///< --list-parameters; empty for all
  bool markdown = false;
  bool sample_config = false;
  bool version = false;
  std::string help;  ///< what --help prints; empty when it was not asked for

  /// Whether the program answers without a job.
  bool only_tells() const {
    return !help.empty() || version || lists_components || lists_galaxies || lists_seds ||
           lists_bands || lists_instruments || lists_noises || !sample_galaxy.empty() ||
           !status.empty() || listed_kind || sample_config || background;
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

/// The command line: declares all options, and reads the arguments.
class CommandLine {
 public:
  CommandLine();
  CommandLine& operator=(CommandLine&&) = delete;

  /// Throws InputError.
  Options parse(int argc, char** argv);

 private:
  void add_files();
  void add_view();
  void add_answers();
  void add_run();
  void add_messages();
  void add_commands();
  void add_background();
  /// Checks that options fit together. Throws InputError.
  void check_run() const;
  /// Checks what is to be rendered and stores it. Throws InputError.
  void take_job();

  Options options_;
  gamer::Look look_;
  gamer::Background background_;
  std::string parameters_, scene_, output_, from_header_, listed_kind_, truth_table_, manual_;
  std::string log_format_;  // main reads it first, for messages about wrong options
  int threads_ = 0;
  CLI::App app_{"Renders a scene of synthetic galaxies to a FITS image or a picture.", "gamer"};
  CLI::App* look_command_ = nullptr;
  CLI::App* background_command_ = nullptr;
};

CommandLine::CommandLine() {
  add_files();
  add_view();
  add_answers();
  add_run();
  add_messages();
  add_commands();
  app_.add_option("--print-manual", manual_)->group("");  // man, bash or zsh, for the build
}

void CommandLine::add_files() {
  gamer::JobRequest& request = options_.run.request;
  app_.add_option("render.par", parameters_, "parameter file (TOML)")->type_name("FILE");
  app_.add_option("scene.lst", scene_,
                  "scene list or catalogue, one galaxy per row; - is standard input")
      ->type_name("FILE");
  app_.add_option("-o,--output", output_,
                  "write to this file instead of image.output; - is standard output")
      ->type_name("FILE");
  app_.add_option("-s,--set", request.settings, "override a key: section.key=value (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

void CommandLine::add_view() {
  gamer::JobRequest& request = options_.run.request;
  app_.add_flag("--stamps", request.stamps,
                "a FITS file with a stamp of each object alone instead of an image; see [stamps]");
  app_.add_option("--region", request.region,
                  "render only this window of the image: x, y of its lower left pixel, counted "
                  "from 1, width and height")
      ->type_name("X,Y,W,H")
      ->delimiter(',')
      ->allow_extra_args(false);
  app_.add_option("-j,--threads", threads_,
                  "threads per process (default: all cores, one under mpirun)")
      ->check(CLI::Range(1, most_threads));
  app_.add_option_function<std::string>(
          "--solo",
          [&request](const std::string& name) {
            request.settings.push_back("scene.solo=" + gamer::toml_string(name));
          },
          "show one component of the galaxies alone, with its share of the whole light")
      ->type_name("COMPONENT");
  app_.add_flag("--preview", request.preview,
                "a quarter of the size on each side, tolerance 1e-2, no supersampling");
}

/// Adds the options that are answered without a job.
void CommandLine::add_answers() {
  app_.add_flag("--list-components", options_.lists_components, "list the kinds of components");
  app_.add_flag("--list-galaxies", options_.lists_galaxies, "list the galaxy types");
  app_.add_flag("--list-seds", options_.lists_seds, "list the spectra");
  app_.add_flag("--list-bands", options_.lists_bands, "list the bandpasses");
  app_.add_flag("--list-instruments", options_.lists_instruments, "list the instruments");
  app_.add_flag("--list-noises", options_.lists_noises, "list the base noises");
  app_.add_option("--list-parameters", listed_kind_,
                  "list all parameters, or those of a section or a kind of component")
      ->expected(0, 1)
      ->type_name("[KIND]");
  app_.add_flag("--markdown", options_.markdown, "with --list-parameters: Markdown tables");
  app_.add_flag("--sample-config", options_.sample_config, "print a complete parameter file");
  app_.add_option("--status", options_.status,
                  "tell how far the job of this journal is, also while it runs")
      ->type_name("JOURNAL");
  app_.add_flag("--print-config", options_.run.print_config, "print the resolved parameters");
  app_.add_flag("--print-mapping", options_.run.print_mapping,
                "print which columns of the catalogue are used as which of a scene");
}

void CommandLine::add_run() {
  gamer::JobRequest& request = options_.run.request;
  app_.add_flag("--dry-run", options_.run.work.dry_run,
                "read and check everything; say what time and memory the job will take");
  app_.add_option("--from-header", from_header_,
                  "make the image of this FITS file or PNG picture again")
      ->type_name("IMAGE");
  app_.add_flag("--truth", options_.run.work.truth,
                "also write table TRUTH, what every object is, and the images of [truth]");
  app_.add_option("--truth-table", truth_table_,
                  "write that table to this file (.fits, .ecsv) instead of into the image's")
      ->type_name("PATH");
  app_.add_flag("--overwrite", request.overwrite, "replace an existing output");
  app_.add_flag("!--no-cache", options_.run.cache,
                "measure galaxies anew, without the cache of earlier jobs (GAMER_CACHE)");
  app_.add_flag("--resume", options_.run.work.resume,
                "go on with a job that was interrupted, from OUTPUT.journal; without one start it, "
                "and leave a complete output as it is");
  app_.add_option("--journal", options_.run.work.journal_interval,
                  "keep finished rows in OUTPUT.journal once the job is so old, and force them to "
                  "disk as often; inf: never (default: 10)")
      ->type_name("SECONDS");
}

void CommandLine::add_messages() {
  CLI::Option* quiet_option =
      app_.add_flag("-q,--quiet", options_.run.quiet, "say nothing but errors");
  app_.add_flag("-v,--verbose", options_.run.verbose, "say more, and where the time went")
      ->excludes(quiet_option);
  app_.add_option("--log", log_format_,
                  "messages as text or, for machines, as JSON: an object a line on standard error")
      ->check(CLI::IsMember({"text", "json"}))
      ->default_str("text");
  app_.add_flag("--version", options_.version, "print versions");
}

/// Adds the commands that need no parameter file. Options of renders may follow them, too.
void CommandLine::add_commands() {
  look_command_ = app_.add_subcommand("look", "render a picture of one galaxy, NAME.png");
  look_command_->add_option("galaxy", look_.galaxy, "a type, or its file")
      ->required()
      ->type_name("GALAXY");
  look_command_->add_option("--inclination", look_.inclination, "deg; 0 is face-on")
      ->capture_default_str();
  look_command_->add_option("--pa", look_.position_angle, "position angle of the major axis, deg")
      ->capture_default_str();
  look_command_->add_flag("--sky", look_.has_sky,
                          "among stars and faint galaxies, as a telescope sees it");
  CLI::App* new_command =
      app_.add_subcommand("new", "print the file of a galaxy type, to begin one's own with");
  new_command->add_option("type", options_.sample_galaxy, "see --list-galaxies")
      ->required()
      ->type_name("GALAXY");
  look_command_->footer("Options of a render follow, too, such as -o, -s, -j and --overwrite.");
  look_command_->fallthrough();
  new_command->fallthrough();
  add_background();
  app_.require_subcommand(0, 1);
}

void CommandLine::add_background() {
  using gamer::Background;
  CLI::App* command = background_command_ = app_.add_subcommand(
      "background", "print a scene list of faint galaxies and stars that fill a view of the sky");
  command->add_option("render.par", parameters_, "parameter file of the view")
      ->required()
      ->type_name("FILE");
  const CLI::Range magnitudes(Background::least_magnitude, Background::most_magnitude);
  command
      ->add_option("--brightest", background_.brightest, "AB magnitude i of the brightest galaxies")
      ->check(magnitudes)
      ->capture_default_str();
  command->add_option("--faintest", background_.faintest, "AB magnitude i of the faintest galaxies")
      ->check(magnitudes)
      ->capture_default_str();
  command
      ->add_option("--stars", background_.star_number,
                   "stars of magnitude 14 to 22 in a square arcminute")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--seed", background_.seed, "another number gives another sky")
      ->capture_default_str();
  command->fallthrough();
}

Options CommandLine::parse(int argc, char** argv) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    options_.help = app_.help();
    return options_;
  } catch (const CLI::ParseError& error) {
    const std::vector<CLI::App*> commands = app_.get_subcommands();
    if (!commands.empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
      if (commands.front() == background_command_) {
        throw InputError("gamer: background needs the parameter file of a view of the sky");
      }
      throw InputError(
          fmt::format("gamer: {0} needs a galaxy: gamer {0} m51 (gamer --list-galaxies lists them)",
                      commands.front()->get_name()));
    }
    throw InputError(fmt::format("gamer: {} (gamer --help lists the options)", error.what()));
  }
  if (!manual_.empty()) {
    options_.help = gamer::manual_text(gamer::gamer_manual(app_), manual_);
    return options_;
  }
  gamer::RunOptions& run = options_.run;
  run.request.parameters = parameters_;
  run.request.scene = scene_;
  run.request.from_header = from_header_;
  if (app_.count("--output") > 0) run.request.output = output_;
  if (app_.count("--threads") > 0) run.threads = threads_;
  if (app_.count("--list-parameters") > 0) options_.listed_kind = listed_kind_;
  run.work.overwrite = run.request.overwrite;
  run.work.resume_command = resume_command(argc, argv);
  if (!truth_table_.empty()) {
    run.work.truth = true;
    run.work.truth_table = truth_table_;
  }
  if (background_command_->parsed()) {
    if (!(background_.brightest < background_.faintest)) {
      throw InputError("gamer: background: --brightest must be below --faintest");
    }
    options_.background = background_;
  }
  check_run();
  if (!options_.only_tells()) take_job();
  return options_;
}

void CommandLine::check_run() const {
  const gamer::JobOptions& work = options_.run.work;
  if (!(work.journal_interval >= 0)) {
    throw InputError("gamer: --journal: the seconds must be 0 or more, or inf");
  }
  if (work.resume && work.overwrite) {
    throw InputError(
        "gamer: --resume goes on with what is there, --overwrite starts anew; give one of them");
  }
  if (options_.markdown && !options_.listed_kind) {
    throw InputError("gamer: --markdown goes with --list-parameters");
  }
}

void CommandLine::take_job() {
  if (look_command_->parsed()) {
    if (!parameters_.empty() || !from_header_.empty()) {
      throw InputError("gamer: look takes one galaxy, no parameter file and no --from-header");
    }
    options_.run.request.look = look_;
  } else if (!from_header_.empty()) {
    if (!parameters_.empty()) {
      throw InputError("gamer: --from-header takes no parameter file and no scene list");
    }
  } else if (parameters_.empty() || (scene_.empty() && !options_.run.print_config)) {
    throw InputError(
        "gamer: needs a parameter file and a scene list: gamer [options] render.par scene.lst "
        "(gamer --help lists the options)");
  }
}

/// Gives the answers that need no job.
void tell(const Options& options) {
  if (!options.help.empty()) fmt::print("{}", options.help);
  if (options.version) {
    const std::string mpi = gamer::Ranks::library_version();
    fmt::print("gamer {}\nSIMD: {}\nMPI: {}\n", gamer::version(),
               gamer::simd_target_name(gamer::current_simd_target()), mpi.empty() ? "none" : mpi);
  }
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
  if (options.background) {
    gamer::RenderParameters parameters = gamer::load_parameters(options.run.request, data);
    fmt::print("{}", gamer::background_list(*options.background, make_camera(parameters, data)));
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
  const Options options = CommandLine().parse(argc, argv);
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
    // The error has been reported, and launchers then stop the other ranks, which need not report
    // that.
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
