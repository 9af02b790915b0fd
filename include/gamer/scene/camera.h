#pragma once

#include <glm/vec3.hpp>

#include "gamer/image/image.h"
#include "gamer/scene/render_parameters.h"

namespace gamer {

/// A ray: origin + t direction, t >= 0 in scene units, direction of length 1.
struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

/// Maps pixels to rays. Pixel coordinates are those of FITS less 1: (0, 0) is the centre of the
/// lower-left pixel, x to the right, y up.
class Camera {
 public:
  explicit Camera(const RenderParameters& parameters);

  Ray ray(double x, double y) const;
  int width() const { return width_; }
  int height() const { return height_; }

  /// Unit vectors of the view in the scene: to the right, up, and from the target to the camera.
  const glm::dvec3& right() const { return right_; }
  const glm::dvec3& up() const { return up_; }
  const glm::dvec3& back() const { return back_; }
  /// Unit vector from a point of the scene towards the camera.
  glm::dvec3 towards(const glm::dvec3& point) const;

  /// World coordinates: perspective: offsets from the view's centre in the plane at unit distance,
  /// expressed in degrees (180/pi times the tangent; linear), type "XTAN"/"YTAN", unit deg;
  /// orthographic: offsets in scene units, type "X"/"Y".
  LinearAxis x_axis() const;
  LinearAxis y_axis() const;

 private:
  int width_, height_;
  bool perspective_;
  double pixel_;  ///< pixel size: tangent of the angle at the centre, or scene units
  glm::dvec3 position_, right_, up_, back_;
  std::string unit_;
};

}  // namespace gamer
