// The command-line renderer: options in, library calls, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/printable.h"
#include "gamer/core/resources.h"
#include "gamer/core/simd.h"
#include "gamer/core/version.h"
#include "gamer/image/clean_up.h"
#include "gamer/job/estimate.h"
#include "gamer/job/film.h"
#include "gamer/job/job.h"
#include "gamer/job/journal.h"
#include "gamer/job/listing.h"
#include "gamer/job/progress.h"
#include "gamer/job/report.h"
#include "gamer/job/resume.h"
#include "gamer/job/warnings.h"
#include "gamer/job/work.h"
#include "gamer/parallel/ranks.h"

namespace {

using gamer::InputError;

enum ExitCode { done = 0, failed = 1, wrong_input = 2 };

struct Options {
  gamer::JobRequest request;
  std::optional<int> threads;
  bool lists_components = false;
  std::optional<std::string> listed_kind;  ///< --list-parameters; empty for all
  bool markdown = false;
  bool sample_config = false;
  bool print_config = false;
  gamer::WorkOptions work;
  bool quiet = false;
  bool verbose = false;
  bool version = false;
  std::string help;  ///< what --help prints; empty when it was not asked for

  /// Whether the program answers without a job.
  bool only_tells() const {
    return !help.empty() || version || lists_components || listed_kind || sample_config;
  }
  gamer::Progress::Style progress() const {
    return quiet ? gamer::Progress::Style::none : gamer::Progress::style_for(stderr);
  }
};

constexpr int most_threads = 4096;

/// "$'...'", in which control characters and bytes that are not ASCII are octal numbers.
std::string escaped_word(const std::string& word) {
  std::string quoted = "$'";
  for (const char c : word) {
    if (c == '\'' || c == '\\') {
      quoted += {'\\', c};
    } else if (c >= ' ' && c <= '~') {
      quoted += c;
    } else {
      quoted += fmt::format("\\{:03o}", static_cast<unsigned char>(c));
    }
  }
  return quoted + "'";
}

/// The word as a shell reads it, in characters that print.
std::string shell_word(const std::string& word) {
  constexpr const char* plain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,/:@%^";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  if (gamer::printable(word) != word) return escaped_word(word);
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string resume_command(int argc, char** argv) {
  std::string command = shell_word(argv[0]) + " --resume";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word != "--resume" && word != "--overwrite") command += " " + shell_word(word);
  }
  return command;
}

/// Throws InputError.
Options parse_options(int argc, char** argv) {
  Options options;
  gamer::JobRequest& request = options.request;
  std::string parameters, scene, output, from_header, kind, truth_table;
  int threads = 0;

  CLI::App app{"Renders a scene of synthetic galaxies to a FITS image or a picture.", "gamer"};
  app.add_option("render.par", parameters, "parameter file (TOML)");
  app.add_option("scene.lst", scene, "scene list, one galaxy per row");
  CLI::Option* output_option =
      app.add_option("-o,--output", output, "write to this file instead of image.output");
  app.add_option("-s,--set", request.settings, "override a key: section.key=value (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  CLI::Option* threads_option =
      app.add_option("-j,--threads", threads,
                     "threads per process (default: all cores, one under mpirun)")
          ->check(CLI::Range(1, most_threads));
  app.add_flag("--preview", request.preview,
               "a quarter of the size on each side, tolerance 1e-2, no supersampling");
  app.add_flag("--list-components", options.lists_components, "list the kinds of components");
  CLI::Option* list_option =
      app.add_option("--list-parameters", kind,
                     "list all parameters, or those of a section or a kind of component")
          ->expected(0, 1)
          ->type_name("[KIND]");
  app.add_flag("--markdown", options.markdown, "with --list-parameters: Markdown tables");
  app.add_flag("--sample-config", options.sample_config, "print a complete parameter file");
  app.add_flag("--print-config", options.print_config, "print the resolved parameters");
  app.add_flag("--dry-run", options.work.dry_run,
               "read and check everything; say what time and memory the job will take");
  CLI::Option* from_header_option = app.add_option(
      "--from-header", from_header, "make the image of this FITS file or PNG picture again");
  from_header_option->type_name("IMAGE");
  app.add_flag("--truth", options.work.truth,
               "also write table TRUTH, what every object is, and the images of [truth]");
  app.add_option("--truth-table", truth_table,
                 "write that table to this file (.fits, .ecsv) instead of into the image's")
      ->type_name("PATH");
  app.add_flag("--overwrite", request.overwrite, "replace an existing output");
  app.add_flag("--resume", options.work.resume,
               "go on with a job that was interrupted, from OUTPUT.journal; without one start it, "
               "and leave a complete output as it is");
  app.add_option("--journal", options.work.journal_interval,
                 "keep finished rows in OUTPUT.journal once the job is so old, and force them to "
                 "disk as often; inf: never (default: 10)")
      ->type_name("SECONDS");
  CLI::Option* quiet_option = app.add_flag("-q,--quiet", options.quiet, "say nothing but errors");
  app.add_flag("-v,--verbose", options.verbose, "say more, and where the time went")
      ->excludes(quiet_option);
  app.add_flag("--version", options.version, "print versions");

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    options.help = app.help();
    return options;
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("gamer: {} (gamer --help lists the options)", error.what()));
  }
  request.parameters = parameters;
  request.scene = scene;
  if (output_option->count() > 0) request.output = output;
  if (threads_option->count() > 0) options.threads = threads;
  if (list_option->count() > 0) options.listed_kind = kind;
  if (from_header_option->count() > 0) request.from_header = from_header;

  if (!(options.work.journal_interval >= 0)) {
    throw InputError("gamer: --journal: the seconds must be 0 or more, or inf");
  }
  options.work.overwrite = request.overwrite;
  options.work.resume_command = resume_command(argc, argv);
  if (!truth_table.empty()) {
    options.work.truth = true;
    options.work.truth_table = truth_table;
  }
  if (options.work.resume && options.work.overwrite) {
    throw InputError(
        "gamer: --resume goes on with what is there, --overwrite starts anew; give one of them");
  }
  if (options.markdown && !options.listed_kind) {
    throw InputError("gamer: --markdown goes with --list-parameters");
  }
  if (options.only_tells()) return options;
  if (!request.from_header.empty()) {
    if (!parameters.empty()) {
      throw InputError("gamer: --from-header takes no parameter file and no scene list");
    }
  } else if (parameters.empty() || (scene.empty() && !options.print_config)) {
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
  if (options.listed_kind) {
    fmt::print("{}", gamer::list_parameters(*options.listed_kind, options.markdown));
  }
  if (options.sample_config) fmt::print("{}", gamer::sample_parameters());
}

/// The journal of an earlier run of this job; null when there is none.
std::unique_ptr<gamer::Journal> find_journal(const Options& options) {
  gamer::Resources resources =
      gamer::open_resources(options.request, gamer::default_data_folders());
  const gamer::RenderParameters parameters = gamer::load_parameters(options.request, resources);
  return gamer::Journal::open(gamer::journal_path(parameters.output),
                              options.work.journal_interval);
}

/// What rank 0 has to do: an image, or a film, or nothing any more.
struct Task {
  std::unique_ptr<gamer::Work> work;
  std::unique_ptr<gamer::Film> film;
};

void tell_size_of_work(const gamer::RenderJob& job, int workers) {
  fmt::print(stderr, "gamer: {}, {} worker{}, SIMD {}\n", gamer::objects_text(*job.scene), workers,
             workers == 1 ? "" : "s", gamer::simd_target_name(gamer::current_simd_target()));
}

void tell_estimate(const gamer::JobEstimate& estimate, int ranks, int threads,
                   const std::string& hindrance) {
  fmt::print("{}\n", gamer::estimate_text(estimate, ranks, threads));
  if (!hindrance.empty()) fmt::print("{}\n", gamer::printable(hindrance));
}

Task prepare_image(const Options& options, gamer::RenderJob job, int ranks, int threads,
                   std::unique_ptr<gamer::Journal> earlier) {
  auto work = std::make_unique<gamer::Work>(std::move(job), options.work, ranks, threads,
                                            std::move(earlier));
  if (work->is_complete()) {
    if (!options.quiet) fmt::print("{}\n", gamer::printable(work->text()));
    return {};
  }
  if (options.work.dry_run) {
    fmt::print("would write {}, {}\n", gamer::printable(work->plan()),
               gamer::objects_text(*work->job().scene));
    gamer::Preparation preparation{gamer::process_seconds(), 0};
    work->complete(gamer::Ranks(), threads);
    preparation.measuring = gamer::process_seconds() - preparation.reading;
    tell_estimate(gamer::estimate_job(work->job(), options.work.truth, ranks, threads, preparation),
                  ranks, threads, work->hindrance());
    return {};
  }
  if (options.verbose) tell_size_of_work(work->job(), ranks * threads);
  return {std::move(work), nullptr};
}

Task prepare_film(const Options& options, const gamer::RenderJob& job, int ranks, int threads) {
  auto film = std::make_unique<gamer::Film>(job, options.work, ranks, threads);
  if (const auto later = film->later_files(); !later.empty() && !options.quiet) {
    const std::string files =
        later.size() == 1
            ? "is a frame of a longer film and stays"
            : fmt::format("and {} more are frames of a longer film and stay", later.size() - 1);
    fmt::print(stderr, "gamer: {} {}: this one ends with frame {}\n",
               gamer::printable(later.front().string()), files, film->frames());
  }
  if (film->left().empty()) {
    if (!options.quiet) fmt::print("{}: complete already\n", gamer::printable(film->names()));
    return {};
  }
  if (options.work.dry_run) {
    fmt::print("would write {}: {} of {} frames, {}, {}\n", gamer::printable(film->names()),
               film->left().size(), film->frames(), film->size(), gamer::objects_text(*job.scene));
    tell_estimate(film->estimate(ranks, threads, gamer::process_seconds()), ranks, threads,
                  film->hindrance());
    return {};
  }
  if (options.verbose) tell_size_of_work(job, ranks * threads);
  return {nullptr, std::move(film)};
}

void warn(const std::string& text) {
  fmt::print(stderr, "gamer: warning: {}\n", gamer::printable(text));
}

void warn_of(const Options& options, const gamer::RenderJob& job) {
  // A preview has one ray a pixel, and is none to measure.
  if (options.quiet || options.request.preview) return;
  for (const std::string& text : gamer::job_warnings(job)) warn(text);
}

/// On rank 0: answers, or reads and checks everything.
Task prepare(const Options& options, int ranks, int threads,
             std::unique_ptr<gamer::Journal> earlier) {
  if (options.only_tells()) {
    tell(options);
    return {};
  }
  gamer::Resources resources =
      gamer::open_resources(options.request, gamer::default_data_folders());
  if (options.print_config) {
    fmt::print("{}", gamer::load_parameters(options.request, resources).toml());
    return {};
  }
  gamer::RenderJob job = gamer::read_job(options.request, resources);
  warn_of(options, job);
  if (job.parameters.frames > 0) return prepare_film(options, job, ranks, threads);
  return prepare_image(options, std::move(job), ranks, threads, std::move(earlier));
}

/// From then on a signal says how to go on.
void announce(const gamer::Work& work) {
  if (work.journal() == nullptr) return;
  const std::string hint = work.resume_hint();
  if (work.journal()->is_begun()) {
    gamer::say_when_stopped("gamer", hint);
  } else {
    work.journal()->when_begun([hint] { gamer::say_when_stopped("gamer", hint); });
  }
}

/// Every rank's part. `pixels` are those of all images.
void say_where_the_time_went(const gamer::Ranks& ranks, const gamer::RankReport& own,
                             double pixels) {
  std::vector<gamer::RankReport> reports;
  for (const std::string& packed : ranks.gather(gamer::pack_report(own))) {
    reports.push_back(gamer::unpack_report(packed));
  }
  fmt::print(stderr, "{}", gamer::report_text(reports, pixels));
}

/// Every rank's part; returns the pixels of the image.
double render_image(const gamer::Ranks& ranks, const Options& options, gamer::Work* work,
                    std::string packed, int threads, gamer::Executor& executor,
                    gamer::RankReport& report) {
  const auto pixels = [](const gamer::Camera& camera) {
    return static_cast<double>(camera.width()) * camera.height();
  };
  if (ranks.rank() != 0) {
    gamer::RenderJob job = gamer::read_job(gamer::unpack_record(std::exchange(packed, {})));
    gamer::complete(job, ranks, threads);
    gamer::help_render(job, options.work, executor, report);
    return pixels(job.camera);
  }
  packed.clear();
  packed.shrink_to_fit();
  work->complete(ranks, threads);
  work->begin();
  announce(*work);
  work->render(executor, options.progress(), report);
  if (!options.quiet) {
    fmt::print("{}\n", gamer::printable(work->text()));
    for (const std::string& text : {work->darkness(), work->shortfall()}) {
      if (!text.empty()) warn(text);
    }
  }
  return pixels(work->job().camera);
}

/// Every rank's part; returns the pixels of all frames.
double render_film(const gamer::Ranks& ranks, const Options& options,
                   std::unique_ptr<gamer::Film> film, std::string packed, int threads,
                   gamer::Executor& executor, gamer::RankReport& report) {
  if (film == nullptr) film = gamer::Film::unpack(packed, options.work);
  packed.clear();
  packed.shrink_to_fit();
  gamer::Film::Messages messages;
  messages.progress = options.progress();
  if (!options.quiet) {
    messages.say = [](const std::string& line) { fmt::print("{}\n", gamer::printable(line)); };
    messages.warn = warn;
  }
  film->render(ranks, threads, executor, messages, report);
  return film->pixels();
}

/// Every rank's part of the run.
void run(const gamer::Ranks& ranks, int argc, char** argv) {
  const gamer::Clock clock;
  gamer::check_same_program(ranks);
  const Options options = parse_options(argc, argv);
  std::unique_ptr<gamer::Journal> earlier;
  std::int64_t simd_targets = gamer::supported_simd_targets();
  if (ranks.rank() == 0 && options.work.resume && !options.only_tells() && !options.print_config) {
    earlier = find_journal(options);
    if (earlier) simd_targets = gamer::journal_simd_targets(*earlier);
  }
  simd_targets = ranks.common_bits(simd_targets);
  if (simd_targets == 0) {
    throw InputError("gamer: a rank's machine has not the instructions of the journal's rows");
  }
  gamer::use_simd_targets(simd_targets);
  const int threads = options.threads.value_or(ranks.size() == 1 ? gamer::available_cores() : 1);
  gamer::use_threads(threads);
  const std::unique_ptr<gamer::Executor> executor = ranks.executor(threads);

  gamer::RankReport report;
  report.threads = threads;
  Task task;
  if (ranks.rank() == 0) task = prepare(options, ranks.size(), threads, std::move(earlier));
  std::string film = ranks.broadcast(task.film ? task.film->pack() : "");
  // Alone the record need not travel.
  const bool travels = task.work && ranks.size() > 1;
  std::string image = ranks.broadcast(travels ? gamer::pack_record(task.work->job().record) : "");
  double pixels = 0;
  if (!film.empty()) {
    pixels = render_film(ranks, options, std::move(task.film), std::move(film), threads, *executor,
                         report);
  } else if (task.work || !image.empty()) {
    pixels =
        render_image(ranks, options, task.work.get(), std::move(image), threads, *executor, report);
  } else {
    return;
  }
  if (!options.verbose) return;
  report.wall = clock.seconds();
  report.peak_memory = gamer::peak_memory();
  say_where_the_time_went(ranks, report, pixels);
}

/// The one place where errors are reported.
int run_and_report(gamer::Ranks& ranks, int argc, char** argv) {
  const auto report = [](const std::string& message) {
    fmt::print(stderr, "{}\n", gamer::printable(message));
  };
  const auto end = [&](int code, const std::string& message) {
    // Launchers end the other ranks when one of them ends with an error, which is told by now.
    gamer::say_nothing_when_stopped();
    return ranks.end(code, message, report);
  };
  try {
    run(ranks, argc, argv);
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
  try {
    gamer::Ranks ranks(&argc, &argv);
    if (ranks.rank() == 0) gamer::say_when_stopped("gamer", "");
    return run_and_report(ranks, argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "gamer: {}\n", gamer::printable(error.what()));
    return failed;
  }
}
