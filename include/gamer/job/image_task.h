#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/image/data_table.h"
#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"
#include "gamer/job/job.h"
#include "gamer/job/journal.h"
#include "gamer/job/progress.h"
#include "gamer/job/report.h"
#include "gamer/job/resume.h"
#include "gamer/job/warnings.h"
#include "gamer/parallel/executor.h"

namespace gamer {

/// How a job is done. None of these options changes the image.
struct JobOptions {
  bool truth = false;                 ///< table TRUTH and the images of [truth]
  std::filesystem::path truth_table;  ///< the table's own file; empty: into the image's
  bool overwrite = false;             ///< existing files are replaced
  /// Goes on with a journal, and leaves what is complete as it is.
  bool resume = false;
  bool dry_run = false;          ///< checks only; what exists already is no error
  double journal_interval = 10;  ///< seconds, see Journal; infinite: none is kept
  std::string resume_command;    ///< goes on with the job; for messages
};

/// "x.fits", or "x_4400A.fits and 2 more".
std::string files_text(const OutputOptions& output, const ImageHeader& header);
/// "512 x 512 pixels, 3 planes".
std::string size_text(const ImageHeader& header);
/// "2 galaxies, 1 star".
std::string objects_text(const Scene& scene);

/// All files that a job with these parameters makes. `truth` is the header of the truth images,
/// without planes where there are none.
std::vector<std::filesystem::path> result_files(const RenderParameters& parameters,
                                                const JobOptions& options, const ImageHeader& image,
                                                const ImageHeader& truth);
/// Checks these existing files by check_sums(). Throws InputError where one is damaged.
void check_undamaged(const RenderParameters& parameters, const JobOptions& options,
                     const ImageHeader& image, const ImageHeader& truth);
/// make_truth_header(), or an empty one where no truth images are asked for.
ImageHeader wanted_truth_header(const RenderJob& job, const JobOptions& options);
/// The reason why files may not be made with these options: one exists, or a journal holds rows of
/// them. Empty where nothing hinders.
std::string hindrance(const OutputOptions& output, const JobOptions& options,
                      const std::vector<std::filesystem::path>& files);
/// What check_output() does, for the image and its truth images.
void check_outputs(const RenderParameters& parameters, const ImageHeader& image,
                   const ImageHeader& truth);
/// Throws InputError when a file that a job is to make is one that it has read, under whatever
/// name. Also where files may be replaced: who asks for that has mistaken the name.
class InputFiles {
 public:
  explicit InputFiles(const RenderJob& job);
  void check_outputs(const std::vector<std::filesystem::path>& files) const;

 private:
  /// The files by device and number.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::filesystem::path> files_;
};
/// Whether all files exist.
bool are_there(const std::vector<std::filesystem::path>& files);

/// A job with its files, as rank 0 has it.
class ImageTask {
 public:
  /// Checks all that can be known beforehand. `earlier` is the journal to go on with, or null.
  /// Throws InputError.
  ImageTask(RenderJob job, JobOptions options, int ranks, int threads,
            std::unique_ptr<Journal> earlier);

  const RenderJob& job() const { return job_; }
  /// Whether the job is to be resumed and complete already, so that there is nothing to do.
  bool is_complete() const { return is_complete_; }
  /// Says after a dry run why the job itself would not begin; empty where it would.
  const std::string& hindrance() const { return hindrance_; }
  /// Completes the job, before rendering.
  void complete(const Ranks& ranks, int threads);
  /// Makes the journal of a job that begins, in place of an older one. It follows complete().
  void begin();
  /// The journal; null where none is kept.
  Journal* journal() const { return journal_.get(); }
  /// "; finished rows are kept in x.fits.journal; go on with: ...".
  std::string resume_hint() const;

  /// Renders with all ranks and completes the files; adds where the time went to `report`. Throws
  /// InputError, RunError, which says how to go on.
  void render(Executor& executor, Progress::Style style, RankReport& report);
  /// What the journal of an earlier run holds.
  FinishedWork finished() const;
  /// Tells of it: "; 128 of 512 rows are in the journal"; empty where there is no journal.
  std::string finished_text() const;
  /// What is to be made: "x.fits: 512 x 512 pixels, 1 plane".
  std::string plan() const;
  /// Why the image that was made has no light; empty where it has some.
  std::string darkness() const { return is_dark_ ? darkness_warning(job_) : ""; }
  /// Number of the image's rays that a bound kept from the tolerance.
  double unconverged_rays() const { return unconverged_rays_; }
  /// A warning about such rays; empty where there are none.
  std::string shortfall() const;
  /// What was made in so many seconds: "x.fits: 512 x 512 pixels, 1 plane, 2.3 s".
  std::string text(double seconds) const;

 private:
  void go_on(std::unique_ptr<Journal> journal);
  JournalPlan journal_plan() const;
  std::vector<std::filesystem::path> files() const;
  std::unique_ptr<ImageWriter> make_writer() const;
  DataTable describe_objects(JournaledExecutor& executor, Progress::Style style) const;
  void finish(ImageWriter& writer, const std::optional<DataTable>& truth);
  void render_rows(Executor& executor, Progress::Style style, RankReport& report);

  RenderJob job_;
  JobOptions options_;
  ImageHeader header_;
  ImageHeader truth_header_;
  std::string date_;  ///< DATE of the files
  std::time_t begun_ = std::time(nullptr);
  std::unique_ptr<Journal> journal_;
  bool is_complete_ = false;
  bool is_dark_ = false;
  double unconverged_rays_ = 0;
  std::string hindrance_;
  int replayed_rows_ = 0;
};

/// The other ranks' part of ImageTask::render().
void help_render(const RenderJob& job, const JobOptions& options, Executor& executor,
                 RankReport& report);

}  // namespace gamer
