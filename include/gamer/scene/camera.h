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

class TangentPlane;

/// A ray: origin + t direction, t >= 0 in scene units, direction of length 1.
struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

/// Unit vector towards a sky position: x points to (ra, dec) = (0, 0), y to (90, 0), z to the pole.
glm::dvec3 direction_of(const SkyPosition& sky);
/// Sky position of a direction of any length; right ascension is in [0, 360[.
SkyPosition sky_of(const glm::dvec3& direction);

/// Maps pixels to rays. Pixel coordinates are those of FITS less 1: (0, 0) is the centre of the
/// lower-left pixel, x to the right, y up. They refer to the whole image, whichever region of it is
/// rendered.
///
/// In a sky view the camera is the observer at the origin. The scene is comoving space in Mpc,
/// which is Euclidean in a flat universe. A galaxy of proper radius R at redshift z stands at its
/// comoving distance and has radius R (1+z). Angles, perspective and the order of galaxies along a
/// ray are therefore right.
class Camera {
 public:
  /// Throws InputError for a sky view with a header (see make_camera()), for a region that is not
  /// within the image, and whatever CelestialWcs throws.
  explicit Camera(const RenderParameters& parameters);
  /// A sky view with this WCS. Throws InputError where the WCS does not suit the image's size.
  Camera(const RenderParameters& parameters, const CelestialWcs& wcs);

  /// The half-space of the points p of the scene with dot(normal, p - origin()) >= offset.
  struct HalfSpace {
    glm::dvec3 normal;
    double offset;
  };
  /// Whether the image is a grid on a plane: perspective and orthographic views, and sky views with
  /// projection TAN.
  bool is_flat() const;
  /// The half-space of the points that a flat image shows right of x (axis 0) or above y (axis 1).
  /// A point behind the camera belongs to it if the point projects to the left or below.
  HalfSpace beyond(int axis, double place) const;

  /// The ray through a place of the image; nothing where the place shows no sky.
  std::optional<Ray> ray(double x, double y) const;
  /// Rays through many places (x, y). In sky views this is faster than one call of ray() for each.
  void rays(std::span<const glm::dvec2> places, std::span<std::optional<Ray>> out) const;
  /// Pixel coordinates of a point of the scene; nothing where it has none (behind the camera).
  std::optional<glm::dvec2> pixel(const glm::dvec3& point) const;
  /// Solid angle of the pixel centred on (x, y), sr; 0 where the pixel shows no sky. In
  /// orthographic views, which have no angles, it is the pixel's area in scene units^2.
  double solid_angle(double x, double y) const;
  /// Solid angles of the pixels of row y in the columns `x`.
  void solid_angles(int y, std::span<const int> x, std::span<double> out) const;
  /// Whether samples within a pixel are weighted by solid angle, as in views of the sphere with
  /// pixels of unequal area. The weight is density(), in sr per pixel^2. It is 1 in other views.
  bool weighs_parts() const { return sphere_ && !sphere_->is_equal_area(); }
  double density(double x, double y) const { return sphere_ ? sphere_->density(x, y) : 1; }
  /// The approximate longest side of the image's pixels at a point of the scene, scene units.
  double pixel_size(const glm::dvec3& point) const;
  /// Whether there may be pixels that show no sky.
  bool has_edge() const;
  /// Rows of one face of a view of the sphere; all rows of the image in other views.
  int face_rows() const { return sphere_ ? sphere_->face_rows() : height_; }
  /// The pixel that stands for (x, y), which lies a few pixels from the place `at`. Where a seam of
  /// a view of the sphere lies between both, the result is the pixel that adjoins across the seam.
  /// Otherwise it is (x, y).
  glm::ivec2 neighbour(const glm::dvec2& at, int x, int y) const;
  /// The pixel that holds the place `at`, which may lie beyond a seam.
  glm::ivec2 pixel_at(const glm::dvec2& at) const;
  /// Whether neighbour(at, x, y) differs from (x, y) somewhere within `reach` pixels of `at`.
  bool is_near_seam(const glm::dvec2& at, double reach) const {
    return sphere_ && sphere_->is_near_seam(at, reach);
  }
  /// Shortest side of a sky view's pixels divided by the longest.
  double pixel_aspect() const { return shortest_ / pixel_; }
  /// Size of the whole image.
  int width() const { return width_; }
  int height() const { return height_; }
  /// The pixels that are rendered: image.region, or the whole image.
  const ImageRegion& window() const { return window_; }
  /// The camera of another window of the image, which may reach beyond it.
  Camera with_window(const ImageRegion& window) const;
  Projection projection() const { return projection_; }
  /// The camera's position; in an orthographic view, the middle of the plane where rays begin.
  const glm::dvec3& origin() const { return position_; }

  /// Unit vectors of the view in the scene: right, up, and back (from the target to the camera). In
  /// a sky view they are West, North and towards the observer at its first pixel that shows sky.
  const glm::dvec3& right() const { return right_; }
  const glm::dvec3& up() const { return up_; }
  const glm::dvec3& back() const { return back_; }
  /// The image's up direction at a point of the scene; in a sky view North at that point.
  glm::dvec3 up_at(const glm::dvec3& point) const;
  /// Unit vector from a point of the scene towards the camera.
  glm::dvec3 towards(const glm::dvec3& point) const;
  /// Distance from the camera to a point, scene units; 0 in an orthographic view.
  double distance(const glm::dvec3& point) const;

  /// World coordinates of a sky view.
  const std::optional<CelestialWcs>& wcs() const { return wcs_; }
  /// The header records of a sky view's world coordinates, in pixels of the window.
  std::vector<std::string> wcs_records() const;

  /// World coordinates of perspective and orthographic views, in pixels of the window. Perspective:
  /// tangents of the offsets from the view's centre, times 180/pi; type "XTAN"/"YTAN", unit deg,
  /// linear. Orthographic: offsets in scene units, type "X"/"Y".
  LinearAxis x_axis() const;
  LinearAxis y_axis() const;

 private:
  /// Sets the members that follow from wcs_.
  void set_sky();

  int width_, height_;
  ImageRegion window_;
  Projection projection_;
  double pixel_ = 0;     ///< pixel size: largest angle, tangent at the centre, or scene units
  double shortest_ = 0;  ///< smallest angle of a sky view's pixels
  glm::dvec3 position_, right_, up_, back_;
  std::string unit_;
  std::optional<CelestialWcs> wcs_;
  std::shared_ptr<const TangentPlane> plane_;       ///< null except in TAN sky views
  std::shared_ptr<const SphereProjection> sphere_;  ///< null except in views of the sphere
};

/// Makes the camera of the parameters. If camera.header names a FITS file, its header is read and
/// recorded, and sets the image size. The FITS file is searched beside the file that names it, then
/// in the working directory. Throws InputError, also where image.size contradicts the header.
Camera make_camera(RenderParameters& parameters, Resources& resources);

}  // namespace gamer
