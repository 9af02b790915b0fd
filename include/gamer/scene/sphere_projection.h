#pragma once

#include <memory>
#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "gamer/image/image.h"

namespace gamer {

/// Coordinate of the middle of a side of `size` pixels.
inline double middle_pixel(int size) { return 0.5 * (size - 1); }

class RenderParameters;

/// The map between directions around the camera and places of an image. A direction is a unit
/// vector (right, up, forward). Forward points to the camera's target, the map's centre; up is the
/// pole, camera.up made perpendicular to forward. Longitude l grows from forward to the left, as on
/// the sky seen from inside; latitude b grows towards up:
///   (right, up, forward) = (-cos b sin l, sin b, cos b cos l).
///
/// Pixel coordinates are those of Camera. An image may consist of faces, one above the other.
class SphereProjection {
 public:
  virtual ~SphereProjection() = default;

  /// Direction at a place of the image; nothing outside the shown part of the sphere.
  virtual std::optional<glm::dvec3> direction(double x, double y) const = 0;
  virtual std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const = 0;
  /// Solid angle of the pixel centred on (x, y), sr, integrated over the pixel.
  virtual double solid_angle(double x, double y) const = 0;
  /// Solid angle at a point, sr per pixel^2.
  virtual double density(double x, double y) const = 0;
  /// Whether all pixels, and equal parts of pixels, have equal solid angles.
  virtual bool is_equal_area() const { return false; }
  /// The approximate longest side of any pixel, rad.
  virtual double pixel_angle() const = 0;
  /// Rows of a face; all rows where there is one face.
  virtual int face_rows() const { return height_; }
  /// The pixel that stands for (x, y), which lies a few pixels from the place `at`. Beyond a seam
  /// of the face of `at` the result is the pixel that adjoins across the seam. Beyond the edge of
  /// the map it is (x, y).
  virtual glm::ivec2 neighbour(const glm::dvec2& at, int x, int y) const = 0;
  /// Whether neighbour() is another pixel for some (x, y) less than `reach` pixels from `at`.
  virtual bool is_near_seam(const glm::dvec2& at, double reach) const;

  int width() const { return width_; }
  int height() const { return height_; }

 protected:
  SphereProjection(int width, int height) : width_(width), height_(height) {}

 private:
  int width_, height_;
};

/// Fisheye: the angle from forward is proportional to the distance from the image's middle
/// (equidistant azimuthal; FITS ARC). The circle of diameter `fov` (rad, at most 2 pi) touches the
/// image's left and right edges; nothing is shown outside it.
std::unique_ptr<SphereProjection> make_fisheye(int width, int height, double fov);

/// Plate carree (FITS CAR) of the whole sphere: longitude and latitude are linear in x and y.
/// Forward is in the middle, longitude 180 degrees at the left and right edges.
std::unique_ptr<SphereProjection> make_equirectangular(int width, int height);

/// The six sides of a cube seen from its middle, each `size` pixels wide and high. Their order is
/// that of FITS (Calabretta & Greisen 2002, section 5.6): up, front, left, back, right, down.
/// Front, left, back and right have up at their top; the upper and lower sides are oriented so that
/// they join the front side.
std::unique_ptr<SphereProjection> make_cubemap(int size);

/// HEALPix (Gorski et al. 2005, ApJ 622, 759): pixels of equal area. Faces are the twelve base
/// pixels in HEALPix order. Column and row of a face are the pixel's x (towards North-East) and y
/// (North-West), so that neighbouring pixels are neighbours on the sky. Throws
/// std::invalid_argument when nside is not a power of 2.
std::unique_ptr<SphereProjection> make_healpix(int nside);

/// The projection of the parameters; null where the view is not one of the sphere.
std::unique_ptr<SphereProjection> make_sphere_projection(const RenderParameters& parameters);

/// Sets the world coordinates of such a view's image (axes, faces and their axes, HEALPix).
/// Longitude and latitude are those of SphereProjection, named as camera.frame says.
void set_sphere_axes(const RenderParameters& parameters, ImageHeader& header);

}  // namespace gamer
