#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gamer/galaxy/galaxy.h"
#include "gamer/image/image.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/galaxy_index.h"
#include "gamer/render/galaxy_layers.h"
#include "gamer/render/march/sampler.h"
#include "gamer/render/medium.h"
#include "gamer/render/output_planes.h"
#include "gamer/render/stars/star_painter.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

class LightSums;

/// A renderer of the image of a scene, or of a region of the image. Rows and columns count from the
/// region's lower left pixel. Rows may be rendered in any order, by any thread or process; their
/// values do not depend on this.
class Renderer {
 public:
  Renderer(const RenderParameters& parameters, const Camera& camera,
           std::shared_ptr<const Scene> scene, const Spectrum& spectrum,
           const TruthSettings& truth = {});
  /// A renderer with this accuracy instead of that of sampling.tolerance.
  Renderer(const RenderParameters& parameters, const Accuracy& accuracy, const Camera& camera,
           std::shared_ptr<const Scene> scene, const Spectrum& spectrum,
           const TruthSettings& truth);

  /// The footprints with which the rays of an image see a galaxy.
  static FootprintRange footprints(const RenderParameters& parameters, const Camera& camera,
                                   PixelUnit unit, const PlacedGalaxy& placed);

  int width() const { return camera_.window().width; }
  int height() const { return camera_.window().height; }
  /// Number of output_planes().
  int planes() const { return static_cast<int>(layout_.size()); }

  /// Renders values[((row - first) * planes + plane) * width + x], in the scene's unit. A value is
  /// the mean over a pixel's rays, or the pixel's flux. NaN stands for pixels that show no sky, and
  /// for magnitudes without light.
  void render_rows(RowRange rows, std::span<double> values) const;
  /// Renders rows and adds the work to `counts`.
  void render_rows(RowRange rows, std::span<double> values, RenderCounts& counts) const;
  /// Number of rows of a tile. Calls of render_rows() are fastest for whole tiles, which count from
  /// row 0.
  static constexpr int tile_rows = 16;
  /// Renders the pixels [left, right) x [bottom, top) and adds the work to `counts`.
  void count_pixels(int left, int right, int bottom, int top, RenderCounts& counts) const;
  /// Number of tiles of the image in which the stars of star fields are drawn together.
  int field_tiles() const;
  /// Draws the stars of star fields in one of field_tiles(), without keeping them, and adds the
  /// work to `counts`.
  void count_field_stars(int number, RenderCounts& counts) const;

  /// Calls take() for every ray of the camera's window, with its pixel coordinates (from 0), its
  /// area (pixels) and its light in each output plane. The light is in the scene's unit of
  /// brightness times the area.
  void sample_light(const std::function<void(double x, double y, double area,
                                             std::span<const double> values)>& take) const;
  /// Renders values[plane * width + x] of pixels of a row, in the given ranges of columns and
  /// without stars that are drawn individually. Other columns have no light.
  void render_smooth(int y, std::span<const RowRange> columns, std::span<double> values) const;
  /// Calls take(star, pixel) once for each star of star fields that is drawn within these rows.
  /// `pixel` is the pixel of the whole image that holds the star.
  void visit_field_stars(
      RowRange rows, StarPainter::Detail detail,
      const std::function<void(const StarPainter::Seen& star, glm::ivec2 pixel)>& take) const;
  const StarFields& star_fields() const { return *star_fields_; }
  /// Optical depth of a galaxy along the ray of a point of the image, at the first plane's
  /// wavelength.
  double optical_depth(double x, double y, int galaxy) const;

  /// Takes layers from `layers` instead of making them anew. A renderer with equal arguments must
  /// have made them.
  void use(std::shared_ptr<const GalaxyLayers> layers) { layers_ = std::move(layers); }
  /// A function that takes a ray: its pixel coordinates (from 0), its area (pixels), and its light
  /// by emitting component and spectral plane, as seen and without dust.
  using TakeLayerRay =
      std::function<void(double x, double y, double area, std::span<const double> seen,
                         std::span<const double> dust_free)>;
  /// The parts of a galaxy's layer in a region of the whole image; calls `take` for the galaxy's
  /// rays. A pixel has numbers by spectral plane. They are the transmission of light from behind,
  /// the optical depth if an image shows it, then the light of each emitting component. Last comes
  /// the light of each component without dust, if an image shows it.
  GalaxyLayer layer_parts(int galaxy, const ImageRegion& region, const TakeLayerRay& take,
                          RenderCounts& counts) const;
  /// The layer that consists of these parts. The light of each component is multiplied by its
  /// factor; no factors stand for factors of 1.
  GalaxyLayer summed(int galaxy, const std::vector<double>& factors,
                     const GalaxyLayer& parts) const;
  /// Wavelengths of the spectral nodes, Angstrom.
  std::vector<double> spectral_nodes() const;

 private:
  struct Sample;
  struct Workspace;
  /// Finds the rays through the middles of pixels [left, right) of row y, for place_samples().
  void aim(int left, int right, int y, Workspace& work) const;
  /// Column of LightSums for the pixels of a column of the whole image.
  int column_of(int x) const { return x - camera_.window().left; }
  /// Whether a pixel is one of the nine about a cusp.
  bool is_at_cusp(int x, int y) const;
  /// The ray through a pixel's middle.
  std::optional<Ray> middle_ray(int x, int y, const Workspace& work) const;
  /// Finds the galaxies from which the cells of a pixel choose.
  void find_near_pixel(int x, int y, const GalaxyIndex::Found& near, Workspace& work) const;
  /// Adds a pixel's layers to the sums, or its rays to the waiting rays.
  void add_pixel(int x, int y, int row, const GalaxyIndex::Found& near, Workspace& work,
                 LightSums& sums) const;
  /// Places the rays of a pixel: a fixed grid, or cells where the pixel is large compared with the
  /// structure that it shows. With a grid, pixels about a cusp still have cells. Each sample gets
  /// this `pixel` and `row`.
  void place_samples(int x, int y, int pixel, int row, Workspace& work) const;
  /// Adds the rays of a cell, or divides the cell. `middle` is the ray through the cell's middle.
  void refine(const Sample& cell, const std::optional<Ray>& middle, Workspace& work) const;
  /// Turns the weights of a pixel's samples, from `first` on, into shares of the pixel's solid
  /// angle.
  void weigh(std::size_t first, Workspace& work) const;
  /// The side of a cell, divided by the largest side for which one ray (`rays`), or four rays by
  /// Gauss' rule (`parts`), suffice for envelopes and textures. `steepness` is `parts` for
  /// envelopes alone.
  struct Coarseness {
    double rays = 0, parts = 0, steepness = 0;
  };
  Coarseness coarseness(const Ray& ray, double size, std::span<const int> galaxies) const;
  /// Integrates samples while at least `least` of them are waiting.
  void work_off(std::size_t least, const GalaxyIndex::Found& near, Workspace& work, LightSums& sums,
                RenderCounts& counts) const;
  /// Sets the footprint of a ray's hit for a pixel or sub-pixel of size `size`.
  void set_footprint(double size, Hit& hit) const;
  /// Finds the hits of samples among their candidates.
  void find_hits(
      std::span<const Sample> samples,
      const std::function<std::span<const int>(const Sample& sample, const Ray& ray)>& candidates,
      Workspace& work) const;
  void add_light(std::span<const Sample> samples, const GalaxyIndex::Found& near, Workspace& work,
                 LightSums& sums, RenderCounts& counts) const;
  /// Adds the light and depth of an integrated ray.
  void add_ray(const Sample& sample, std::size_t ray, Workspace& work, LightSums& sums) const;
  /// How many numbers a pixel has in the parts of a galaxy's layer.
  std::size_t layer_numbers(int galaxy) const;
  /// Whether the layer of a galaxy is needed in a pixel.
  using IsShown = std::function<bool(int galaxy, int x, int y)>;
  /// Makes the parts of the layers of `galaxies` in a region; layers[i] belongs to galaxies[i].
  /// Pixels for which `is_shown` is false are left empty; no function stands for all pixels.
  void make_layers(std::span<const int> galaxies, const ImageRegion& region,
                   const IsShown& is_shown, std::span<GalaxyLayer> layers, Workspace& work,
                   RenderCounts& counts, const TakeLayerRay& take) const;
  /// Adds an integrated ray to the parts of its layer.
  void add_to_layer(int galaxy, const Sample& sample, std::size_t ray, Workspace& work,
                    GalaxyLayer& layer, const TakeLayerRay& take) const;
  /// Finds or makes the layers of galaxies near a region.
  void find_layers(const GalaxyIndex::Found& near, const ImageRegion& region, Workspace& work,
                   RenderCounts& counts) const;
  /// Share of a pixel's light that the dust of its layers takes from layers behind, in the plane
  /// where this share is largest. Dust that pixels resolve counts by a third.
  double dimmed_share(int x, int y, const Workspace& work) const;
  /// Whether a galaxy may be a layer in pixels that it shares with small galaxies.
  bool may_be_layer(int galaxy) const;
  /// Finds the layers of a pixel, nearest first. Returns false where the pixel shows no sky or
  /// needs rays through all its galaxies together. Such rays are needed where all galaxies are
  /// large, one may not be a layer, or two penetrate each other.
  bool find_in_pixel(int x, Workspace& work) const;
  /// Adds a pixel's layers, one behind the other. Returns false where the pixel needs rays through
  /// all its galaxies together: find_in_pixel() is false, or dimmed_share() exceeds
  /// Accuracy::most_dimmed.
  bool add_layers(int x, int y, int row, Workspace& work, LightSums& sums) const;
  /// Adds a pixel of a layer, and dims the layers behind it.
  void add_layer(int galaxy, const double* numbers, int x, int row, Workspace& work,
                 LightSums& sums) const;
  /// Adds the scene's own stars to rows of the whole image, and returns whether there were any.
  bool add_stars(RowRange rows, LightSums& sums) const;
  /// Adds the stars of star fields to rows of the whole image.
  void add_field_stars(RowRange rows, LightSums& sums, RenderCounts& counts) const;
  /// Side of the tiles in which stars of star fields are drawn, pixels.
  int field_tile() const;
  /// The reach of the stars next to a tile.
  StarPainter::Reach reach_of(const StarPainter::Tile& tile) const;
  /// The light of a star in each plane, relative to the light of a white pixel there; empty where
  /// all stars are points.
  std::vector<double> times_white(const glm::dvec2& pixel, std::span<const double> flux,
                                  double area_scale) const;
  /// A function that takes the share of each plane's light that the pixel (x, y) gets.
  using TakeShares = std::function<void(int x, int y, std::span<const double> shares)>;
  /// Calls take() for the pixels that share the light of a star. `flux` is its light in each plane,
  /// in units of brightness times the pixel's area.
  void share_out(const glm::dvec2& pixel, std::span<const double> flux, double area_scale,
                 const TakeShares& take) const;
  /// Calls take() as share_out() does, for a disc of a star with times_white() `times`.
  void share_disc(const glm::dvec2& pixel, std::span<const double> times,
                  const TakeShares& take) const;
  void add_star(const PlacedStar& star, RowRange rows, LightSums& sums) const;
  /// The reach of stars, without Reach::least_area.
  StarPainter::Reach make_star_reach() const;
  /// Solid angles of a row's pixels, where there is light and the unit needs them; elsewhere 1.
  std::vector<double> areas_of(int y, std::size_t row, LightSums& sums) const;
  /// Converts the sums of a row of the image to pixel values.
  void finish(int y, std::size_t row, LightSums& sums) const;

  Camera camera_;
  std::optional<int> supersample_;  ///< none: the tolerance decides
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const StarFields> star_fields_;
  Medium medium_;
  std::unique_ptr<Sampler> sampler_;
  GalaxyIndex index_;
  std::shared_ptr<const GalaxyLayers> layers_;  ///< kept layers; may be null
  StarPainter painter_;
  OutputLayout layout_;
  std::vector<std::pair<int, int>> cusp_pixels_;  ///< [y, x] ascending; with a grid only
  std::vector<double>
      pixel_in_ball_;  ///< [galaxy] longest side of a pixel at the galaxy, galaxy radii
  /// [galaxy] a pixel's width in the ball per scene unit of distance, for a camera inside the
  /// galaxy.
  std::vector<double> pixel_angle_in_ball_;
  std::vector<double> unit_factors_;  ///< [spectral plane]
  bool draws_discs_;                  ///< whether bright stars are discs
  std::vector<double> white_;  ///< [spectral plane] brightness of discs; empty where there are none
  StarSettings star_settings_;
  StarPainter::Reach star_reach_;
  /// [class of the reach] stars from the lowest to the highest in the image
  std::vector<std::vector<const PlacedStar*>> stars_;
  std::vector<const PlacedStar*> seam_stars_;  ///< stars that may touch any row; not in `stars_`
};

}  // namespace gamer
