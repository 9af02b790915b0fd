#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/image/stamp_writer.h"
#include "gamer/job/image_task.h"
#include "gamer/job/job.h"
#include "gamer/job/progress.h"
#include "gamer/job/report.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"

namespace gamer {

/// Whether a job makes stamps instead of an image.
bool makes_stamps(const RenderParameters& parameters);

/// The stamp of each object: pixels of the image, or beyond it, around the pixel of its centre.
/// Throws InputError if a centre has no pixel.
std::vector<ImageRegion> stamp_regions(const RenderJob& job);

/// The description of each stamp in these regions. `header` is the job's make_image_header().
std::vector<StampHeader> describe_stamps(const RenderJob& job, std::span<const ImageRegion> regions,
                                         const ImageHeader& header);

/// Renders the stamps of a scene's objects, each alone, on any rank. A block of an Executor's rows
/// is one stamp; its values are those of Renderer::render_rows(), then the number of unconverged
/// rays.
class StampRenderer {
 public:
  explicit StampRenderer(const RenderJob& job);

  std::size_t size() const { return regions_.size(); }
  const ImageRegion& region(std::size_t stamp) const { return regions_[stamp]; }
  /// Values of a stamp's pixels.
  std::size_t values(std::size_t stamp) const;
  /// The renderer of a stamp's pixels.
  Renderer renderer(std::size_t stamp) const;
  /// Memory of the largest stamp's values, bytes.
  std::size_t most_bytes() const;
  /// Renders all stamps; every rank calls this function. On rank 0 `take` gets the values of each
  /// stamp, and its number of rays that did not converge.
  using Take = std::function<void(std::size_t stamp, std::span<const double> values, double rays)>;
  void run(Executor& executor, const Take& take, RankReport& report) const;

 private:
  /// The scene of one object.
  std::shared_ptr<const Scene> alone(std::size_t object) const;

  const RenderJob& job_;
  std::vector<ImageRegion> regions_;
  std::vector<const PlacedGalaxy*> galaxies_;  ///< by object; null for stars
  std::vector<const PlacedStar*> stars_;
};

/// The number of values of a piece, at least 256, for which all stamps together have at most `most`
/// pieces. `values` has the number of values of each stamp; each stamp begins with a new piece.
std::size_t stamp_piece(std::span<const std::size_t> values, std::uint64_t most);

/// A job of stamps with its file, as rank 0 has it.
class StampTask {
 public:
  /// Checks everything that can be known beforehand. Throws InputError if the job cannot succeed.
  StampTask(RenderJob job, JobOptions options, int ranks, int threads);

  const RenderJob& job() const { return job_; }
  /// After a dry run, the reason why the job itself would not begin; empty if there is none.
  const std::string& hindrance() const { return hindrance_; }
  void complete(const Ranks& ranks, int threads, Progress::Style style);
  /// Renders with all ranks and completes the file. Throws RunError if a file cannot be written.
  void render(Executor& executor, Progress::Style style, RankReport& report);
  /// The planned output: "x.fits: 12 stamps of 15 to 101 pixels a side, 3 planes".
  std::string plan() const;
  /// A warning about rays that did not converge; empty where there are none.
  std::string shortfall() const;
  /// Pixels of all stamps.
  double pixels() const;

 private:
  /// Table TRUTH, if the job makes it.
  std::optional<DataTable> describe_objects(Executor& executor, Progress::Style style) const;

  RenderJob job_;
  JobOptions options_;
  ImageHeader header_;
  std::vector<ImageRegion> regions_;
  std::string hindrance_;
  double unconverged_rays_ = 0;
};

/// The work of ranks other than 0 during StampTask::render().
void help_stamps(const RenderJob& job, const JobOptions& options, Executor& executor,
                 RankReport& report);

}  // namespace gamer
