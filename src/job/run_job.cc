#include "gamer/job/run_job.h"

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/core/clock.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/resources.h"
#include "gamer/core/simd.h"
#include "gamer/job/calibration_cache.h"
#include "gamer/job/estimate.h"
#include "gamer/job/film.h"
#include "gamer/job/journal.h"
#include "gamer/job/progress.h"
#include "gamer/job/report.h"
#include "gamer/job/resume.h"
#include "gamer/job/stamps.h"
#include "gamer/job/warnings.h"
#include "image/standard_stream.h"

namespace gamer {
namespace {

Progress::Style progress_style(const MessageLog& log) {
  if (log.is_quiet()) return Progress::Style::none;
  return log.format() == MessageLog::Format::json ? Progress::Style::json
                                                  : Progress::style_for(stderr);
}

/// The journal of an earlier run of this job; null when there is none.
std::unique_ptr<Journal> find_journal(const RunOptions& options) {
  Resources resources = open_resources(options.request, default_data_folders());
  const RenderParameters parameters = load_parameters(options.request, resources);
  return Journal::open(journal_path(parameters.image.output), options.work.journal_interval);
}

/// Work of rank 0: an image, a film, stamps, or nothing if all is done.
struct Task {
  std::unique_ptr<ImageTask> work;
  std::unique_ptr<Film> film;
  std::unique_ptr<StampTask> stamps;
};

void tell_size_of_work(const MessageLog& log, const RenderJob& job, int workers) {
  log.info(fmt::format("{}, {} worker{}, SIMD {}", objects_text(*job.scene), workers,
                       workers == 1 ? "" : "s", simd_target_name(current_simd_target())));
}

void tell_estimate(const MessageLog& log, const JobEstimate& estimate, int ranks, int threads,
                   const std::string& hindrance) {
  log.answer(estimate_text(estimate, ranks, threads));
  if (!hindrance.empty()) log.answer(hindrance);
}

Task prepare_image(const RunOptions& options, const MessageLog& log, RenderJob job, int ranks,
                   int threads, std::unique_ptr<Journal> earlier) {
  auto work =
      std::make_unique<ImageTask>(std::move(job), options.work, ranks, threads, std::move(earlier));
  if (work->is_complete()) {
    log.result(work->text(0));
    return {};
  }
  if (options.work.dry_run) {
    log.answer(fmt::format("would write {}, {}{}", work->plan(), objects_text(*work->job().scene),
                           work->finished_text()));
    Preparation preparation{process_seconds(), 0};
    work->complete(Ranks(), threads, Progress::Style::none);
    preparation.measuring = process_seconds() - preparation.reading;
    tell_estimate(log,
                  estimate_job(work->job(), options.work.truth, ranks, threads, preparation,
                               work->finished()),
                  ranks, threads, work->hindrance());
    return {};
  }
  if (options.verbose) tell_size_of_work(log, work->job(), ranks * threads);
  return {std::move(work), nullptr, nullptr};
}

Task prepare_stamps(const RunOptions& options, const MessageLog& log, RenderJob job, int ranks,
                    int threads) {
  auto stamps = std::make_unique<StampTask>(std::move(job), options.work, ranks, threads);
  if (options.work.dry_run) {
    log.answer(
        fmt::format("would write {}, {}", stamps->plan(), objects_text(*stamps->job().scene)));
    Preparation preparation{process_seconds(), 0};
    stamps->complete(Ranks(), threads, Progress::Style::none);
    preparation.measuring = process_seconds() - preparation.reading;
    tell_estimate(log,
                  estimate_stamps(stamps->job(), options.work.truth, ranks, threads, preparation),
                  ranks, threads, stamps->hindrance());
    return {};
  }
  if (options.verbose) tell_size_of_work(log, stamps->job(), ranks * threads);
  return {nullptr, nullptr, std::move(stamps)};
}

Task prepare_film(const RunOptions& options, const MessageLog& log, const RenderJob& job, int ranks,
                  int threads) {
  auto film = std::make_unique<Film>(job, options.work, ranks, threads);
  if (const auto later = film->later_files(); !later.empty()) {
    const std::string files =
        later.size() == 1
            ? "is a frame of a longer film and stays"
            : fmt::format("and {} more are frames of a longer film and stay", later.size() - 1);
    log.info(fmt::format("{} {}: this one ends with frame {}", later.front().string(), files,
                         film->frames()));
  }
  if (film->left().empty()) {
    log.result(fmt::format("{}: complete already", film->names()));
    return {};
  }
  if (options.work.dry_run) {
    log.answer(fmt::format("would write {}: {} of {} frames, {}, {}{}", film->names(),
                           film->left().size(), film->frames(), film->size(),
                           objects_text(*job.scene), film->finished_text()));
    tell_estimate(log, film->estimate(ranks, threads, process_seconds()), ranks, threads,
                  film->hindrance());
    return {};
  }
  if (options.verbose) tell_size_of_work(log, job, ranks * threads);
  return {nullptr, std::move(film), nullptr};
}

void warn_of(const RunOptions& options, const MessageLog& log, const RenderJob& job) {
  // Previews have one ray per pixel and are not measured, so that they need no warnings.
  if (log.is_quiet() || options.request.preview) return;
  for (const std::string& text : job_warnings(job)) log.warning(text);
}

bool is_to_standard_output(const RenderJob& job) {
  return job.parameters.image.output.path == standard_stream;
}

/// Throws InputError for what standard output cannot hold.
void check_stream(const RunOptions& options, const RenderJob& job, int ranks) {
  const auto fail = [](const char* what) { throw input_error("gamer: output '-': {}", what); };
  // Launchers may give a terminal to ranks.
  if (ranks > 1) fail("several ranks need a file");
  if (options.work.resume) fail("nothing is kept to resume; give a file");
  if (makes_stamps(job.parameters)) fail("stamps need a file");
  if (job.parameters.animation.frames > 0) fail("a film has a file for each frame");
  if (options.work.truth && job.parameters.truth.any() && job.parameters.truth.path.empty()) {
    fail("the images of [truth] need truth.output");
  }
}

/// On rank 0: reads and checks everything.
Task prepare(const RunOptions& options, const MessageLog& log, int ranks, int threads,
             std::unique_ptr<Journal> earlier) {
  Resources resources = open_resources(options.request, default_data_folders());
  if (options.print_config) {
    fmt::print("{}", load_parameters(options.request, resources).toml());
    return {};
  }
  if (options.print_mapping) {
    fmt::print("{}", mapping_text(options.request, resources));
    return {};
  }
  RenderJob job = read_job(options.request, resources);
  if (job.parameters.truth.path == standard_stream) {
    throw InputError("gamer: truth.output '-': the images of [truth] need a file");
  }
  if (is_to_standard_output(job)) check_stream(options, job, ranks);
  warn_of(options, log, job);
  if (makes_stamps(job.parameters)) {
    return prepare_stamps(options, log, std::move(job), ranks, threads);
  }
  if (job.parameters.animation.frames > 0) return prepare_film(options, log, job, ranks, threads);
  return prepare_image(options, log, std::move(job), ranks, threads, std::move(earlier));
}

/// The record of an image for ranks that write no file. It lacks the recorded columns, since only
/// rank 0 makes table SCENE.
std::string pack_for_ranks(Record record) {
  std::erase_if(record, [](const Resources::Text& text) { return text.name == recorded_columns; });
  return pack_record(record);
}

/// Makes later signals print how the job can be continued.
void announce(const MessageLog& log, const ImageTask& work) {
  if (work.journal() == nullptr) return;
  const std::string hint = work.resume_hint();
  if (work.journal()->is_begun()) {
    log.say_when_stopped(hint);
  } else {
    work.journal()->when_begun([&log, hint] { log.say_when_stopped(hint); });
  }
}

/// Every rank calls it. `pixels` are those of all images.
void say_where_the_time_went(const Ranks& ranks, const MessageLog& log, const RankReport& mine,
                             double pixels) {
  std::vector<RankReport> reports;
  for (const std::string& packed : ranks.gather(pack_report(mine))) {
    reports.push_back(unpack_report(packed));
  }
  log.table(report_text(reports, pixels));
}

/// Rank 0 calls it for stamps. Returns their pixels. `clock` has run since the job began.
double run_stamps(const Ranks& ranks, const MessageLog& log, const Clock& clock, StampTask& stamps,
                  int threads, Executor& executor, RankReport& report) {
  stamps.complete(ranks, threads, progress_style(log));
  stamps.render(executor, progress_style(log), report);
  log.result(fmt::format("{}, {:.1f} s", stamps.plan(), clock.seconds()));
  if (const std::string text = stamps.shortfall(); !text.empty()) log.warning(text);
  return stamps.pixels();
}

/// Every rank calls it for an image, and ranks other than 0 for stamps. Returns the pixels of the
/// image. `clock` has run since the job began.
double run_image(const Ranks& ranks, const RunOptions& options, const MessageLog& log,
                 const Clock& clock, ImageTask* work, std::string packed, int threads,
                 Executor& executor, RankReport& report) {
  const auto pixels = [](const Camera& camera) {
    return static_cast<double>(camera.window().width) * camera.window().height;
  };
  if (ranks.rank() != 0) {
    RenderJob job = read_job(unpack_record(std::exchange(packed, {})));
    job.pending.truth = options.work.truth;
    complete(job, ranks, threads);
    if (makes_stamps(job.parameters)) {
      help_stamps(job, options.work, executor, report);
    } else {
      help_render(job, options.work, executor, report);
    }
    return pixels(job.camera);
  }
  packed.clear();
  packed.shrink_to_fit();
  work->complete(ranks, threads, progress_style(log));
  work->begin();
  announce(log, *work);
  work->render(executor, progress_style(log), report);
  const std::string made = work->text(clock.seconds());
  if (is_to_standard_output(work->job())) {
    log.info(made);
  } else {
    log.result(made);
  }
  if (!log.is_quiet()) {
    for (const std::string& text : {work->darkness(), work->shortfall()}) {
      if (!text.empty()) log.warning(text);
    }
  }
  return pixels(work->job().camera);
}

/// Every rank calls it. Returns the pixels of all frames.
double run_film(const Ranks& ranks, const RunOptions& options, const MessageLog& log,
                std::unique_ptr<Film> film, std::string packed, int threads, Executor& executor,
                RankReport& report) {
  if (film == nullptr) film = Film::unpack(packed, options.work);
  packed.clear();
  packed.shrink_to_fit();
  Film::Messages messages;
  messages.progress = progress_style(log);
  messages.say_when_stopped = [&log](const std::string& rest) { log.say_when_stopped(rest); };
  if (!log.is_quiet()) {
    messages.say = [&log](const std::string& line) { log.result(line); };
    messages.warn = [&log](const std::string& line) { log.warning(line); };
  }
  film->render(ranks, threads, executor, messages, report);
  return film->pixels();
}

}  // namespace

void run_job(const Ranks& ranks, const RunOptions& options, MessageLog& log) {
  const Clock clock;
  if (options.quiet) log.be_quiet();
  std::unique_ptr<Journal> earlier;
  std::int64_t simd_targets = supported_simd_targets();
  if (ranks.rank() == 0 && options.work.resume && !options.print_config && !options.print_mapping) {
    earlier = find_journal(options);
    if (earlier) simd_targets = journal_simd_targets(*earlier);
  }
  simd_targets = ranks.common_bits(simd_targets);
  if (simd_targets == 0) {
    throw InputError("gamer: a rank's machine has not the instructions of the journal's rows");
  }
  use_simd_targets(simd_targets);
  const int threads = options.threads.value_or(ranks.size() == 1 ? available_cores() : 1);
  use_threads(threads);
  const std::unique_ptr<Executor> executor = ranks.executor(threads);

  if (ranks.rank() == 0 && options.cache) use_calibration_cache(CalibrationCache::of_user());
  RankReport report;
  report.threads = threads;
  Task task;
  if (ranks.rank() == 0) task = prepare(options, log, ranks.size(), threads, std::move(earlier));
  std::string film = ranks.broadcast(task.film ? task.film->pack() : "");
  // A single process need not send the record.
  const RenderJob* const job = task.work     ? &task.work->job()
                               : task.stamps ? &task.stamps->job()
                                             : nullptr;
  const bool travels = job != nullptr && ranks.size() > 1;
  std::string image = ranks.broadcast(travels ? pack_for_ranks(job->record) : "");
  double pixels = 0;
  if (!film.empty()) {
    pixels = run_film(ranks, options, log, std::move(task.film), std::move(film), threads,
                      *executor, report);
  } else if (task.stamps) {
    pixels = run_stamps(ranks, log, clock, *task.stamps, threads, *executor, report);
  } else if (task.work || !image.empty()) {
    pixels = run_image(ranks, options, log, clock, task.work.get(), std::move(image), threads,
                       *executor, report);
  } else {
    return;
  }
  if (!options.verbose) return;
  report.wall = clock.seconds();
  report.peak_memory = peak_memory();
  say_where_the_time_went(ranks, log, report, pixels);
}

}  // namespace gamer
