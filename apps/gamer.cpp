// The command-line renderer: options in, library calls, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/resources.h"
#include "gamer/core/simd.h"
#include "gamer/core/version.h"
#include "gamer/image/clean_up.h"
#include "gamer/image/image_writer.h"
#include "gamer/image/picture.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/estimate.h"
#include "gamer/render/frames.h"
#include "gamer/render/job.h"
#include "gamer/render/journal.h"
#include "gamer/render/listing.h"
#include "gamer/render/progress.h"
#include "gamer/render/renderer.h"
#include "gamer/render/report.h"
#include "gamer/render/resume.h"
#include "gamer/render/schedule.h"
#include "gamer/render/truth.h"
#include "gamer/scene/animation.h"

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
  bool dry_run = false;
  bool resume = false;
  double journal_interval = 10;  ///< seconds
  bool truth = false;            ///< table TRUTH and the images of [truth]
  std::string truth_table;       ///< the table's own file, instead of the image's
  bool quiet = false;
  bool verbose = false;
  bool version = false;
  std::string help;  ///< what --help prints; empty when it was not asked for
  std::string resume_command;

  /// Whether the program answers without a job.
  bool only_tells() const {
    return !help.empty() || version || lists_components || listed_kind || sample_config;
  }
};

constexpr int most_threads = 4096;

/// The word as a shell reads it.
std::string shell_word(const std::string& word) {
  constexpr const char* plain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,/:@%^";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
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
  std::string parameters, scene, output, from_header, kind;
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
  app.add_flag("--dry-run", options.dry_run,
               "read and check everything; say what time and memory the job will take");
  CLI::Option* from_header_option =
      app.add_option("--from-header", from_header, "make the image of this FITS file again");
  from_header_option->type_name("FITS");
  app.add_flag("--truth", options.truth,
               "also write table TRUTH, what every object is, and the images of [truth]");
  app.add_option("--truth-table", options.truth_table,
                 "write that table to this file (.fits, .ecsv) instead of into the image's")
      ->type_name("PATH");
  app.add_flag("--overwrite", request.overwrite, "replace an existing output");
  app.add_flag("--resume", options.resume,
               "go on with a job that was interrupted, from OUTPUT.journal; without one start it, "
               "and leave a complete output as it is");
  app.add_option("--journal", options.journal_interval,
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

  if (!(options.journal_interval >= 0)) {
    throw InputError("gamer: --journal: the seconds must be 0 or more, or inf");
  }
  options.resume_command = resume_command(argc, argv);
  if (!options.truth_table.empty()) options.truth = true;
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

std::string files_text(const gamer::ImageHeader& header, const gamer::OutputOptions& output) {
  const auto files = gamer::output_files(output, header);
  const std::string more =
      files.size() > 1 ? fmt::format(" and {} more", files.size() - 1) : std::string();
  return files.front().string() + more;
}

std::string size_text(const gamer::ImageHeader& header) {
  std::string size = fmt::format("{} x {}", header.width, header.height);
  if (!header.faces.empty()) {
    size = fmt::format("{} x {} x {}", header.faces.size(), header.width, header.width);
  } else if (header.healpix) {
    size = fmt::format("12 x {0} x {0}", header.healpix->nside);
  }
  return fmt::format("{} pixels, {} plane{}", size, header.planes(),
                     header.planes() == 1 ? "" : "s");
}

std::string resume_hint(const Options& options, const gamer::Journal& journal) {
  return fmt::format("; finished rows are kept in {}; go on with: {}", journal.path().string(),
                     options.resume_command);
}

/// What rank 0 holds.
struct Work {
  gamer::RenderJob job;
  gamer::ImageHeader header;
  gamer::ImageHeader truth_header;          ///< without planes where no truth images are asked for
  std::string date;                         ///< DATE of the files
  std::unique_ptr<gamer::Journal> journal;  ///< null when none is kept
};

std::string objects_text(const gamer::Scene& scene) {
  const std::size_t galaxies = scene.galaxies.size(), stars = scene.stars.size();
  std::string text = fmt::format("{} galax{}", galaxies, galaxies == 1 ? "y" : "ies");
  if (stars > 0) text += fmt::format(", {} star{}", stars, stars == 1 ? "" : "s");
  if (scene.objects < scene.rows) {
    text += fmt::format(" of {} rows; the others do not touch the image", scene.rows);
  }
  return text;
}

/// All files that a job with these parameters makes.
std::vector<std::filesystem::path> result_files(const Options& options,
                                                const gamer::RenderParameters& parameters,
                                                const gamer::ImageHeader& header,
                                                const gamer::ImageHeader& truth_header) {
  std::vector<std::filesystem::path> files = gamer::output_files(parameters.output, header);
  if (truth_header.planes() > 0) {
    const auto more = gamer::output_files(gamer::truth_output(parameters), truth_header);
    files.insert(files.end(), more.begin(), more.end());
  }
  if (!options.truth_table.empty()) files.emplace_back(options.truth_table);
  return files;
}

std::vector<std::filesystem::path> result_files(const Options& options, const Work& work) {
  return result_files(options, work.job.parameters, work.header, work.truth_header);
}

bool is_there(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(file, error));
}

/// The journal of an earlier run of this job; null when there is none.
std::unique_ptr<gamer::Journal> find_journal(const Options& options) {
  gamer::Resources resources =
      gamer::open_resources(options.request, gamer::default_data_folders());
  const gamer::RenderParameters parameters = gamer::load_parameters(options.request, resources);
  return gamer::Journal::open(gamer::journal_path(parameters.output), options.journal_interval);
}

/// Where the truth goes, which is no parameter.
std::string truth_text(const Options& options) {
  if (!options.truth) return "";
  return options.truth_table.empty() ? "in the image" : "in " + options.truth_table;
}

/// Makes the job the one that the journal belongs to.
void go_on(const Options& options, std::unique_ptr<gamer::Journal> journal, Work& work) {
  gamer::check_same_job(journal->head(), gamer::make_journal_head(work.job, truth_text(options)),
                        journal->path().string());
  work.job.record = journal->head().record;
  work.date = journal->head().date;
  // What stands there after the journal's end is this job's.
  if (journal->head().overwrite || journal->has_end()) {
    work.job.parameters.output.overwrite = true;
  }
  if (!options.dry_run) journal->remove_files();
  work.journal = std::move(journal);
}

/// Of a job that begins: its journal, in place of an older one.
void begin_journal(const Options& options, Work& work) {
  const std::filesystem::path path = gamer::journal_path(work.job.parameters.output);
  gamer::Journal::discard(path);
  const gamer::JournalHead head = gamer::make_journal_head(work.job, truth_text(options));
  work.date = head.date;
  if (std::isinf(options.journal_interval)) return;
  work.journal = std::make_unique<gamer::Journal>(path, head, options.journal_interval);
}

/// On rank 0: checks everything of a job. Empty when there is nothing to render. `earlier` is the
/// journal to go on with.
std::optional<Work> prepare_job(const Options& options, gamer::RenderJob job, int ranks,
                                int threads, std::unique_ptr<gamer::Journal> earlier) {
  const int workers = ranks * threads;
  Work work{std::move(job), {}, {}, {}, {}};
  if (earlier) go_on(options, std::move(earlier), work);
  work.header = gamer::make_image_header(work.job);
  int planes = work.header.planes();
  if (options.truth && work.job.parameters.truth.any()) {
    work.truth_header = gamer::make_truth_header(work.job);
    planes += work.truth_header.planes();
  }
  const gamer::OutputOptions& output = work.job.parameters.output;
  const std::filesystem::path journal = gamer::journal_path(output);
  if (options.resume && !work.journal && !output.overwrite) {
    const auto files = result_files(options, work);
    if (std::all_of(files.begin(), files.end(), is_there)) {
      gamer::check_same_job(files.front(), work.job.record);
      if (!options.quiet) {
        fmt::print("{}: complete already\n", files_text(work.header, output));
      }
      return std::nullopt;
    }
  }
  if (!work.journal && !output.overwrite && is_there(journal)) {
    throw InputError(
        fmt::format("output '{}': '{}' holds finished rows of a job that was interrupted; --resume "
                    "goes on with it, --overwrite starts anew",
                    output.path.string(), journal.string()));
  }
  gamer::check_output(output, work.header);
  if (options.truth) gamer::check_truth_table(options.truth_table, output);
  if (work.truth_header.planes() > 0) {
    gamer::check_output(gamer::truth_output(work.job.parameters), work.truth_header);
  }
  gamer::check_row_memory(work.header, planes, ranks, threads);
  if (options.dry_run) {
    fmt::print("would write {}: {}, {}\n", files_text(work.header, output), size_text(work.header),
               objects_text(*work.job.scene));
    const gamer::JobEstimate estimate =
        gamer::estimate_job(work.job, options.truth, ranks, threads, gamer::process_seconds());
    fmt::print("{}\n", gamer::estimate_text(estimate, ranks, threads));
    return std::nullopt;
  }
  if (options.verbose) {
    fmt::print(stderr, "gamer: {}, {} worker{}, SIMD {}\n", objects_text(*work.job.scene), workers,
               workers == 1 ? "" : "s", gamer::simd_target_name(gamer::current_simd_target()));
  }
  if (!work.journal) begin_journal(options, work);
  for (gamer::ImageHeader* header : {&work.header, &work.truth_header}) {
    header->cards.push_back({"DATE", work.date, "time of writing (UTC)"});
  }
  return work;
}

/// On rank 0: answers, or reads and checks everything. Empty when there is nothing to render.
std::optional<Work> prepare(const Options& options, int ranks, int threads,
                            std::unique_ptr<gamer::Journal> earlier) {
  if (options.only_tells()) {
    tell(options);
    return std::nullopt;
  }
  gamer::Resources resources =
      gamer::open_resources(options.request, gamer::default_data_folders());
  if (options.print_config) {
    fmt::print("{}", gamer::load_parameters(options.request, resources).toml());
    return std::nullopt;
  }
  return prepare_job(options, gamer::load_job(options.request, resources), ranks, threads,
                     std::move(earlier));
}

/// The image's writer, and that of the truth images where there are.
std::unique_ptr<gamer::ImageWriter> make_writer(const gamer::RenderJob& job, const Work& work) {
  auto image = gamer::make_image_writer(job.parameters.output, work.header);
  const int extra = work.truth_header.planes();
  if (extra == 0) return image;
  const int own = work.header.planes();
  return gamer::make_split_writer(
      std::move(image), own,
      gamer::make_image_writer(gamer::truth_output(job.parameters), work.truth_header), own + extra,
      work.header.width);
}

/// From then on a signal says how to go on.
void announce(const Options& options, gamer::Journal& journal) {
  const std::string hint = resume_hint(options, journal);
  if (journal.is_begun()) {
    gamer::say_when_stopped("gamer", hint);
  } else {
    journal.when_begun([hint] { gamer::say_when_stopped("gamer", hint); });
  }
}

/// Gives the files their names. From the journal's end on, files that stand there are the job's.
void finish(const Options& options, gamer::ImageWriter& writer,
            const std::optional<gamer::DataTable>& truth, Work& work) {
  const auto files = result_files(options, work);
  if (work.journal && std::none_of(files.begin(), files.end(), is_there)) work.journal->add_end();
  writer.finish();
  if (truth && !options.truth_table.empty()) {
    gamer::write_truth_table(options.truth_table, *truth, work.date);
  }
  if (work.journal) work.journal->remove();
}

/// Renders and writes; every rank's part. Puts where its time went into `report`.
void render(const Options& options, const gamer::RenderJob& job, gamer::JournaledExecutor& executor,
            Work* work, gamer::RankReport& report) {
  std::optional<gamer::DataTable> truth;
  if (options.truth) truth = gamer::truth_table(job, executor);
  const gamer::TruthImages images = options.truth ? job.parameters.truth : gamer::TruthImages();
  const gamer::Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum, images);
  std::unique_ptr<gamer::ImageWriter> writer;
  if (work != nullptr) {
    if (truth && options.truth_table.empty()) work->header.data_tables = {*truth};
    writer = make_writer(job, *work);
    // What is left when the process is killed.
    if (work->journal) work->journal->add_files(gamer::files_in_the_making());
  }
  const auto values_per_row =
      static_cast<std::size_t>(renderer.width()) * static_cast<std::size_t>(renderer.planes());
  using Style = gamer::Progress::Style;
  const bool is_silent = options.quiet || work == nullptr;
  gamer::Progress progress(renderer.height(),
                           is_silent ? Style::none : gamer::Progress::style_for(stderr), stderr);
  std::mutex mutex;
  const auto compute = [&](gamer::RowRange rows, std::span<double> values) {
    gamer::RenderCounts counts;
    renderer.render_rows(rows, values, counts);
    const std::lock_guard lock(mutex);
    report.counts += counts;
  };
  const auto consume = [&](gamer::RowRange rows, std::span<const double> values) {
    writer->write_rows(rows.first, rows.size(), values);
    if (executor.is_replaying()) {
      progress.skip(rows.size());
    } else {
      progress.add(rows.size());
    }
  };
  executor.keep_single(gamer::is_single_precision(job.parameters.output));
  executor.run(gamer::render_blocks(renderer, executor.workers()), values_per_row, compute,
               consume);
  report.runs = executor.times();
  if (work == nullptr) return;
  const gamer::Clock clock;
  finish(options, *writer, truth, *work);
  report.writing = report.runs.consume + clock.seconds();
  if (!options.quiet) {
    const std::string earlier =
        progress.skipped() > 0 ? fmt::format(", {} rows from the journal", progress.skipped()) : "";
    fmt::print("{}: {}, {:.1f} s{}\n", files_text(work->header, job.parameters.output),
               size_text(work->header), progress.seconds(), earlier);
  }
}

/// Rank 0's part; errors while running say how to go on.
void render_or_say_how_to_go_on(const Options& options, gamer::JournaledExecutor& executor,
                                Work& work, gamer::RankReport& report) {
  const auto fail = [&](const std::string& message) {
    const bool is_kept = work.journal && work.journal->is_begun();
    throw gamer::RunError(message + (is_kept ? resume_hint(options, *work.journal) : ""));
  };
  try {
    render(options, work.job, executor, &work, report);
  } catch (const gamer::RunError& error) {
    fail(error.what());
  } catch (const std::bad_alloc&) {
    fail("gamer: out of memory");
  }
}

/// Every rank's part.
void say_where_the_time_went(const gamer::Ranks& ranks, const gamer::RankReport& own,
                             const gamer::Camera& camera) {
  std::vector<gamer::RankReport> reports;
  for (const std::string& packed : ranks.gather(gamer::pack_report(own))) {
    reports.push_back(gamer::unpack_report(packed));
  }
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  fmt::print(stderr, "{}", gamer::report_text(reports, pixels));
}

/// Rank 0's record on every rank; an empty one where there is nothing to render.
gamer::Record share_record(const gamer::Ranks& ranks, gamer::Record own) {
  if (ranks.size() == 1) return own;
  const bool is_source = ranks.rank() == 0;
  std::string packed = ranks.broadcast(is_source ? gamer::pack_record(own) : std::string());
  return is_source ? std::move(own) : gamer::unpack_record(packed);
}

// ---- Animations --------------------------------------------------------------------------------

/// What every rank needs of an animation.
struct Film {
  gamer::Record record;     ///< of all frames, with [animation]
  std::vector<int> frames;  ///< to be rendered, from 0
};

constexpr const char* film_frames = "frames";

std::string pack_film(Film film) {
  film.record.push_back({film_frames, "", fmt::format("{}", fmt::join(film.frames, " "))});
  return gamer::pack_record(film.record);
}

Film unpack_film(const std::string& packed) {
  Film film{gamer::unpack_record(packed), {}};
  std::istringstream numbers(film.record.back().content.str());
  for (int frame = 0; numbers >> frame;) film.frames.push_back(frame);
  film.record.pop_back();
  return film;
}

gamer::RenderParameters film_parameters(const gamer::Record& record) {
  const auto text =
      std::ranges::find(record, gamer::recorded_parameters, &gamer::Resources::Text::name);
  return gamer::RenderParameters::read(gamer::parse_toml(text->content, text->label));
}

/// On rank 0: an animation, once everything is checked; empty for a single image. `is_done` when
/// there is nothing to render.
std::optional<Film> prepare_film(const Options& options, int ranks, int threads, bool& is_done) {
  if (options.only_tells() || options.print_config) return std::nullopt;
  gamer::Resources resources =
      gamer::open_resources(options.request, gamer::default_data_folders());
  if (gamer::load_parameters(options.request, resources).frames == 0) return std::nullopt;
  const gamer::RenderJob job = gamer::load_job(options.request, resources);
  const gamer::CameraPath path(job.parameters);
  const gamer::ImageHeader header = gamer::make_image_header(job);
  gamer::ImageHeader truth_header;
  if (options.truth) {
    gamer::check_truth_table(options.truth_table, job.parameters.output);
    if (!options.truth_table.empty()) {
      throw InputError(
          "gamer: --truth-table: an animation has a table for each frame; --truth "
          "puts them into the frames' files");
    }
    if (job.parameters.truth.any()) truth_header = gamer::make_truth_header(job);
  }
  gamer::check_row_memory(header, header.planes() + truth_header.planes(), ranks, threads);
  Film film{job.record, {}};
  std::vector<std::filesystem::path> old_files;
  for (int frame = 0; frame < path.frames(); ++frame) {
    gamer::RenderParameters own = gamer::frame_parameters(job.parameters, path, frame);
    own.output.overwrite = options.request.overwrite || options.resume;
    gamer::check_output(own.output, header);
    if (truth_header.planes() > 0) gamer::check_output(gamer::truth_output(own), truth_header);
    const auto files = result_files(options, own, header, truth_header);
    const std::filesystem::path journal = gamer::journal_path(own.output);
    if (options.resume) {
      if (std::all_of(files.begin(), files.end(), is_there)) {
        gamer::check_same_frame(files.front(), film.record, own);
        if (!is_there(journal)) continue;
      }
    } else if (!options.request.overwrite && is_there(journal)) {
      throw InputError(
          fmt::format("output '{}': '{}' holds finished rows of a job that was "
                      "interrupted; --resume goes on with it, --overwrite starts anew",
                      own.output.path.string(), journal.string()));
    } else if (options.request.overwrite) {
      std::copy_if(files.begin(), files.end(), std::back_inserter(old_files), is_there);
    }
    film.frames.push_back(frame);
  }
  const std::string names = fmt::format(
      "{} to {}", gamer::frame_path(job.parameters.output.path, 0, path.frames()).string(),
      gamer::frame_path(job.parameters.output.path, path.frames() - 1, path.frames())
          .filename()
          .string());
  is_done = true;
  if (options.dry_run) {
    fmt::print("would write {}: {} of {} frames, {}, {}\n", names, film.frames.size(),
               path.frames(), size_text(header), objects_text(*job.scene));
  } else if (film.frames.empty()) {
    if (!options.quiet) fmt::print("{}: complete already\n", names);
  } else {
    is_done = false;
    // So that a frame that is there is a frame of this animation.
    for (const std::filesystem::path& file : old_files) std::filesystem::remove(file);
  }
  return film;
}

/// Renders a frame where this process is all that there is, or rank 0's part with all ranks.
void render_frame(const Options& options, const Film& film, gamer::RenderParameters parameters,
                  int ranks, int threads, gamer::Executor& executor, gamer::RankReport& report) {
  parameters.output.overwrite = options.request.overwrite;
  std::unique_ptr<gamer::Journal> earlier;
  if (options.resume) {
    const std::filesystem::path path = gamer::journal_path(parameters.output);
    earlier = gamer::Journal::open(path, options.journal_interval);
    const std::string simd = gamer::simd_target_name(gamer::current_simd_target());
    // Its rows' last digits would differ: the frame begins again.
    if (earlier && earlier->head().simd != simd) {
      earlier.reset();
      gamer::Journal::discard(path);
      parameters.output.overwrite = true;
    }
  }
  std::optional<Work> work = prepare_job(options, gamer::frame_job(film.record, parameters), ranks,
                                         threads, std::move(earlier));
  if (!work) return;
  gamer::JournaledExecutor journaled(executor, work->journal.get());
  render_or_say_how_to_go_on(options, journaled, *work, report);
}

/// Every rank's part.
void run_film(const gamer::Ranks& ranks, const Options& options, Film film, int threads,
              gamer::Executor& executor, gamer::RankReport& report) {
  const bool is_root = ranks.rank() == 0;
  gamer::RenderParameters parameters = film_parameters(film.record);
  const gamer::CameraPath path(parameters);
  if (is_root) {
    gamer::say_when_stopped("gamer",
                            "; finished frames are kept; go on with: " + options.resume_command);
  }
  if (gamer::picture_format(parameters.output.path.string()) && !parameters.output.tone) {
    const auto tone = gamer::frame_tone(
        film.record, gamer::frame_parameters(parameters, path, parameters.tone_frame - 1),
        executor);
    const std::vector<double> own(tone.begin(), tone.end());
    const std::string text = ranks.broadcast(gamer::value_text(own));
    gamer::ConfigNode root = gamer::parse_toml("tone = " + text, "image.tone");
    std::vector<double> numbers;
    for (const gamer::ConfigNode& node : root.find("tone")->array()) {
      const auto* whole = std::get_if<std::int64_t>(&node.data);
      numbers.push_back(whole ? static_cast<double>(*whole) : std::get<double>(node.data));
    }
    parameters.set("image", "tone", numbers);
  }
  const auto frame = [&](std::size_t i) {
    return gamer::frame_parameters(parameters, path, film.frames[i]);
  };
  const auto count = static_cast<int>(film.frames.size());
  const int apart = gamer::frames_apart(count, ranks.size());
  if (apart > 0) {
    Options alone = options;
    alone.quiet = true;
    alone.verbose = false;
    using Style = gamer::Progress::Style;
    const bool is_silent = options.quiet || !is_root;
    gamer::Progress progress(apart, is_silent ? Style::none : gamer::Progress::style_for(stderr),
                             stderr);
    progress.count("frames");
    const std::unique_ptr<gamer::Executor> frames = ranks.executor(1);
    frames->run(
        gamer::even_blocks(apart, 1), 1,
        [&](gamer::RowRange block, std::span<double> values) {
          gamer::ThreadExecutor local(threads);
          render_frame(alone, film, frame(static_cast<std::size_t>(block.first)), 1, threads, local,
                       report);
          values[0] = 1;
        },
        [&](gamer::RowRange block, std::span<const double>) {
          progress.add(block.size());
          if (options.quiet) return;
          const auto i = static_cast<std::size_t>(block.first);
          fmt::print(
              "{}\n",
              gamer::frame_path(parameters.output.path, film.frames[i], path.frames()).string());
        });
    report.runs = frames->times();
  }
  for (int i = apart; i < count; ++i) {
    if (is_root) {
      render_frame(options, film, frame(static_cast<std::size_t>(i)), ranks.size(), threads,
                   executor, report);
    } else {
      const gamer::RenderJob job =
          gamer::frame_job(film.record, frame(static_cast<std::size_t>(i)));
      gamer::JournaledExecutor journaled(executor, nullptr);
      render(options, job, journaled, nullptr, report);
    }
  }
}

/// Every rank's part of the run.
void run(const gamer::Ranks& ranks, int argc, char** argv) {
  const gamer::Clock clock;
  const Options options = parse_options(argc, argv);
  std::unique_ptr<gamer::Journal> earlier;
  std::int64_t simd_targets = gamer::supported_simd_targets();
  if (ranks.rank() == 0 && options.resume && !options.only_tells() && !options.print_config) {
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
  std::optional<Film> film;
  bool is_done = false;
  if (ranks.rank() == 0) film = prepare_film(options, ranks.size(), threads, is_done);
  if (is_done) film->frames.clear();
  const std::string packed_film = ranks.broadcast(film ? pack_film(std::move(*film)) : "");
  if (!packed_film.empty()) {
    film = unpack_film(packed_film);
    if (!film->frames.empty()) {
      run_film(ranks, options, std::move(*film), threads, *executor, report);
    }
    return;
  }

  std::optional<Work> work;
  if (ranks.rank() == 0) work = prepare(options, ranks.size(), threads, std::move(earlier));
  const gamer::Record record = share_record(ranks, work ? work->job.record : gamer::Record());
  if (record.empty()) return;

  std::optional<gamer::RenderJob> received;
  if (!work) received = gamer::job_from_record(record);
  gamer::Journal* journal = work ? work->journal.get() : nullptr;
  gamer::JournaledExecutor journaled(*executor, journal);
  if (journal != nullptr) announce(options, *journal);
  if (work) {
    render_or_say_how_to_go_on(options, journaled, *work, report);
  } else {
    render(options, *received, journaled, nullptr, report);
  }
  if (!options.verbose) return;
  report.wall = clock.seconds();
  report.peak_memory = gamer::peak_memory();
  say_where_the_time_went(ranks, report, work ? work->job.camera : received->camera);
}

/// The one place where errors are reported.
int run_and_report(gamer::Ranks& ranks, int argc, char** argv) {
  const auto report = [](const std::string& message) { fmt::print(stderr, "{}\n", message); };
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
    fmt::print(stderr, "gamer: {}\n", error.what());
    return failed;
  }
}
