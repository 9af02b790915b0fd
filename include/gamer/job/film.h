#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/job/estimate.h"
#include "gamer/job/frames.h"
#include "gamer/job/image_task.h"
#include "gamer/job/progress.h"
#include "gamer/job/report.h"
#include "gamer/parallel/ranks.h"

namespace gamer {

/// The frames of an animation that must be rendered. Each frame has its own files, as if it were
/// rendered alone. Every rank has a Film.
class Film {
 public:
  /// Messages of a film on rank 0.
  struct Messages {
    std::function<void(const std::string& line)> say;  ///< called for each finished frame
    std::function<void(const std::string& line)> warn;
    /// See MessageLog::say_when_stopped().
    std::function<void(const std::string& rest)> say_when_stopped;
    Progress::Style progress = Progress::Style::none;
  };

  /// On rank 0: checks everything that can be known beforehand. Throws InputError if the film
  /// cannot succeed.
  Film(const RenderJob& animation, JobOptions options, int ranks, int threads);
  /// The film as one string, for the other ranks.
  std::string pack() const;
  static std::unique_ptr<Film> unpack(std::string_view packed, JobOptions options);

  /// Number of frames of the whole film.
  int frames() const { return path_.frames(); }
  /// The frames to be rendered, from 0.
  const std::vector<int>& left() const { return left_; }
  /// "film_0001.png to film_0120.png".
  std::string names() const;
  /// Size of each frame: "24 x 18 pixels, 3 planes".
  std::string size() const;
  /// Number of pixels of all frames that are to be rendered.
  double pixels() const;
  /// Existing files with names of frames beyond this film's last.
  std::vector<std::filesystem::path> later_files() const;
  /// See ImageTask::hindrance().
  const std::string& hindrance() const { return hindrance_; }

  /// Text on the frames' journals: "; 12 of 36 rows of 2 frames are in journals"; empty if there
  /// are none.
  std::string finished_text() const;

  /// Estimates the time and memory of rendering from parts of a few frames. Reading the film took
  /// `reading` seconds.
  JobEstimate estimate(int ranks, int threads, double reading);

  /// Renders and writes the frames. Every rank calls this function. First removes the files that it
  /// will replace, so that every existing frame belongs to this film. Adds the times to `report`.
  /// Throws InputError, RunError.
  void render(const Ranks& ranks, int threads, Executor& executor, const Messages& messages,
              RankReport& report);

 private:
  Film(std::unique_ptr<FrameJobs> jobs, const RenderParameters& parameters, JobOptions options);
  RenderParameters frame(int number) const;
  /// The journals with which an interrupted film goes on.
  std::vector<JournalStatus> journals() const;
  /// The finished work of journals(), in frames.
  struct FinishedFrames {
    double image = 0, truth = 0;
  };
  FinishedFrames finished_frames() const;
  void choose_tone(const Ranks& ranks, Executor& executor);
  /// Warnings about a finished frame.
  struct Flaws {
    bool is_dark = false;
    double unconverged_rays = 0;
  };
  /// Renders a frame in a single process, or on rank 0 with all ranks.
  Flaws render_frame(int number, int ranks, int threads, Executor& executor,
                     const Messages& messages, RankReport& report);
  /// Warns of the flaws, which are given by frame number. Each kind of flaw has one warning,
  /// whatever the number of ranks.
  void warn_of(const std::map<int, Flaws>& flaws, const Messages& messages);

  std::unique_ptr<FrameJobs> jobs_;
  JobOptions options_;
  RenderParameters parameters_;
  CameraPath path_;
  std::vector<int> left_;
  ImageHeader header_;  ///< header of a frame, on rank 0
  std::vector<std::filesystem::path> replaced_;
  std::string hindrance_;
  /// The tone of an existing complete picture, and the picture's path.
  std::optional<std::array<double, 8>> earlier_tone_;
  std::filesystem::path earlier_picture_;
};

}  // namespace gamer
