#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "gamer/core/resources.h"
#include "gamer/image/image.h"
#include "gamer/image/wcs.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/sphere_projection.h"

namespace gamer {

/// A ray: origin + t direction, t >= 0 in scene units, direction of length 1.
struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

/// The direction of a place on the sky: x to (0, 0), y to (90, 0), z to the pole.
glm::dvec3 direction_of(const SkyPosition& sky);
/// The place on the sky in a direction of any length; right ascension in [0, 360[.
SkyPosition sky_of(const glm::dvec3& direction);

/// Maps pixels to rays. Pixel coordinates are those of FITS less 1: (0, 0) is the centre of the
/// lower-left pixel, x to the right, y up.
///
/// In a sky view the camera is the observer at the origin and the scene is comoving space, in Mpc,
/// which in a flat universe is Euclidean: a galaxy of proper radius R at redshift z stands at its
/// comoving distance with the radius R (1+z), so that angles, perspective and who stands in front
/// of whom are right.
class Camera {
 public:
  /// Throws InputError for a sky view with a header (see make_camera()), and what CelestialWcs
  /// throws.
  explicit Camera(const RenderParameters& parameters);
  /// A sky view with this WCS. Throws InputError where that makes no view of an image of this size.
  Camera(const RenderParameters& parameters, const CelestialWcs& wcs);

  /// A side of a plane: the points p of the scene with dot(normal, p - origin()) >= offset.
  struct HalfSpace {
    glm::dvec3 normal;
    double offset;
  };
  /// Points that a perspective or orthographic view shows right of x (axis 0) or above y (axis 1);
  /// of what is behind the camera of a perspective view, those that it would show left or below.
  HalfSpace beyond(int axis, double place) const;

  /// Nothing where a pixel shows no sky.
  std::optional<Ray> ray(double x, double y) const;
  /// Rays through many places (x, y). Sky views take less time for each than for one alone.
  void rays(std::span<const glm::dvec2> places, std::span<std::optional<Ray>> out) const;
  /// Where a point of the scene stands in the image; nothing where it does not (behind the camera).
  std::optional<glm::dvec2> pixel(const glm::dvec3& point) const;
  /// Solid angle of the pixel centred on (x, y), sr. Orthographic views have no angles: there it is
  /// the area in scene units^2. It is 0 where the pixel shows no sky.
  double solid_angle(double x, double y) const;
  /// Solid angles of the pixels of row y in the columns `x`.
  void solid_angles(int y, std::span<const int> x, std::span<double> out) const;
  /// Whether parts of a pixel of one size count for its light as their solid angles have it, for
  /// which density() stands, sr per pixel^2: in views of the sphere. In other views they count
  /// alike.
  bool weighs_parts() const { return sphere_ && !sphere_->is_equal_area(); }
  double density(double x, double y) const { return sphere_ ? sphere_->density(x, y) : 1; }
  /// About the longest side of the image's pixels at a point of the scene, scene units.
  double pixel_size(const glm::dvec3& point) const;
  /// Whether there may be pixels that show no sky.
  bool has_edge() const;
  /// Rows of each of the faces that stand one above the other; all rows but in views of the sphere.
  int face_rows() const { return sphere_ ? sphere_->face_rows() : height_; }
  /// The pixel that stands for (x, y), some pixels from the place `at`: beyond the seams of a view
  /// of the sphere another; (x, y) itself in other views.
  glm::ivec2 neighbour(const glm::dvec2& at, int x, int y) const;
  /// Whether it is another for some (x, y) less than `reach` pixels from `at`.
  bool is_near_seam(const glm::dvec2& at, double reach) const {
    return sphere_ && sphere_->is_near_seam(at, reach);
  }
  /// The shortest side of a sky view's pixels over the longest.
  double pixel_aspect() const { return shortest_ / pixel_; }
  int width() const { return width_; }
  int height() const { return height_; }
  Projection projection() const { return projection_; }
  /// Where the camera stands; of an orthographic view the middle of the plane where rays begin.
  const glm::dvec3& origin() const { return position_; }

  /// Unit vectors of the view in the scene: to the right, up, and from the target to the camera. In
  /// a sky view, at the place of its first pixel that shows sky: West, North, and to the observer.
  const glm::dvec3& right() const { return right_; }
  const glm::dvec3& up() const { return up_; }
  const glm::dvec3& back() const { return back_; }
  /// Up in the image at a point of the scene; in a sky view North there.
  glm::dvec3 up_at(const glm::dvec3& point) const;
  /// Unit vector from a point of the scene towards the camera.
  glm::dvec3 towards(const glm::dvec3& point) const;
  /// From the camera to a point, scene units; 0 for an orthographic view.
  double distance(const glm::dvec3& point) const;

  /// World coordinates of a sky view.
  const std::optional<CelestialWcs>& wcs() const { return wcs_; }

  /// World coordinates of perspective and orthographic views: perspective: offsets from the view's
  /// centre in the plane at unit distance, expressed in degrees (180/pi times the tangent; linear),
  /// type "XTAN"/"YTAN", unit deg; orthographic: offsets in scene units, type "X"/"Y".
  LinearAxis x_axis() const;
  LinearAxis y_axis() const;

 private:
  void set_sky_pixel();

  int width_, height_;
  Projection projection_;
  double pixel_ = 0;     ///< pixel size: largest angle or its tangent at the centre, or scene units
  double shortest_ = 0;  ///< of a sky view, the smallest angle
  glm::dvec3 position_, right_, up_, back_;
  std::string unit_;
  std::optional<CelestialWcs> wcs_;
  std::shared_ptr<const SphereProjection> sphere_;  ///< of a view of the sphere
};

/// The camera of the parameters. Where camera.header names a FITS file, its header is read (beside
/// the file that names it, then in the working directory) and recorded, and the size set. Throws
/// InputError, also where image.size is given and another.
Camera make_camera(RenderParameters& parameters, Resources& resources);

}  // namespace gamer
