#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "gamer/core/config.h"
#include "gamer/core/parameter.h"
#include "gamer/image/image_writer.h"
#include "gamer/image/wcs.h"
#include "gamer/noise/noise.h"
#include "gamer/scene/catalogue.h"
#include "gamer/sed/cosmology.h"
#include "gamer/sed/photometry.h"

namespace gamer {

/// The declared sections of a render parameter file: [image], [camera], [spectrum], [photometry]...
/// The only place where these keys stand.
struct ParameterSection {
  std::string name;
  std::string description;
  ParameterTable table;
};
std::span<const ParameterSection> render_parameter_sections();

enum class Projection {
  perspective,
  orthographic,
  sky,
  // These map the sphere around the camera: see SphereProjection.
  fisheye,
  equirectangular,
  cubemap,
  healpix
};
/// Whether the camera stands at a place in a scene of lengths.
constexpr bool has_place(Projection projection) {
  return projection != Projection::orthographic && projection != Projection::sky;
}
/// Whether the view is one of the sphere around the camera.
constexpr bool is_sphere(Projection projection) {
  return has_place(projection) && projection != Projection::perspective;
}
/// How the longitudes and latitudes of a view of the sphere are called.
enum class SphereFrame { galactic, equatorial, ecliptic };
enum class SamplerKind { uniform, adaptive };

inline constexpr int most_band_samples = 64;

/// What the pixels of an image count.
enum class PixelUnit {
  relative,            ///< integral of relative emissivity along the ray, f_lambda
  nanojansky,          ///< flux density of the pixel
  megajansky_per_sr,   ///< surface brightness
  magnitude,           ///< AB mag/arcsec^2
  flux_density,        ///< erg/s/cm^2/A/arcsec^2
  electron_per_second  ///< detected by the telescope of [photometry]
};

/// Whether pixels count the flux of their area, not its brightness.
constexpr bool counts_flux(PixelUnit unit) {
  return unit == PixelUnit::nanojansky || unit == PixelUnit::electron_per_second;
}

/// Which further images are made of a scene; [truth].
struct TruthImages {
  enum class Parts { none, objects, components };
  Parts parts = Parts::none;
  bool dust_free = false;
  bool optical_depth = false;
  bool segmentation = false;
  bool any() const { return parts != Parts::none || dust_free || optical_depth || segmentation; }
};

/// The stars of the sky's own field; [stars].
struct FieldStarParameters {
  double number = 0;  ///< per square degree, between the magnitudes
  double bright = 14, faint = 24;
  double slope = 0.2;                     ///< dN/dm ~ 10^(slope m)
  double coldest = 3000, hottest = 9000;  ///< K
  std::uint64_t seed = 1;
  SourceLocation number_where;
};

/// The render parameters, resolved: every key has its value.
class RenderParameters {
 public:
  RenderParameters();  ///< all defaults
  /// Reads a parameter file's tree (after --set). Throws InputError: unknown sections and keys,
  /// types, intervals; keys that conflict (camera.fov given for an orthographic view, image.size
  /// for a HEALPix map, sampling.step for the adaptive sampler); a camera whose target is its
  /// position or whose up is parallel to the view; wavelengths or bands empty or repeated; a unit
  /// that lacks what it needs.
  static RenderParameters read(const ConfigNode& root);
  /// Every key that applies, with its value, as a parameter file that reads back to the same.
  std::string toml() const;
  /// Replaces one value; the errors of read(), without a location.
  void set(std::string_view section, std::string_view key, const ParameterValue& value);
  /// Replaces several values at once.
  struct Setting {
    std::string section, key;
    ParameterValue value;
  };
  void set(const std::vector<Setting>& settings);
  /// Whether a key has a meaning with these values: camera.fov has none for an orthographic view.
  bool applies(std::string_view section, std::string_view key) const;
  /// [section] of the resolved parameters.
  const ParameterSet& section(std::string_view name) const;

  /// Pixels as they are rendered: a cubemap's six sides, or the twelve base pixels of a HEALPix
  /// map, stand one above the other.
  int width = 512;
  int height = 512;
  OutputOptions output;
  /// As asked for; none where the scene decides: relative where it has no magnitudes, else nJy.
  std::optional<PixelUnit> pixel_unit;
  SourceLocation pixel_unit_where;

  Projection projection = Projection::perspective;
  glm::dvec3 position{0, -3, 0};
  glm::dvec3 target{0, 0, 0};
  glm::dvec3 up{0, 0, 1};
  double fov = 45;            ///< deg, across the width (perspective, fisheye)
  double camera_width = 2.5;  ///< scene units, across the width
  SphereFrame frame = SphereFrame::galactic;
  bool is_nested = false;  ///< a HEALPix map
  SkyView sky;             ///< without the size; of a sky view without a header
  std::string sky_header;  ///< path of the FITS file that gives size and WCS; empty for none
  SourceLocation sky_header_where;
  std::optional<int> supersample;  ///< only where the file gives it
  double stars_per_pixel = 0;
  FieldStarParameters field_stars;
  bool antialiased_stars = true;
  /// Stars whose pixel would exceed it (in the image's unit) are discs; none: all are points.
  std::optional<double> white_point;
  double largest_star = 8;  ///< radius, pixels

  std::vector<double> wavelengths;  ///< Angstrom
  SourceLocation wavelengths_where;
  std::vector<std::string> bands;  ///< planes after those of the wavelengths
  SourceLocation bands_where;
  std::optional<int> band_samples;
  Igm igm = Igm::none;

  std::string reference_band;
  SourceLocation reference_band_where;
  bool attenuated = false;
  double telescope_area = 0;  ///< m^2; 0 where not given
  double throughput = 1;
  Cosmology cosmology;

  const Noise* noise = nullptr;
  std::optional<int> octaves;  ///< only where the file gives it
  std::uint64_t seed = 1;

  SamplerKind sampler = SamplerKind::adaptive;
  double step = 0.01;  ///< galaxy radii
  double tolerance = 1e-3;

  std::string unit;  ///< of scene lengths: "" (arbitrary), "pc", "kpc", "Mpc"
  /// Mpc per scene unit; 1 in a sky view, whose scene is comoving space; none where arbitrary.
  std::optional<double> megaparsec() const;

  CatalogueFormat catalogue_format = CatalogueFormat::automatic;
  std::string catalogue_hdu;
  ColumnMap catalogue_columns;

  int frames = 0;      ///< of [animation]; 0 for a single image
  int tone_frame = 1;  ///< whose picture sets the tone of all, from 1

  TruthImages truth;
  std::filesystem::path truth_path;  ///< of the truth images; empty: beside the image

 private:
  void set_view_defaults();
  void resolve();
  std::vector<ParameterSet> sections_;
};

}  // namespace gamer
