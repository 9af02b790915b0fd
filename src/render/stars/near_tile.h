#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "gamer/render/galaxy_index.h"
#include "gamer/render/stars/star_fields.h"
#include "gamer/render/stars/star_painter.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/scene.h"

namespace gamer {

/// The map from a galaxy's ball to the scene, for the cells of star fields.
struct BallSpace {
  explicit BallSpace(const PlacedGalaxy& placed)
      : centre(placed.centre), from_ball(glm::inverse(placed.to_ball)) {
    // Half the diagonal of a cube of half side 1.
    radius = std::sqrt(3.0) * placed.bounding_radius;
  }
  glm::dvec3 scene(const double place[3]) const {
    return centre + from_ball * glm::dvec3(place[0], place[1], place[2]);
  }
  glm::dvec3 centre;
  glm::dmat3 from_ball;
  double radius;
};

/// The part of a galaxy's ball that a tile and its margin show. Where the image is flat
/// (Camera::is_flat()) this part lies between planes through the edges.
class TileSpace {
 public:
  TileSpace(const Camera& camera, const StarPainter::Tile& tile, double margin,
            const BallSpace& space);

  bool has_planes() const { return planes_.has_value(); }
  /// False only if no part of the cube around a place of the ball lies between the planes.
  bool may_show(const double place[3], double half) const;

 private:
  struct Plane {
    glm::dvec3 inward;
    double offset;
    double size;  ///< half the extent along `inward` of a cube of half side 1
  };
  std::optional<std::array<Plane, 4>> planes_;
};

/// The cells and stars of a field that may reach a tile. Their reach follows from bounds of their
/// light.
class NearTile {
 public:
  /// A star that reaches the tile.
  struct Star {
    glm::dvec3 place;  ///< in the scene
    glm::dvec2 pixel;
    double luminosity;
    double distance2;  ///< square of the distance; 1 in parallel views
  };

  /// `light` is an upper bound of the light, as in StarPainter::Reach, of a star of flux 1. With
  /// Reach::is_brightness the bound is divided by the area of the star's pixel. `rays` has a ball
  /// for each class of the reach.
  NearTile(const Camera& camera, const GalaxyIndex& index, const StarFields& fields,
           std::size_t number, const PlacedGalaxy& placed, double light,
           const StarPainter::Tile& tile, const StarPainter::Reach& reach,
           std::span<const std::optional<GalaxyIndex::Ball>> rays);

  /// Whether stars of a cell with luminosities up to `brightest` may reach the tile.
  bool may_reach(const StarField::Cell& cell, double brightest) const;
  /// The star of a candidate from the class `level` of the population; nothing if the star is too
  /// faint or does not reach the tile.
  std::optional<Star> star(std::size_t level, const StarField::Candidate& candidate) const;

 private:
  /// The class of a star of flux q, at its place in the image.
  std::size_t class_of(double q, const glm::dvec2& pixel) const;

  const Camera& camera_;
  const GalaxyIndex& index_;
  const StarFields::Field& field_;
  bool is_parallel_;
  const StarPainter::Tile& tile_;
  const StarPainter::Reach& reach_;
  std::span<const std::optional<GalaxyIndex::Ball>> rays_;
  BallSpace space_;
  std::vector<TileSpace> spaces_;  ///< [class]
  double light_;                   ///< the constructor's `light`
  /// The light of a star of flux 1 in the smallest pixel. This light is infinite where no least
  /// area is known; all stars then belong to the last class.
  double most_light_;
};

}  // namespace gamer
