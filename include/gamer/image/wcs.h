#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// Degrees, ICRS unless the header says otherwise.
struct SkyPosition {
  double ra = 0;
  double dec = 0;
};

/// FITS pixel coordinates: (1, 1) is the centre of the lower-left pixel.
struct PixelPosition {
  double x = 0;
  double y = 0;
};

/// How an image lies on the sky.
struct SkyView {
  std::string projection = "TAN";  ///< three letters, as in FITS; Calabretta & Greisen 2002
  std::vector<double> parameters;  ///< PV2_1, PV2_2, ... of the projection
  SkyPosition center;              ///< of the middle of the image
  double pixel_scale = 1;          ///< arcsec
  double rotation = 0;             ///< of the image's +y, deg, from North towards East
  int width = 1;
  int height = 1;
};

/// A celestial world coordinate system, evaluated by WCSLIB. Const functions are safe from several
/// threads at a time.
class CelestialWcs {
 public:
  /// East is to the left where the rotation is 0. The native reference point of the projection lies
  /// on `center` and the middle pixel. Throws InputError for an unknown projection (with near names
  /// or all that there are) or bad parameters of it.
  explicit CelestialWcs(const SkyView& view);
  /// From a FITS header: 80-character records without line ends, or separated by line ends (as
  /// header_text() gives it). The first two axes must be RA and Dec, in either order. Throws
  /// InputError with `label`: no celestial axes, other frames (galactic...), pixels without area or
  /// of absurd sides, what WCSLIB rejects (its words).
  static CelestialWcs from_header(std::string_view header, const std::string& label);

  CelestialWcs(const CelestialWcs&);
  CelestialWcs& operator=(const CelestialWcs&);
  ~CelestialWcs();

  /// Nothing where the pixel shows no sky, or the point has no pixel (behind the tangent plane...).
  std::optional<SkyPosition> sky(const PixelPosition& pixel) const;
  std::optional<PixelPosition> pixel(const SkyPosition& sky) const;
  /// Many at a time, to one array each; NaN where there is none.
  void sky(std::span<const PixelPosition> pixels, std::span<SkyPosition> out) const;

  /// Throws InputError where the header's distortion folds an image of this size, stretches it
  /// absurdly or has no inverse there.
  void check_distortion(int width, int height) const;

  /// The header records, 80 characters each, that describe axes 1 and 2: those of the header it was
  /// read from, letter by letter and in their order, or made from the view. WCSAXES and NAXIS
  /// cards, and those of further axes, are not among them.
  const std::vector<std::string>& records() const;

 private:
  class Impl;
  explicit CelestialWcs(std::shared_ptr<const Impl> impl);

  std::shared_ptr<const Impl> impl_;
};

/// Names of the projections that WCSLIB knows.
std::vector<std::string> sky_projections();

}  // namespace gamer
