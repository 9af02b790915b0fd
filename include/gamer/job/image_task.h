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

/// The options of a job that do not change the image.
struct JobOptions {
  bool truth = false;                 ///< make table TRUTH and the images of [truth]
  std::filesystem::path truth_table;  ///< file of the table; empty: the image's file
  bool overwrite = false;             ///< replace existing files
  /// Continue from a journal, and keep complete files.
  bool resume = false;
  bool dry_run = false;          ///< check only; existing files are no error
  double journal_interval = 10;  ///< seconds, see Journal; infinite: no journal is kept
  std::string resume_command;    ///< command that continues the job, for messages
};

/// "x.fits", or "x_4400A.fits and 2 more".
std::string files_text(const OutputOptions& output, const ImageHeader& header);
/// "512 x 512 pixels, 3 planes".
std::string size_text(const ImageHeader& header);
/// "2 galaxies, 1 star".
std::string objects_text(const Scene& scene);

/// All files that a job with these parameters makes. `truth` is the header of the truth images; it
/// has no planes if there are none.
std::vector<std::filesystem::path> result_files(const RenderParameters& parameters,
                                                const JobOptions& options, const ImageHeader& image,
                                                const ImageHeader& truth);
/// Checks the existing files of a job by check_sums(). Throws InputError if a file is damaged.
void check_undamaged(const RenderParameters& parameters, const JobOptions& options,
                     const ImageHeader& image, const ImageHeader& truth);
/// make_truth_header(), or an empty header if no truth images are requested.
ImageHeader wanted_truth_header(const RenderJob& job, const JobOptions& options);
/// The reason why files may not be made with these options: a file exists, or a journal holds its
/// rows. The text is empty if there is no reason.
std::string hindrance(const OutputOptions& output, const JobOptions& options,
                      const std::vector<std::filesystem::path>& files);
/// check_output() for the image and its truth images.
void check_outputs(const RenderParameters& parameters, const ImageHeader& image,
                   const ImageHeader& truth);
/// A check that throws InputError if a job would overwrite one of its own input files, under any
/// name. It also applies with `overwrite`, since such a name is a mistake.
class InputFiles {
 public:
  explicit InputFiles(const RenderJob& job);
  void check_outputs(const std::vector<std::filesystem::path>& files) const;

 private:
  /// The input files, by device and inode number.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::filesystem::path> files_;
};
/// Whether all files exist.
bool are_there(const std::vector<std::filesystem::path>& files);

/// A job with its files, on rank 0.
class ImageTask {
 public:
  /// Checks everything that can be known beforehand. `earlier` is the journal to continue, or null.
  /// Throws InputError if the job cannot succeed.
  ImageTask(RenderJob job, JobOptions options, int ranks, int threads,
            std::unique_ptr<Journal> earlier);

  const RenderJob& job() const { return job_; }
  /// Whether the job is resumed and already complete, so that there is nothing to do.
  bool is_complete() const { return is_complete_; }
  /// After a dry run, the reason why the job itself would not begin; empty if there is none.
  const std::string& hindrance() const { return hindrance_; }
  /// Completes the job, before rendering.
  void complete(const Ranks& ranks, int threads, Progress::Style style);
  /// Makes the journal of a new job, in place of an older journal. Must follow complete().
  void begin();
  /// The journal; null if none is kept.
  Journal* journal() const { return journal_.get(); }
  /// "; finished rows are kept in x.fits.journal; go on with: ...".
  std::string resume_hint() const;

  /// Renders with all ranks and completes the files. Adds the times to `report`. Throws InputError,
  /// and RunError that says how to continue.
  void render(Executor& executor, Progress::Style style, RankReport& report);
  /// The contents of the journal of an earlier run.
  FinishedWork finished() const;
  /// "; 128 of 512 rows are in the journal"; empty if there is no journal.
  std::string finished_text() const;
  /// The planned output: "x.fits: 512 x 512 pixels, 1 plane".
  std::string plan() const;
  /// The reason why the finished image has no light; empty if it has light.
  std::string darkness() const { return is_dark_ ? darkness_warning(job_) : ""; }
  /// Number of the image's rays that did not reach the tolerance.
  double unconverged_rays() const { return unconverged_rays_; }
  /// A warning about these rays; empty if there are none.
  std::string shortfall() const;
  /// The finished output: "x.fits: 512 x 512 pixels, 1 plane, 2.3 s".
  std::string text(double seconds) const;

 private:
  void go_on(std::unique_ptr<Journal> journal);
  JournalPlan journal_plan() const;
  /// Whether the image goes to standard output, which has no journal.
  bool is_stream() const;
  std::vector<std::filesystem::path> files() const;
  std::unique_ptr<ImageWriter> make_writer() const;
  DataTable describe_objects(JournaledExecutor& executor, Progress::Style style) const;
  DataTable find_stars(const Renderer& renderer, JournaledExecutor& executor,
                       Progress::Style style) const;
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

/// The work of ranks other than 0 during ImageTask::render().
void help_render(const RenderJob& job, const JobOptions& options, Executor& executor,
                 RankReport& report);

}  // namespace gamer
