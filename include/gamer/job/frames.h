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

/// A maker of the jobs of an animation's frames. Frames share the catalogue and the galaxies, with
/// the statistics of their noise, which are made once. One thread at a time may use it.
class FrameJobs {
 public:
  /// Reads the record of the whole animation. Throws InputError if the record makes no job.
  explicit FrameJobs(const Record& animation);
  /// Takes the galaxies of the animation's job, which need not be complete.
  explicit FrameJobs(const RenderJob& animation);
  FrameJobs& operator=(FrameJobs&&) = delete;

  /// Measures the animation's galaxies with all ranks, if this was not done yet. Every rank calls
  /// this function before any rank makes a frame's job.
  void measure(const Ranks& ranks);

  /// The job of a frame with these parameters (see frame_parameters()), equal to the job of the
  /// frame rendered alone. Throws InputError if the scene does not suit the parameters.
  RenderJob make(RenderParameters parameters);

  const Record& record() const { return record_; }
  /// Parameters of the animation.
  const RenderParameters& parameters() const { return parameters_; }

 private:
  Record record_;
  RenderParameters parameters_;
  Resources resources_;
  Resources::Text list_;
  std::optional<Resources::Text> columns_;  ///< text recorded_columns of the animation
  Catalogue catalogue_;                     ///< views of list_
  GalaxyLibrary library_;
  std::vector<std::shared_ptr<Galaxy>> unmeasured_;
};

/// Throws InputError if an existing image does not belong to this frame; BMP pictures cannot be
/// checked. Returns the image's tone if the animation does not set the tone.
std::optional<std::array<double, 8>> check_same_frame(const std::filesystem::path& image,
                                                      const Record& animation,
                                                      RenderParameters parameters);

/// The number of frames that ranks render alone: as many for each rank, and as many as possible.
/// All ranks share the rows of the other frames.
int frames_apart(int frames, int ranks);

/// The tone (PictureTone::numbers()) of a frame's picture, on rank 0. The tone is measured on a
/// picture of a quarter of the size on each side. Every rank calls this function.
std::array<double, 8> frame_tone(FrameJobs& jobs, RenderParameters parameters, Executor& executor);

}  // namespace gamer
