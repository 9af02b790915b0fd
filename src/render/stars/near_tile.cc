#include "render/stars/near_tile.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace gamer {
namespace {

// Distance of planes beyond a tile's margin, in pixels and as a share of a place's size. Rounding
// then cuts off no star within the margin.
constexpr double plane_margin = 1e-3;
constexpr double plane_slack = 1e-12;

/// Whether a place of the image is within `margin` pixels of a tile, also over a seam.
bool touches(const Camera& camera, const StarPainter::Tile& tile, double margin,
             const glm::dvec2& pixel) {
  if (pixel.x > tile.left - margin && pixel.x < tile.right - 1 + margin &&
      pixel.y > tile.bottom - margin && pixel.y < tile.top - 1 + margin) {
    return true;
  }
  if (!camera.is_near_seam(pixel, margin)) return false;
  for (int y = static_cast<int>(std::ceil(pixel.y - margin)); y <= pixel.y + margin; ++y) {
    for (int x = static_cast<int>(std::ceil(pixel.x - margin)); x <= pixel.x + margin; ++x) {
      const glm::ivec2 place = camera.neighbour(pixel, x, y);
      if (place.x >= tile.left && place.x < tile.right && place.y >= tile.bottom &&
          place.y < tile.top) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

TileSpace::TileSpace(const Camera& camera, const StarPainter::Tile& tile, double margin,
                     const BallSpace& space) {
  if (!camera.is_flat()) return;
  const double reach = margin + plane_margin;
  const auto make = [&](int axis, double place, double sign) -> Plane {
    const Camera::HalfSpace half = camera.beyond(axis, place);
    const glm::dvec3 inward = glm::transpose(space.from_ball) * (sign * half.normal);
    const double offset =
        sign * (glm::dot(half.normal, space.centre - camera.origin()) - half.offset);
    const double size = std::abs(inward.x) + std::abs(inward.y) + std::abs(inward.z);
    const double far = glm::length(half.normal) * glm::distance(space.centre, camera.origin());
    return {inward, offset + plane_slack * (far + size), size};
  };
  planes_ = {make(0, tile.left - reach, 1), make(0, tile.right - 1 + reach, -1),
             make(1, tile.bottom - reach, 1), make(1, tile.top - 1 + reach, -1)};
}

bool TileSpace::may_show(const double place[3], double half) const {
  if (!planes_) return true;
  return std::ranges::all_of(*planes_, [&](const Plane& plane) {
    const double inside = plane.inward.x * place[0] + plane.inward.y * place[1] +
                          plane.inward.z * place[2] + plane.offset;
    return inside >= -half * plane.size;
  });
}

NearTile::NearTile(const Camera& camera, const GalaxyIndex& index, const StarFields& fields,
                   std::size_t number, const PlacedGalaxy& placed, double light,
                   const StarPainter::Tile& tile, const StarPainter::Reach& reach,
                   std::span<const std::optional<GalaxyIndex::Ball>> rays)
    : camera_(camera),
      index_(index),
      field_(fields.fields()[number]),
      is_parallel_(fields.is_parallel()),
      tile_(tile),
      reach_(reach),
      rays_(rays),
      space_(placed),
      light_(light),
      most_light_(reach.is_brightness ? light / reach.least_area : light) {
  for (const StarPainter::Reach::Class& of : reach.classes) {
    spaces_.emplace_back(camera_, tile, of.margin, space_);
  }
}

std::size_t NearTile::class_of(double q, const glm::dvec2& pixel) const {
  const std::size_t widest = reach_.of(most_light_ * q);
  if (widest == 0 || !reach_.is_brightness) return widest;
  const glm::ivec2 own = camera_.pixel_at(pixel);
  const double area = camera_.solid_angle(own.x, own.y);
  return area > 0 ? reach_.of(light_ * q / area) : 0;
}

bool NearTile::may_reach(const StarField::Cell& cell, double brightest) const {
  if (!spaces_.back().may_show(cell.centre, cell.half)) return false;
  const glm::dvec3 place = space_.scene(cell.centre);
  const double radius = cell.half * space_.radius;
  double nearest = 1;
  if (!is_parallel_) {
    const glm::dvec3 way = place - camera_.origin();
    const double farthest = std::sqrt(brightest / field_.limit) + radius;
    if (glm::dot(way, way) > farthest * farthest) return false;
    nearest = std::max(glm::length(way) - radius, 0.0);
  }
  const std::size_t i = reach_.of(most_light_ * (brightest / (nearest * nearest)));
  // The planes exclude more, at less cost, than the ball around the tile's rays.
  if (spaces_.back().has_planes()) {
    return i + 1 == spaces_.size() || spaces_[i].may_show(cell.centre, cell.half);
  }
  return rays_[i] && overlap(index_.ball_of(place, radius), *rays_[i]);
}

std::optional<NearTile::Star> NearTile::star(std::size_t level,
                                             const StarField::Candidate& candidate) const {
  const StarField& stars = *field_.stars;
  if (!spaces_.back().may_show(candidate.position, 0)) return std::nullopt;
  const glm::dvec3 place = space_.scene(candidate.position);
  const glm::dvec3 way = place - camera_.origin();
  const double distance2 = is_parallel_ ? 1 : glm::dot(way, way);
  const double most = stars.luminosity_bound(level, candidate);
  if (!(most > field_.limit * distance2)) return std::nullopt;
  const std::size_t i = reach_.of(most_light_ * (most / distance2));
  if (spaces_.back().has_planes()) {
    if (i + 1 < spaces_.size() && !spaces_[i].may_show(candidate.position, 0)) return std::nullopt;
  } else {
    if (!rays_[i]) return std::nullopt;
    const glm::dvec3 away = way / std::sqrt(distance2) - rays_[i]->centre;
    if (glm::dot(away, away) > rays_[i]->radius * rays_[i]->radius) return std::nullopt;
  }
  const double luminosity = stars.luminosity(level, candidate);
  const double q = luminosity / distance2;
  if (!(q > field_.limit)) return std::nullopt;
  const std::optional<glm::dvec2> pixel = camera_.pixel(place);
  if (!pixel) return std::nullopt;
  const double margin = reach_.classes[class_of(q, *pixel)].margin;
  if (!touches(camera_, tile_, margin, *pixel)) return std::nullopt;
  return Star{place, *pixel, luminosity, distance2};
}

}  // namespace gamer
