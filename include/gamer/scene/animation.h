#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "gamer/scene/render_parameters.h"

namespace gamer {

/// A smooth function through values at ascending times: cubic Hermite pieces whose slopes are those
/// of the parabola through a value and its two neighbours (Catmull-Rom for any spacing); at the
/// ends of the parabola through the last three. Its first derivative is continuous; parabolas are
/// met exactly, straight lines even between two values.
template <class Value>
class SmoothPath {
 public:
  SmoothPath() = default;
  /// As many values as times.
  SmoothPath(std::vector<double> times, std::vector<Value> values);
  /// Between the first time and the last.
  Value at(double time) const;

 private:
  std::vector<double> times_;
  std::vector<Value> values_, slopes_;
};

/// The camera's path of [animation] through its key frames.
///
/// Positions and targets follow a SmoothPath, and so do the logarithms of fov and width. Where
/// animation.up is not given, camera.up is up all the time: the horizon stays level. Where it is
/// given, it says how the view is rolled at each key; the turns between (unit quaternions with
/// signs that make neighbours nearest) follow a SmoothPath of their four components, and the
/// shortest turn then brings that view's direction to the target, so that there is no sudden roll
/// even where the path passes straight above what it looks at.
class CameraPath {
 public:
  struct View {
    glm::dvec3 position, target, up;
    double fov = 0, width = 0;  ///< as camera.fov, camera.width
  };

  /// Throws InputError: a projection without target, lists of different length, times that do not
  /// ascend, fov or width that the projection has not; in any frame a view without direction, too
  /// near to up (level horizon), beyond the projection's fov or the range of numbers.
  explicit CameraPath(const RenderParameters& parameters);

  int frames() const { return frames_; }
  /// Time of a frame, counted from 0. Frames are evenly spread from the first key to the last.
  double time(int frame) const;
  View at(double time) const;

 private:
  void check_views(const ParameterSet& animation, Projection projection) const;

  int frames_;
  std::vector<double> times_;
  View constant_;  ///< where there are no keys
  std::optional<SmoothPath<glm::dvec3>> position_, target_;
  std::optional<SmoothPath<glm::dquat>> turn_;
  std::optional<SmoothPath<double>> log_fov_, log_width_;
};

/// "name_0007.fits" for "name.fits" and frame 6, with as many digits as the last frame needs, at
/// least four.
std::filesystem::path frame_path(const std::filesystem::path& output, int frame, int frames);

/// The parameters of one frame, from 0, as if it were rendered alone: [camera] as the path has it
/// there, the outputs' names with the frame's number, no [animation].
RenderParameters frame_parameters(const RenderParameters& parameters, const CameraPath& path,
                                  int frame);

}  // namespace gamer
