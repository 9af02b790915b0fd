#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "gamer/scene/render_parameters.h"

namespace gamer {

/// A smooth function through values at ascending times: cubic Hermite pieces with continuous slope.
/// The slope at a value is that of the parabola through the value and its two neighbours. At an end
/// the parabola passes through the last three values. Values on a parabola are interpolated
/// exactly; two values give a straight line.
template <class Value>
class SmoothPath {
 public:
  SmoothPath() = default;
  /// `times` and `values` have one size.
  SmoothPath(std::vector<double> times, std::vector<Value> values);
  /// The value at a time between the first and the last.
  Value at(double time) const;

 private:
  std::vector<double> times_;
  std::vector<Value> values_, slopes_;
};

/// The camera's path of [animation] through its key frames.
///
/// Positions and targets follow a SmoothPath, and so do the logarithms of fov and width. Without
/// animation.up, camera.up is up in every frame, so that the horizon stays level. With
/// animation.up, each key has its own roll. The keys' orientations are unit quaternions, with the
/// signs that bring neighbours closest. Their four components follow a SmoothPath. The shortest
/// turn then points the view at the target. The view thus never rolls suddenly, even where the path
/// passes straight above the target.
class CameraPath {
 public:
  struct View {
    glm::dvec3 position, target, up;
    double fov = 0, width = 0;  ///< as camera.fov, camera.width
  };

  /// Throws InputError for a projection without a target, and for a fov or width that the
  /// projection lacks. Other errors are lists of different lengths, and times that do not ascend. A
  /// frame's view must have a direction. With a level horizon, this direction must not be too near
  /// to up. Frames beyond the projection's fov or the range of numbers are errors, too.
  explicit CameraPath(const RenderParameters& parameters);

  int frames() const { return frames_; }
  /// Time of a frame (from 0). Frames are evenly spread from the first key to the last.
  double time(int frame) const;
  View at(double time) const;

 private:
  void check_views(const ParameterSet& animation, Projection projection) const;

  int frames_;
  std::vector<double> times_;
  View constant_;  ///< the view where there are no keys
  std::optional<SmoothPath<glm::dvec3>> position_, target_;
  std::optional<SmoothPath<glm::dquat>> turn_;
  std::optional<SmoothPath<double>> log_fov_, log_width_;
};

/// "name_0007.fits" for "name.fits" and frame 6, with as many digits as the last frame needs, at
/// least four.
std::filesystem::path frame_path(const std::filesystem::path& output, int frame, int frames);

/// The parameters that render one frame (from 0) alone: [camera] is taken from the path, output
/// names carry the frame's number, and there is no [animation].
RenderParameters frame_parameters(const RenderParameters& parameters, const CameraPath& path,
                                  int frame);

}  // namespace gamer
