#pragma once

#include <filesystem>
#include <optional>

#include "gamer/core/error.h"
#include "gamer/image/image_writer.h"
#include "gamer/scene/parameter_section.h"

namespace gamer {

/// The unit of pixel values.
enum class PixelUnit {
  relative,            ///< integral of relative emissivity along the ray, f_lambda
  nanojansky,          ///< flux density of the pixel
  megajansky_per_sr,   ///< surface brightness
  magnitude,           ///< AB mag/arcsec^2
  flux_density,        ///< erg/s/cm^2/A/arcsec^2
  electron_per_second  ///< detected by the telescope of [photometry]
};

/// Whether a pixel's value is the flux of its area (otherwise it is a brightness).
constexpr bool counts_flux(PixelUnit unit) {
  return unit == PixelUnit::nanojansky || unit == PixelUnit::electron_per_second;
}

/// Pixels [left, left + width) x [bottom, bottom + height) of an image, counted from 0.
struct ImageRegion {
  int left = 0, bottom = 0;
  int width = 0, height = 0;
  int right() const { return left + width; }
  int top() const { return bottom + height; }
};

/// Section [image]: the image's file and the unit of its pixels.
struct ImageSettings {
  static ParameterSection section();
  /// Throws InputError for a data type or a tone that no file has, and for a region that is not
  /// four whole numbers.
  static ImageSettings read(const ParameterSet& values);

  OutputOptions output;
  SourceLocation layout_where;
  std::optional<ImageRegion> region;  ///< the part that is rendered; none for the whole image
  /// The unit that the file gives. Without it the unit is relative if the scene has no magnitudes,
  /// else nJy.
  std::optional<PixelUnit> unit;
  SourceLocation unit_where;
};

/// Section [truth]: further images of a scene.
struct TruthSettings {
  static ParameterSection section();
  static TruthSettings read(const ParameterSet& values);

  enum class Parts { none, objects, components };
  Parts parts = Parts::none;
  bool dust_free = false;
  bool optical_depth = false;
  bool segmentation = false;
  std::filesystem::path path;  ///< empty: beside the image
  bool any() const { return parts != Parts::none || dust_free || optical_depth || segmentation; }
};

}  // namespace gamer
