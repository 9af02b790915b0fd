#pragma once

#include <functional>
#include <glm/mat3x3.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "gamer/scene/animation.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/scene/scene.h"
#include "scene/image_field.h"
#include "scene/lensing.h"
#include "scene/scene_row.h"
#include "scene/suspicious_values.h"

namespace gamer {

// Distance of a sky view's galaxies for which none is given, Mpc.
inline constexpr double nominal_distance = 1000;

/// Reads the rows of one catalogue.
class SceneReader {
 public:
  SceneReader(const Catalogue& catalogue, const RenderParameters& parameters,
              const Spectrum& spectrum, const Camera& camera, Resources& resources,
              GalaxyLibrary& library)
      : catalogue_(catalogue),
        parameters_(parameters),
        spectrum_(spectrum),
        camera_(camera),
        resources_(resources),
        row_(catalogue, parameters),
        library_(library),
        is_sky_(camera.projection() == Projection::sky) {
    if (parameters.animation.frames == 0) return;
    first_camera_.emplace(frame_parameters(parameters, CameraPath(parameters), 0));
    if (row_.has(column::inclination) || row_.has(column::axis_ratio)) row_.fix_orientation();
  }

  Scene read();

 private:
  /// Place of the selected row's object, and its distances in Mpc.
  struct Position {
    glm::dvec3 centre;
    double redshift = 0;
    std::optional<double> luminosity_distance;
    double comoving_distance = nominal_distance;
  };
  void choose_unit();
  Position read_position(const ImageField* field) const;
  glm::dvec3 read_direction(const ImageField& field) const;
  /// Name of the row's galaxy type, with the row's overrides and without. Types of Sersic's law are
  /// made from the row. Their flattening c/a is axis_ratio, so that they are seen edge on unless an
  /// inclination is given.
  std::string read_type() const;
  std::string read_plain_type() const;
  /// Angular radius of the ball, rad.
  double read_angular_radius(const Position& position);
  /// Whether the galaxy is made from the row, by Sersic's law.
  bool is_made() const { return read_plain_type() != row_.text(column::galaxy); }
  /// The inclination that the row gives, deg.
  std::optional<double> read_inclination();
  Lensing read_lensing() const;
  /// The distribution of the light of the row's type in the reference band.
  LightProfile profile();
  void turn_to_north();
  /// Orientation of the selected row; in an animation, that of the first frame.
  glm::dmat3 orient(const glm::dvec3& centre);
  void read_galaxy(const Position& position, double radius);
  /// Reads the selected row's star; returns false for a star that does not touch the image.
  bool read_star(const Position& position);
  /// Reads the selected row's object and adds it to the scene. Returns false, and adds nothing,
  /// where the object does not touch the field. Without a field all galaxies are added.
  bool read_object(const ImageField* field);
  /// The probes of the whole image, for a scene that is a region of it.
  SpectralProbes find_probes(const SuspiciousValues& suspicious);
  /// The probes that the record of a region names.
  SpectralProbes recorded_probes_of(const Resources::Text& text);
  /// Reads the galaxy of a row that the whole image shows, leaving the scene as it is.
  std::optional<PlacedGalaxy> probe_row(std::size_t row, const ImageField& whole);
  /// Sets the scene's probes, and adds to its list the rows of those that are beyond the region.
  void keep_probes(SpectralProbes probes);
  /// Adds the selected row, whose index is `row`, to the scene's list.
  void keep(std::size_t row);
  /// The stars of [stars], which follow the rows' objects.
  void add_field_stars(const ImageField& field);
  /// Pixel coordinates of a star that touches the image; nothing for others.
  std::optional<glm::dvec2> star_pixel(const glm::dvec3& direction) const;
  /// The flux (nJy) of the row's magnitude over the flux of a unit source in the reference band.
  /// That flux is `rest` for the source unredshifted at 10 pc, and `observed` at its redshift and
  /// distance.
  double flux_scale(const Position& position, double rest, double observed) const;
  double brightness(const PlacedGalaxy& placed, const Position& position);
  /// Counts an apparent magnitude that no galaxy of a survey has.
  void note_unlikely(double magnitude, const SourceLocation& where);
  /// One shared text for all galaxies with a name.
  const SharedText& shared(const std::string& name);
  /// Distance from the camera, scene units; 1 where the camera is at the galaxy's centre. Any
  /// distance serves there, since brightness does not depend on it.
  double distance_of(const glm::dvec3& centre) const {
    const double distance = camera_.distance(centre);
    return distance > 0 ? distance : 1;
  }
  /// Angle of a scene unit at the row's distance, rad. Orthographic views do not show it.
  double angle_of_unit(const Position& position) const;
  void check_band(const Sed& sed, const Bandpass& band, double redshift, const std::string& what,
                  const SourceLocation& where) const;
  void check_planes(const PlacedGalaxy& placed);

  const Catalogue& catalogue_;
  const RenderParameters& parameters_;
  const Spectrum& spectrum_;
  const Camera& camera_;
  std::optional<Camera> first_camera_;  ///< camera of an animation's first frame
  Resources& resources_;
  SceneRow row_;
  GalaxyLibrary& library_;
  bool is_sky_;
  std::shared_ptr<const Bandpass> reference_;
  /// Least and greatest redshift at which a galaxy's spectra were found to cover all planes.
  std::unordered_map<const Galaxy*, std::pair<double, double>> checked_;
  std::map<std::string, SharedText, std::less<>> names_;
  Scene scene_;
  std::string list_;
};

}  // namespace gamer
