#include "gamer/job/image_task.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <new>
#include <span>
#include <system_error>

#include "core/message.h"
#include "gamer/core/clock.h"
#include "gamer/image/fits/checksums.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/new_file.h"
#include "gamer/job/schedule.h"
#include "gamer/job/star_table.h"
#include "gamer/job/star_tone.h"
#include "gamer/job/truth_table.h"
#include "image/output_file.h"
#include "image/private_folder.h"
#include "image/standard_stream.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// Device and number of a file; a link counts as the file that it leads to.
std::optional<std::pair<std::uint64_t, std::uint64_t>> identity(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return std::nullopt;
  return std::pair<std::uint64_t, std::uint64_t>(status.st_dev, status.st_ino);
}

/// The destination of the truth, which is an option and no parameter.
std::string truth_text(const JobOptions& options) {
  if (!options.truth) return "";
  return options.truth_table.empty() ? "in the image" : "in " + options.truth_table.string();
}

/// Counts rows as computed now or as taken from the journal.
void add(int done, const JournaledExecutor& executor, Progress& progress) {
  if (executor.is_replaying()) {
    progress.skip(done);
  } else {
    progress.add(done);
  }
}

TruthSettings truth_images(const RenderJob& job, const JobOptions& options) {
  return options.truth ? job.parameters.truth : TruthSettings();
}

/// The blocks of a renderer's rows; every rank calls this function. Its time counts as set-up, so
/// that it is added to `before`, the executor's times that do not belong to the render.
std::vector<RowRange> blocks_of(const Renderer& renderer, Executor& executor, RunTimes& before) {
  const RunTimes begin = executor.times();
  std::vector<RowRange> blocks = render_blocks(renderer, executor);
  before += executor.times() - begin;
  return blocks;
}

/// Renders the blocks; every rank calls this function. Rank 0 calls `consume` with each block. A
/// block's values are its pixels, then a number for each row. These numbers add up to the block's
/// unconverged rays.
void run(const Renderer& renderer, std::span<const RowRange> blocks, Executor& executor,
         const Executor::Consume& consume, RankReport& report) {
  const auto pixels_per_row =
      static_cast<std::size_t>(renderer.width()) * static_cast<std::size_t>(renderer.planes());
  std::mutex mutex;
  const auto compute = [&](RowRange rows, std::span<double> values) {
    RenderCounts counts;
    const auto count = static_cast<std::size_t>(rows.size());
    renderer.render_rows(rows, values.first(count * pixels_per_row), counts);
    std::fill_n(values.end() - rows.size(), rows.size(), 0.0);
    values.back() = static_cast<double>(counts.unconverged_rays);
    const std::lock_guard lock(mutex);
    report.counts += counts;
  };
  executor.run(blocks, pixels_per_row + 1, compute, consume);
}

}  // namespace

std::string files_text(const OutputOptions& output, const ImageHeader& header) {
  const auto files = output_files(output, header);
  const std::string more =
      files.size() > 1 ? fmt::format(" and {} more", files.size() - 1) : std::string();
  return output_label(files.front()) + more;
}

std::string size_text(const ImageHeader& header) {
  std::string size = fmt::format("{} x {}", header.width, header.height);
  if (!header.faces.empty()) {
    size = fmt::format("{} x {} x {}", header.faces.size(), header.width, header.width);
  } else if (header.healpix) {
    size = fmt::format("12 x {0} x {0}", header.healpix->nside);
  }
  return fmt::format("{} pixels, {} plane{}", size, header.planes(),
                     header.planes() == 1 ? "" : "s");
}

std::string objects_text(const Scene& scene) {
  const std::size_t galaxies = scene.galaxies.size(), stars = scene.stars.size();
  std::string text = fmt::format("{} galax{}", galaxies, galaxies == 1 ? "y" : "ies");
  if (stars > 0) text += fmt::format(", {} star{}", stars, stars == 1 ? "" : "s");
  if (scene.objects < scene.rows) text += fmt::format(" of {} rows", scene.rows);
  if (scene.flagged > 0) {
    text += fmt::format("; {} row{} with flagged values left out", scene.flagged,
                        scene.flagged == 1 ? "" : "s");
  }
  if (scene.objects + scene.flagged < scene.rows) {
    text += fmt::format("; the others do not touch the {}", scene.probes ? "region" : "image");
  }
  return text;
}

std::vector<fs::path> result_files(const RenderParameters& parameters, const JobOptions& options,
                                   const ImageHeader& image, const ImageHeader& truth) {
  std::vector<fs::path> files = output_files(parameters.image.output, image);
  if (truth.planes() > 0) {
    const auto more = output_files(truth_output(parameters), truth);
    files.insert(files.end(), more.begin(), more.end());
  }
  if (!options.truth_table.empty()) files.push_back(options.truth_table);
  return files;
}

void check_undamaged(const RenderParameters& parameters, const JobOptions& options,
                     const ImageHeader& image, const ImageHeader& truth) {
  const int extra =
      (options.truth && options.truth_table.empty() ? 1 : 0) + (parameters.stars.table ? 1 : 0);
  const auto check = [](const OutputOptions& output, const ImageHeader& header, int tables) {
    const int hdus = fits_hdus(output, header) + tables;
    for (const fs::path& file : output_files(output, header)) check_sums(file, hdus);
  };
  try {
    check(parameters.image.output, image, extra);
    if (truth.planes() > 0) check(truth_output(parameters), truth, 0);
    // The table follows an empty primary HDU.
    constexpr int table_hdus = 2;
    if (!options.truth_table.empty()) check_sums(options.truth_table, table_hdus);
  } catch (const InputError& error) {
    throw input_error("{}; --overwrite starts anew", error.what());
  }
}

ImageHeader wanted_truth_header(const RenderJob& job, const JobOptions& options) {
  return options.truth && job.parameters.truth.any() ? make_truth_header(job) : ImageHeader();
}

std::string hindrance(const OutputOptions& output, const JobOptions& options,
                      const std::vector<fs::path>& files) {
  if (output.overwrite) return "";
  const fs::path journal = journal_path(output);
  if (!options.resume && is_there(journal)) {
    if (Journal::is_in_use(journal)) {
      return fmt::format(
          "output '{}': a job that is running makes it; 'gamer --status {}' tells how far it is",
          output.path.string(), journal.string());
    }
    return fmt::format(
        "output '{}': '{}' holds finished rows of a job that was interrupted; --resume goes on "
        "with it, --overwrite starts anew",
        output.path.string(), journal.string());
  }
  try {
    for (const fs::path& file : files) {
      if (is_there(file)) check_new_file(file, false);
    }
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void check_outputs(const RenderParameters& parameters, const ImageHeader& image,
                   const ImageHeader& truth) {
  check_output(parameters.image.output, image);
  if (truth.planes() > 0) check_output(truth_output(parameters), truth);
}

InputFiles::InputFiles(const RenderJob& job) {
  for (const fs::path& file : job.input_files) {
    if (const auto id = identity(file)) files_.try_emplace(*id, file);
  }
}

void InputFiles::check_outputs(const std::vector<fs::path>& files) const {
  for (const fs::path& file : files) {
    const auto id = identity(file);
    const auto found = id ? files_.find(*id) : files_.end();
    if (found == files_.end()) continue;
    throw input_error(
        "output '{}': this is the file '{}', from which the job is made; choose another output",
        file.string(), found->second.string());
  }
}

bool are_there(const std::vector<fs::path>& files) { return std::ranges::all_of(files, is_there); }

ImageTask::ImageTask(RenderJob job, JobOptions options, int ranks, int threads,
                     std::unique_ptr<Journal> earlier)
    : job_(std::move(job)), options_(std::move(options)) {
  if (earlier) go_on(std::move(earlier));
  header_ = make_image_header(job_);
  truth_header_ = wanted_truth_header(job_, options_);
  RenderParameters parameters = job_.parameters;
  InputFiles(job_).check_outputs(files());
  check_output_suffix(parameters.image.output);
  if (options_.resume && !journal_ && !parameters.image.output.overwrite && are_there(files())) {
    check_undamaged(parameters, options_, header_, truth_header_);
    check_same_job(files().front(), job_.record);
    is_complete_ = true;
    return;
  }
  if (!is_stream()) hindrance_ = gamer::hindrance(parameters.image.output, options_, files());
  parameters.image.output.overwrite = true;
  check_outputs(parameters, header_, truth_header_);
  if (options_.truth) check_truth_table(options_.truth_table, parameters.image.output);
  if (!options_.dry_run && !hindrance_.empty()) throw InputError(hindrance_);
  check_row_memory(header_, header_.planes() + truth_header_.planes(), ranks, threads);
}

/// Continues the journal's job, after a check that it is this job.
void ImageTask::go_on(std::unique_ptr<Journal> journal) {
  check_same_job(journal->head(), make_journal_head(job_, truth_text(options_)),
                 journal->path().string());
  job_.record = journal->head().record;
  date_ = journal->head().date;
  // Once the journal has its end entry, files of these names are this job's.
  if (journal->head().overwrite || journal->has_end())
    job_.parameters.image.output.overwrite = true;
  journal_ = std::move(journal);
}

bool ImageTask::is_stream() const { return job_.parameters.image.output.path == standard_stream; }

void ImageTask::complete(const Ranks& ranks, int threads, Progress::Style style) {
  GalaxyProgress progress(style);
  // An estimate needs no pixels of the image.
  if (options_.dry_run) job_.pending.star_tone = false;
  job_.pending.truth = options_.truth;
  job_.pending.progress = progress.counter();
  gamer::complete(job_, ranks, threads);
}

JournalPlan ImageTask::journal_plan() const {
  std::error_code error;
  return {files_text(job_.parameters.image.output, header_),
          size_text(header_),
          job_.camera.window().height,
          options_.truth ? static_cast<int>(job_.scene->objects) : 0,
          begun_,
          fs::current_path(error).string(),
          options_.resume_command};
}

void ImageTask::begin() {
  const fs::path path = journal_path(job_.parameters.image.output);
  // A process killed while it began its journal may have left unfinished files beside it.
  if (!is_stream()) PrivateFolder::remove_left_behind(path);
  if (!journal_) {
    if (!is_stream()) Journal::discard(path);
    JournalHead head = make_journal_head(job_, truth_text(options_));
    head.plan = journal_plan();
    date_ = head.date;
    if (!is_stream() && !std::isinf(options_.journal_interval)) {
      journal_ = std::make_unique<Journal>(path, head, options_.journal_interval);
    }
  }
  for (ImageHeader* header : {&header_, &truth_header_}) {
    header->cards.push_back({"DATE", date_, "time of writing (UTC)"});
  }
}

std::string ImageTask::resume_hint() const {
  return fmt::format("; finished rows are kept in {}; go on with: {}", journal_->path().string(),
                     options_.resume_command);
}

std::vector<fs::path> ImageTask::files() const {
  return result_files(job_.parameters, options_, header_, truth_header_);
}

/// The writer of the image and, if the job has truth images, of these.
std::unique_ptr<ImageWriter> ImageTask::make_writer() const {
  auto image =
      make_image_writer(toned_output(job_.parameters.image.output, job_.parameters), header_);
  const int extra = truth_header_.planes();
  if (extra == 0) return image;
  const int planes = header_.planes();
  return make_split_writer(std::move(image), planes,
                           make_image_writer(truth_output(job_.parameters), truth_header_),
                           planes + extra, header_.width);
}

/// Gives the files their names. Once the journal has its end entry, files of these names are the
/// job's.
void ImageTask::finish(ImageWriter& writer, const std::optional<DataTable>& truth) {
  if (journal_ && std::ranges::none_of(files(), is_there)) journal_->add_end();
  writer.add_cards(shortfall_cards(unconverged_rays_));
  writer.finish();
  if (truth && !options_.truth_table.empty()) {
    write_truth_table(options_.truth_table, *truth, date_);
  }
  if (journal_) journal_->remove();
}

DataTable ImageTask::describe_objects(JournaledExecutor& executor, Progress::Style style) const {
  Progress progress(static_cast<int>(job_.scene->objects), "objects of TRUTH", style, stderr);
  return truth_table(job_, executor, [&](int objects) { add(objects, executor, progress); });
}

/// The table takes two runs. Their sections of the journal follow the image's section.
DataTable ImageTask::find_stars(const Renderer& renderer, JournaledExecutor& executor,
                                Progress::Style style) const {
  Progress progress(renderer.height(), "rows of STARS", style, stderr);
  const int image_section = executor.next_section();
  executor.go_to(image_section + 1);
  DataTable table =
      star_table(job_, renderer, executor, [&](int rows) { add(rows, executor, progress); });
  executor.go_to(image_section);
  return table;
}

void ImageTask::render_rows(Executor& executor, Progress::Style style, RankReport& report) {
  JournaledExecutor journaled(executor, journal_.get());
  RunTimes before = executor.times();
  std::optional<DataTable> truth;
  if (options_.truth) truth = describe_objects(journaled, style);
  const Renderer renderer = image_renderer(job_, truth_images(job_, options_));
  const auto blocks = blocks_of(renderer, executor, before);
  if (truth && options_.truth_table.empty()) header_.data_tables.push_back(*truth);
  if (job_.parameters.stars.table) {
    const RunTimes begin = executor.times();
    header_.data_tables.push_back(find_stars(renderer, journaled, style));
    before += executor.times() - begin;
  }
  const std::unique_ptr<ImageWriter> writer = make_writer();
  Progress progress(renderer.height(), "rows", style, stderr);
  const bool is_single = is_single_precision(job_.parameters.image.output);
  journaled.keep_single(is_single);
  const std::size_t row_size = static_cast<std::size_t>(renderer.width()) * renderer.planes();
  const std::size_t image_size = static_cast<std::size_t>(renderer.width()) * header_.planes();
  is_dark_ = true;
  unconverged_rays_ = job_.unconverged_rays;
  report.layer_counts += job_.layer_counts;
  run(
      renderer, blocks, journaled,
      [&](RowRange rows, std::span<const double> all) {
        const auto values = all.first(static_cast<std::size_t>(rows.size()) * row_size);
        for (const double rays : all.subspan(values.size())) unconverged_rays_ += rays;
        writer->write_rows(rows.first, rows.size(), values);
        for (std::size_t row = 0; is_dark_ && row < values.size(); row += row_size) {
          is_dark_ = !has_light(values.subspan(row, image_size), is_single);
        }
        add(rows.size(), journaled, progress);
      },
      report);
  const RunTimes times = executor.times() - before;
  report.runs += times;
  const Clock clock;
  finish(*writer, truth);
  report.writing += times.consume + clock.seconds();
  replayed_rows_ = progress.skipped();
}

void ImageTask::render(Executor& executor, Progress::Style style, RankReport& report) {
  const auto fail = [&](const std::string& message) {
    throw RunError(message + (journal_ && journal_->is_begun() ? resume_hint() : ""));
  };
  try {
    render_rows(executor, style, report);
  } catch (const RunError& error) {
    fail(error.what());
  } catch (const std::bad_alloc&) {
    fail("gamer: out of memory");
  }
}

FinishedWork ImageTask::finished() const {
  return journal_ ? journal_->finished_work() : FinishedWork();
}

std::string ImageTask::finished_text() const {
  if (!journal_) return "";
  const FinishedWork work = journal_->finished_work();
  std::string text =
      fmt::format("; {} of {} rows", count_rows(work.rows), job_.camera.window().height);
  if (options_.truth) {
    text += fmt::format(" and {} of {} objects of TRUTH", work.objects, job_.scene->objects);
  }
  return text + " are in the journal";
}

std::string ImageTask::plan() const {
  return fmt::format("{}: {}", files_text(job_.parameters.image.output, header_),
                     size_text(header_));
}

std::string ImageTask::shortfall() const {
  if (unconverged_rays_ == 0) return "";
  return shortfall_warning(files_text(job_.parameters.image.output, header_), unconverged_rays_);
}

std::string ImageTask::text(double seconds) const {
  if (is_complete_) {
    return fmt::format("{}: complete already", files_text(job_.parameters.image.output, header_));
  }
  const std::string earlier =
      replayed_rows_ > 0 ? fmt::format(", {} rows from the journal", replayed_rows_) : "";
  const std::size_t flagged = job_.scene->flagged;
  const std::string left_out =
      flagged > 0 ? fmt::format(", {} flagged row{} left out", flagged, flagged == 1 ? "" : "s")
                  : "";
  return fmt::format("{}, {:.1f} s{}{}", plan(), seconds, earlier, left_out);
}

void help_render(const RenderJob& job, const JobOptions& options, Executor& executor,
                 RankReport& report) {
  RunTimes before = executor.times();
  if (options.truth) truth_table(job, executor);
  const Renderer renderer = image_renderer(job, truth_images(job, options));
  const auto blocks = blocks_of(renderer, executor, before);
  if (job.parameters.stars.table) {
    const RunTimes begin = executor.times();
    star_table(job, renderer, executor);
    before += executor.times() - begin;
  }
  report.layer_counts += job.layer_counts;
  run(renderer, blocks, executor, {}, report);
  report.runs += executor.times() - before;
}

}  // namespace gamer
