#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// A sky position in degrees; ICRS unless the header says otherwise.
struct SkyPosition {
  double ra = 0;
  double dec = 0;
};

/// FITS pixel coordinates: (1, 1) is the centre of the lower-left pixel.
struct PixelPosition {
  double x = 0;
  double y = 0;
};

/// Projection, centre, scale and rotation of an image of the sky.
struct SkyView {
  std::string projection = "TAN";  ///< three letters, as in FITS; Calabretta & Greisen 2002
  std::vector<double> parameters;  ///< PV2_1, PV2_2, ... of the projection
  SkyPosition center;              ///< sky position of the image's middle
  double pixel_scale = 1;          ///< arcsec per pixel
  double rotation = 0;             ///< position angle of the image's +y, deg, from North to East
  int width = 1;
  int height = 1;
};

/// A celestial world coordinate system, evaluated by WCSLIB. Const functions are safe from several
/// threads at a time.
class CelestialWcs {
 public:
  /// East is left where the rotation is 0. The projection's native reference point is `center` at
  /// the middle pixel. Throws InputError for an unknown projection (with near names, or all names)
  /// or bad parameters.
  explicit CelestialWcs(const SkyView& view);
  /// Reads a FITS header: 80-character records without line ends, or with them (as header_text()
  /// gives it). The first two axes must be RA and Dec, in either order. Throws InputError with
  /// `label` for no celestial axes, other frames (galactic...), pixels of no area or absurd sides,
  /// and WCSLIB's errors (in its words).
  static CelestialWcs from_header(std::string_view header, const std::string& label);

  CelestialWcs(const CelestialWcs&);
  CelestialWcs& operator=(const CelestialWcs&);
  ~CelestialWcs();

  /// Conversions between pixels and sky. The result is empty where the pixel shows no sky, or where
  /// the position has no pixel, as behind the tangent plane.
  std::optional<SkyPosition> sky(const PixelPosition& pixel) const;
  std::optional<PixelPosition> pixel(const SkyPosition& sky) const;
  /// Converts many pixels at a time; positions without sky are NaN. Throws std::invalid_argument if
  /// the lengths differ.
  void sky(std::span<const PixelPosition> pixels, std::span<SkyPosition> out) const;

  /// The reference pixel of a gnomonic projection (TAN) without distortion, where the plane of the
  /// image touches the celestial sphere; nothing for other projections.
  std::optional<PixelPosition> tangent_point() const;

  /// Throws InputError where the header's distortion folds or absurdly stretches an image of this
  /// size, or has no inverse there.
  void check_distortion(int width, int height) const;

  /// The 80-character header records that describe axes 1 and 2. If read from a header, they are
  /// its records, unchanged and in order; otherwise they are made from the view. WCSAXES, NAXIS and
  /// cards of further axes are left out.
  const std::vector<std::string>& records() const;

 private:
  class Impl;
  explicit CelestialWcs(std::shared_ptr<const Impl> impl);

  std::shared_ptr<const Impl> impl_;
};

/// Names of the projections that WCSLIB knows.
std::vector<std::string> sky_projections();

}  // namespace gamer
