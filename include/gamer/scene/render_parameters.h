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

/// A declared section of a render parameter file ([image], [camera], [spectrum], [photometry]...).
/// These declarations are the only place where its keys stand.
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
enum class SamplerKind { uniform, adaptive };

inline constexpr int most_band_samples = 64;

/// What the value of a pixel is.
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

/// The further images that are made of a scene; section [truth].
struct TruthImages {
  enum class Parts { none, objects, components };
  Parts parts = Parts::none;
  bool dust_free = false;
  bool optical_depth = false;
  bool segmentation = false;
  bool any() const { return parts != Parts::none || dust_free || optical_depth || segmentation; }
};

/// Stars of the sky's field; section [stars].
struct FieldStarParameters {
  double number = 0;  ///< per square degree, between the two magnitudes
  double bright = 14, faint = 24;
  double slope = 0.2;                     ///< dN/dm ~ 10^(slope m)
  double coldest = 3000, hottest = 9000;  ///< K
  std::uint64_t seed = 1;
  SourceLocation number_where;
};

/// The render parameters, resolved: every key has its value.
class RenderParameters {
 public:
  RenderParameters();  ///< the defaults
  /// Reads a parameter file's tree (after --set). Throws InputError for unknown sections and keys,
  /// wrong types, and values out of their interval. It throws for wavelengths or bands that are
  /// empty or repeated, and a unit that lacks what it needs. It throws for conflicting keys:
  /// camera.fov in an orthographic view, image.size of a HEALPix map, sampling.step with the
  /// adaptive sampler. It throws for a camera whose target is its position or whose up is parallel
  /// to the view.
  static RenderParameters read(const ConfigNode& root);
  /// Every key that applies, with its value, as a parameter file; reading it gives equal
  /// parameters.
  std::string toml() const;
  /// Replaces one value; throws as read() does, without a location.
  void set(std::string_view section, std::string_view key, const ParameterValue& value);
  /// Replaces several values at once.
  struct Setting {
    std::string section, key;
    ParameterValue value;
  };
  void set(const std::vector<Setting>& settings);
  /// Whether a key has a meaning with the other values; camera.fov has none in an orthographic
  /// view.
  bool applies(std::string_view section, std::string_view key) const;
  /// The values of one section.
  const ParameterSet& section(std::string_view name) const;

  /// Size of the rendered image, pixels. The six sides of a cubemap, or the twelve base pixels of a
  /// HEALPix map, stand one above the other.
  int width = 512;
  int height = 512;
  OutputOptions output;
  /// The unit given; if none, the scene decides: relative where it has no magnitudes, else nJy.
  std::optional<PixelUnit> pixel_unit;
  SourceLocation pixel_unit_where;

  Projection projection = Projection::perspective;
  glm::dvec3 position{0, -3, 0};
  glm::dvec3 target{0, 0, 0};
  glm::dvec3 up{0, 0, 1};
  double fov = 45;            ///< deg, across the width (perspective, fisheye)
  double camera_width = 2.5;  ///< scene units, across the width
  SphereFrame frame = SphereFrame::galactic;
  bool is_nested = false;  ///< ordering of a HEALPix map
  SkyView sky;             ///< a sky view without a header; its size is not set here
  std::string sky_header;  ///< path of the FITS file that gives size and WCS; empty for none
  SourceLocation sky_header_where;
  std::optional<int> supersample;  ///< none unless the file gives it
  double stars_per_pixel = 0;
  FieldStarParameters field_stars;
  bool antialiased_stars = true;
  /// Stars whose pixel would exceed this value (in the image's unit) are discs; none: all are
  /// points.
  std::optional<double> white_point;
  double largest_star = 8;  ///< largest radius of a star's disc, pixels

  std::vector<double> wavelengths;  ///< Angstrom
  SourceLocation wavelengths_where;
  std::vector<std::string> bands;  ///< their planes follow the wavelengths' planes
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
  std::optional<int> octaves;  ///< none unless the file gives it
  std::uint64_t seed = 1;

  SamplerKind sampler = SamplerKind::adaptive;
  double step = 0.01;  ///< galaxy radii
  double tolerance = 1e-3;

  std::string unit;  ///< unit of scene lengths: "" (arbitrary), "pc", "kpc", "Mpc"
  /// Mpc per scene unit; 1 in a sky view, whose scene is comoving space; none where arbitrary.
  std::optional<double> megaparsec() const;

  CatalogueFormat catalogue_format = CatalogueFormat::automatic;
  std::string catalogue_hdu;
  ColumnMap catalogue_columns;

  int frames = 0;      ///< of [animation]; 0 for a single image
  int tone_frame = 1;  ///< frame, from 1, whose picture sets the tone of all

  TruthImages truth;
  std::filesystem::path truth_path;  ///< path of the truth images; empty: beside the image

 private:
  void set_view_defaults();
  void resolve();
  std::vector<ParameterSet> sections_;
};

}  // namespace gamer
