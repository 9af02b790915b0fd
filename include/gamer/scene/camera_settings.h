#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gamer/core/error.h"
#include "gamer/image/wcs.h"
#include "gamer/scene/parameter_section.h"

namespace gamer {

enum class Projection {
  perspective,
  orthographic,
  sky,
  // The following views map the sphere around the camera: see SphereProjection.
  fisheye,
  equirectangular,
  cubemap,
  healpix
};
/// Whether the camera has a position in a scene of lengths.
constexpr bool has_place(Projection projection) {
  return projection != Projection::orthographic && projection != Projection::sky;
}
/// Whether the view maps the sphere around the camera.
constexpr bool is_sphere(Projection projection) {
  return has_place(projection) && projection != Projection::perspective;
}
/// Names of the longitudes and latitudes of a view of the sphere.
enum class SphereFrame { galactic, equatorial, ecliptic };

/// Section [camera]: the view.
struct CameraSettings {
  static ParameterSection section();
  /// Throws InputError for a target at the camera's position, and for an up that is parallel to the
  /// view. Other errors are an angle that the projection cannot show, and a declination beyond the
  /// poles.
  static CameraSettings read(const ParameterSet& values);
  /// Keys whose values `header` replaces.
  static std::span<const std::string_view> header_keys();

  Projection projection = Projection::perspective;
  glm::dvec3 position{0, -3, 0};
  glm::dvec3 target{0, 0, 0};
  glm::dvec3 up{0, 0, 1};
  double fov = 45;     ///< deg, across the image's width (perspective, fisheye)
  double width = 2.5;  ///< scene units, across the image's width (orthographic)
  SphereFrame frame = SphereFrame::galactic;
  bool is_nested = false;  ///< ordering of a HEALPix map
  SkyView sky;             ///< a sky view without a header; its size is not set here
  std::string header;      ///< path of the FITS file that gives size and WCS; empty for none
  SourceLocation header_where;
  std::array<double, 2> shear{};   ///< reduced shear g1 g2 of galaxies whose rows give none
  std::optional<int> supersample;  ///< none unless the file gives it
};

}  // namespace gamer
