#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/job/job.h"
#include "gamer/job/record.h"
#include "gamer/parallel/executor.h"
#include "gamer/scene/animation.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/galaxy_library.h"

namespace gamer {

/// Makes the jobs of an animation's frames. What no camera changes is made once: the catalogue and
/// the galaxies, with the statistics of their noise. Not for several threads at a time.
class FrameJobs {
 public:
  /// From the record of the whole animation. Throws InputError.
  explicit FrameJobs(const Record& animation);
  /// Takes the galaxies of the animation's job, which need not be complete.
  explicit FrameJobs(const RenderJob& animation);
  FrameJobs(const FrameJobs&) = delete;
  FrameJobs& operator=(const FrameJobs&) = delete;

  /// Measures the animation's galaxies, where they are not yet, with all ranks: each of them calls
  /// it, before any makes a frame's job.
  void measure(const Ranks& ranks);

  /// The job of a frame with these parameters (see frame_parameters()). It is the job that
  /// rendering the frame alone would make. Throws InputError.
  RenderJob make(RenderParameters parameters);

  const Record& record() const { return record_; }
  /// Parameters of the animation.
  const RenderParameters& parameters() const { return parameters_; }

 private:
  Record record_;
  RenderParameters parameters_;
  Resources resources_;
  Resources::Text list_;
  std::optional<Resources::Text> columns_;  ///< recorded_columns of the animation
  Catalogue catalogue_;                     ///< views of list_
  GalaxyLibrary library_;
  std::vector<std::shared_ptr<Galaxy>> unmeasured_;
};

/// Throws InputError where an image that is there already is not this frame's; BMP pictures do not
/// tell. A frame's tone may be what the animation leaves open: it is returned.
std::optional<std::array<double, 8>> check_same_frame(const std::filesystem::path& image,
                                                      const Record& animation,
                                                      RenderParameters parameters);

/// The number of frames that each rank should render on its own: as many as share out evenly. All
/// ranks share the rows of the other frames.
int frames_apart(int frames, int ranks);

/// The tone (PictureTone::numbers()) of a frame's picture, from a picture of a quarter of its size
/// on each side; on rank 0. Every rank calls it.
std::array<double, 8> frame_tone(FrameJobs& jobs, RenderParameters parameters, Executor& executor);

}  // namespace gamer
