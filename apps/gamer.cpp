// The command-line renderer: options in, library calls, exit code out.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "gamer/core/clock.h"
#include "gamer/core/error.h"
#include "gamer/core/resources.h"
#include "gamer/core/simd.h"
#include "gamer/core/version.h"
#include "gamer/image/clean_up.h"
#include "gamer/image/image_writer.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/job.h"
#include "gamer/render/listing.h"
#include "gamer/render/progress.h"
#include "gamer/render/renderer.h"
#include "gamer/render/report.h"
#include "gamer/render/schedule.h"
#include "gamer/render/truth.h"

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
  bool truth = false;       ///< table TRUTH and the images of [truth]
  std::string truth_table;  ///< the table's own file, instead of the image's
  bool quiet = false;
  bool verbose = false;
  bool version = false;
  std::string help;  ///< what --help prints; empty when it was not asked for

  /// Whether the program answers without a job.
  bool only_tells() const {
    return !help.empty() || version || lists_components || listed_kind || sample_config;
  }
};

constexpr int most_threads = 4096;

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
  app.add_flag("--dry-run", options.dry_run, "read and check everything, render nothing");
  CLI::Option* from_header_option =
      app.add_option("--from-header", from_header, "make the image of this FITS file again");
  from_header_option->type_name("FITS");
  app.add_flag("--truth", options.truth,
               "also write table TRUTH, what every object is, and the images of [truth]");
  app.add_option("--truth-table", options.truth_table,
                 "write that table to this file (.fits, .ecsv) instead of into the image's")
      ->type_name("PATH");
  app.add_flag("--overwrite", request.overwrite, "replace an existing output");
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
  return fmt::format("{} x {} pixels, {} plane{}", header.width, header.height, header.planes(),
                     header.planes() == 1 ? "" : "s");
}

/// What rank 0 holds.
struct Work {
  gamer::RenderJob job;
  gamer::ImageHeader header;
  gamer::ImageHeader truth_header;  ///< without planes where no truth images are asked for
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

/// On rank 0: answers, or reads and checks everything. Empty when there is nothing to render.
std::optional<Work> prepare(const Options& options, int ranks, int threads) {
  const int workers = ranks * threads;
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
  Work work{gamer::load_job(options.request, resources), {}, {}};
  work.header = gamer::make_image_header(work.job);
  const gamer::OutputOptions& output = work.job.parameters.output;
  gamer::check_output(output, work.header);
  int planes = work.header.planes();
  if (options.truth) {
    gamer::check_truth_table(options.truth_table, output);
    if (work.job.parameters.truth.any()) {
      work.truth_header = gamer::make_truth_header(work.job);
      gamer::check_output(gamer::truth_output(work.job.parameters), work.truth_header);
      planes += work.truth_header.planes();
    }
  }
  gamer::check_row_memory(work.header, planes, ranks, threads);
  if (options.dry_run) {
    fmt::print("would write {}: {}, {}\n", files_text(work.header, output), size_text(work.header),
               objects_text(*work.job.scene));
    return std::nullopt;
  }
  if (options.verbose) {
    fmt::print(stderr, "gamer: {}, {} worker{}, SIMD {}\n", objects_text(*work.job.scene), workers,
               workers == 1 ? "" : "s", gamer::simd_target_name(gamer::current_simd_target()));
  }
  return work;
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

/// Renders and writes; every rank's part. Puts where its time went into `report`.
void render(const Options& options, const gamer::RenderJob& job, gamer::Executor& executor,
            Work* work, gamer::RankReport& report) {
  std::optional<gamer::DataTable> truth;
  if (options.truth) truth = gamer::truth_table(job, executor);
  const gamer::TruthImages images = options.truth ? job.parameters.truth : gamer::TruthImages();
  const gamer::Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum, images);
  std::unique_ptr<gamer::ImageWriter> writer;
  if (work != nullptr) {
    if (truth && options.truth_table.empty()) work->header.data_tables = {*truth};
    writer = make_writer(job, *work);
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
    progress.add(rows.size());
  };
  executor.run(gamer::render_blocks(renderer, executor.workers()), values_per_row, compute,
               consume);
  report.runs = executor.times();
  if (work == nullptr) return;
  const gamer::Clock clock;
  writer->finish();
  report.writing = report.runs.consume + clock.seconds();
  if (truth && !options.truth_table.empty()) {
    gamer::write_truth_table(options.truth_table, *truth);
  }
  if (!options.quiet) {
    fmt::print("{}: {}, {:.1f} s\n", files_text(work->header, job.parameters.output),
               size_text(work->header), progress.seconds());
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

/// Every rank's part of the run.
void run(const gamer::Ranks& ranks, int argc, char** argv) {
  const gamer::Clock clock;
  const Options options = parse_options(argc, argv);
  gamer::use_simd_targets(ranks.common_bits(gamer::supported_simd_targets()));
  const int threads = options.threads.value_or(ranks.size() == 1 ? gamer::available_cores() : 1);
  const std::unique_ptr<gamer::Executor> executor = ranks.executor(threads);

  std::optional<Work> work;
  if (ranks.rank() == 0) work = prepare(options, ranks.size(), threads);
  // An empty record: there is nothing to render.
  const std::string packed =
      ranks.broadcast(work ? gamer::pack_record(work->job.record) : std::string());
  if (packed.empty()) return;

  const gamer::RenderJob job =
      work ? std::move(work->job) : gamer::job_from_record(gamer::unpack_record(packed));
  gamer::RankReport report;
  report.threads = threads;
  render(options, job, *executor, work ? &*work : nullptr, report);
  if (!options.verbose) return;
  report.wall = clock.seconds();
  report.peak_memory = gamer::peak_memory();
  say_where_the_time_went(ranks, report, job.camera);
}

/// The one place where errors are reported.
int run_and_report(gamer::Ranks& ranks, int argc, char** argv) {
  const auto report = [](const std::string& message) { fmt::print(stderr, "{}\n", message); };
  try {
    run(ranks, argc, argv);
    return ranks.end(done);
  } catch (const gamer::Stopped& stopped) {
    return ranks.end(stopped.code);
  } catch (const InputError& error) {
    return ranks.end(wrong_input, error.what(), report);
  } catch (const gamer::RunError& error) {
    return ranks.end(failed, error.what(), report);
  } catch (const std::bad_alloc&) {
    return ranks.end(failed, "gamer: out of memory", report);
  } catch (const std::exception& error) {
    return ranks.end(failed, fmt::format("gamer: {}", error.what()), report);
  }
}

}  // namespace

int main(int argc, char** argv) {
  gamer::clean_up_on_signals();
  try {
    gamer::Ranks ranks(&argc, &argv);
    return run_and_report(ranks, argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "gamer: {}\n", error.what());
    return failed;
  }
}
