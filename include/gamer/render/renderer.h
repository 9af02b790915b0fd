#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gamer/galaxy/galaxy.h"
#include "gamer/image/image.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/galaxy_index.h"
#include "gamer/render/march/sampler.h"
#include "gamer/render/medium.h"
#include "gamer/render/output_planes.h"
#include "gamer/render/stars/star_painter.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {

class LightSums;

/// Renders rows of an image of a scene, or of a region of it, whose rows and columns are counted
/// from its lower left pixel. Rows may be rendered in any order from any thread or process; their
/// values are always the same.
class Renderer {
 public:
  Renderer(const RenderParameters& parameters, const Camera& camera,
           std::shared_ptr<const Scene> scene, const Spectrum& spectrum,
           const TruthSettings& truth = {});

  /// The footprints with which an image in such a unit looks at a galaxy.
  static FootprintRange footprints(const RenderParameters& parameters, const Camera& camera,
                                   PixelUnit unit, const PlacedGalaxy& placed);

  int width() const { return camera_.window().width; }
  int height() const { return camera_.window().height; }
  /// Number of output_planes().
  int planes() const { return static_cast<int>(layout_.size()); }

  /// values[((row - first) * planes + plane) * width + x], in the scene's unit: the mean over a
  /// pixel's rays, or its flux; NaN for pixels that show no sky, and for magnitudes of nothing.
  void render_rows(RowRange rows, std::span<double> values) const;
  /// Renders rows and adds what it took to `counts`.
  void render_rows(RowRange rows, std::span<double> values, RenderCounts& counts) const;
  /// Rows are rendered fastest in groups of so many, counted from row 0.
  static constexpr int tile_rows = 16;
  /// Renders the pixels [left, right) x [bottom, top) and adds what it took.
  void count_pixels(int left, int right, int bottom, int top, RenderCounts& counts) const;

  /// Every ray of the whole image, which has no region: its pixel coordinates (from 0), the area
  /// for which it stands (pixels), and the light there in each output that is an image, in the
  /// scene's unit of brightness times that area.
  void sample_light(const std::function<void(double x, double y, double area,
                                             std::span<const double> values)>& take) const;
  /// Along the ray of a point of the image, at the first plane's wavelength.
  double optical_depth(double x, double y) const;

 private:
  struct Sample;
  struct Workspace;
  /// Finds the rays through the middles of pixels [left, right) of row y, for place_samples().
  void aim(int left, int right, int y, Workspace& work) const;
  /// Column of LightSums for the pixels of a column of the whole image.
  int column_of(int x) const { return x - camera_.window().left; }
  /// Whether a pixel is one of the nine about a cusp.
  bool is_at_cusp(int x, int y) const;
  /// Rays of a pixel: a fixed grid, or cells where it is large for what it shows. Pixels about a
  /// cusp have cells in any case, with a grid as that cusp needs them.
  void place_samples(int x, int y, int row, const GalaxyIndex::Found& near, Workspace& work) const;
  /// Adds the rays of a cell, or cuts it. `middle` is the ray through its middle.
  void refine(const Sample& cell, const std::optional<Ray>& middle, Workspace& work) const;
  /// Makes the weights of a pixel's samples, from `first` on, shares of its solid angle.
  void weigh(std::size_t first, Workspace& work) const;
  /// How large a cell is for what it shows: its side over the largest side at which one ray
  /// (`rays`) or four rays by Gauss' rule (`parts`) are enough for envelopes and textures.
  /// `steepness` is `parts` for envelopes alone.
  struct Coarseness {
    double rays = 0, parts = 0, steepness = 0;
  };
  Coarseness coarseness(const Ray& ray, double size, std::span<const int> galaxies) const;
  /// Works samples off while there are at least so many.
  void work_off(std::size_t least, const GalaxyIndex::Found& near, Workspace& work, LightSums& sums,
                RenderCounts& counts) const;
  /// Gives a ray's hit what a pixel or sub-pixel of that size sees of the galaxy.
  void set_footprint(double size, Hit& hit) const;
  void add_light(std::span<const Sample> samples, const GalaxyIndex::Found& near, Workspace& work,
                 LightSums& sums, RenderCounts& counts) const;
  /// Adds the light and depth of an integrated ray.
  void add_ray(const Sample& sample, std::size_t ray, Workspace& work, LightSums& sums) const;
  /// Adds the scene's own stars to rows of the whole image; says whether there were any.
  bool add_stars(RowRange rows, LightSums& sums) const;
  void add_field_stars(RowRange rows, LightSums& sums, RenderCounts& counts) const;
  /// Calls take(x, y, share) for the pixels among which the light of a star is shared, `flux` its
  /// light in each plane in units of brightness times the pixels' area.
  void share_out(const glm::dvec2& pixel, std::span<const double> flux, double area_scale,
                 const std::function<void(int x, int y, double share)>& take) const;
  void add_star(const PlacedStar& star, RowRange rows, LightSums& sums) const;
  /// Pixels within which a star touches others.
  double star_reach() const { return white_point_ ? largest_star_ + 1 : 1; }
  /// Solid angles of a row's pixels where there is light and the unit counts it; elsewhere 1.
  std::vector<double> areas_of(int y, std::size_t row, LightSums& sums) const;
  /// Turns the sums of a row of the image into its values.
  void finish(int y, std::size_t row, LightSums& sums) const;

  Camera camera_;
  std::optional<int> supersample_;  ///< chosen by the tolerance where not given
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const StarFields> star_fields_;
  Medium medium_;
  std::unique_ptr<Sampler> sampler_;
  GalaxyIndex index_;
  StarPainter painter_;
  OutputLayout layout_;
  std::vector<std::pair<int, int>> cusp_pixels_;  ///< [y, x] ascending, where there is a grid
  std::vector<double> pixel_in_ball_;  ///< of each galaxy: the longest side there, galaxy radii
  /// A pixel's width in the ball for each scene unit from a camera that the galaxy holds.
  std::vector<double> pixel_angle_in_ball_;
  std::vector<double> unit_factors_;  ///< [spectral plane]
  bool antialiased_stars_;
  std::optional<double> white_point_;          ///< see RenderParameters
  double largest_star_;                        ///< pixels
  std::vector<const PlacedStar*> stars_;       ///< from the lowest in the image to the highest
  std::vector<const PlacedStar*> seam_stars_;  ///< that may touch rows anywhere; not in `stars_`
};

}  // namespace gamer
