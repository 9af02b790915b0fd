#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "gamer/image/image.h"

namespace gamer {

class RenderParameters;

/// How an image shows the directions around the camera. A direction has length 1 and the components
/// right, up and forward: forward is to the camera's target, the map's centre; up is the pole that
/// camera.up gives, square to it. Longitude is counted from forward to the left (as on the sky seen
/// from inside), latitude towards up:
///   (right, up, forward) = (-cos b sin l, sin b, cos b cos l).
///
/// Pixels are those of Camera. An image may consist of faces of so many rows, one above the other.
class SphereProjection {
 public:
  virtual ~SphereProjection() = default;

  /// Nothing outside of what the image shows.
  virtual std::optional<glm::dvec3> direction(double x, double y) const = 0;
  virtual std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const = 0;
  /// Solid angle of the pixel centred on (x, y), sr: an integral, not its middle times its sides.
  virtual double solid_angle(double x, double y) const = 0;
  /// Solid angle at a point, sr per pixel^2.
  virtual double density(double x, double y) const = 0;
  /// Whether all pixels, and parts of pixels of one size, have one solid angle.
  virtual bool is_equal_area() const { return false; }
  /// About the longest side of any pixel, rad.
  virtual double pixel_angle() const = 0;
  /// Rows of a face; all rows where there is one face.
  virtual int face_rows() const { return height_; }
  /// The pixel that stands for (x, y), some pixels from the place `at`: beyond a seam of the face
  /// of `at` the one that joins there; beyond the edge of what is shown (x, y) itself.
  virtual glm::ivec2 neighbour(const glm::dvec2& at, int x, int y) const = 0;
  /// True where neighbour() is another pixel for some (x, y) less than `reach` pixels from `at`.
  virtual bool is_near_seam(const glm::dvec2& at, double reach) const;

  int width() const { return width_; }
  int height() const { return height_; }

 protected:
  SphereProjection(int width, int height) : width_(width), height_(height) {}

 private:
  int width_, height_;
};

/// Fisheye: the angle from forward grows evenly with the distance from the image's middle
/// (equidistant azimuthal; FITS ARC). The circle of `fov` (rad, at most 2 pi) across touches the
/// image's left and right edges; there is nothing outside.
std::unique_ptr<SphereProjection> make_fisheye(int width, int height, double fov);

/// The whole sphere; longitude and latitude grow evenly (plate carree; FITS CAR), forward in the
/// middle, longitude 180 degrees at the left and right edges.
std::unique_ptr<SphereProjection> make_equirectangular(int width, int height);

/// The six sides of a cube from its middle, each `size` pixels wide and high, in the order of FITS
/// (Calabretta & Greisen 2002, section 5.6): up, front, left, back, right, down. Sides around the
/// middle have up at the top; the upper and the lower one join the front one.
std::unique_ptr<SphereProjection> make_cubemap(int size);

/// HEALPix (Gorski et al. 2005, ApJ 622, 759): pixels of one area; the twelve base pixels, in their
/// order, are the faces. Column and row of a face are the pixel's x (towards North-East) and y
/// (North-West), so that the pixels of a few rows and columns lie together on the sky. Throws
/// std::invalid_argument when nside is not a power of 2.
std::unique_ptr<SphereProjection> make_healpix(int nside);

/// The projection of the parameters; null where the view is none of these.
std::unique_ptr<SphereProjection> make_sphere_projection(const RenderParameters& parameters);

/// Sets the world coordinates (axes; faces and their axes; HEALPix) of such a view's image:
/// longitude and latitude as above, called as camera.frame says.
void set_sphere_axes(const RenderParameters& parameters, ImageHeader& header);

}  // namespace gamer
