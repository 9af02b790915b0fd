#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "gamer/sed/photometry.h"
#include "render/renderer_workspace.h"

namespace gamer {

// The drawing of stars: as discs, or as points whose light several pixels share.

namespace {

// Largest sides, in pixels, of areas in which stars of star fields are searched.
constexpr int star_tile = 64, wide_star_tile = 256;

// Standard deviation of a spike across its length, pixels.
constexpr double spike_width = 0.6;

/// The light of a bright star in a picture, in three parts that are each known up to a factor: a
/// disc, a halo (1 + (d/r)^2)^-2, and four spikes along rows and columns. Halo and spikes end at
/// star_halo_radii disc radii. Lengths are in pixels.
class StarProfile {
 public:
  static constexpr std::size_t parts = 3;

  /// A plain star is a disc alone.
  StarProfile(double radius, bool is_plain)
      : radius_(radius),
        outer_radius_(star_halo_radii * std::max(radius, 1.0)),
        is_plain_(is_plain) {}

  /// Largest distance with light, but for the disc's edge.
  double reach() const { return is_plain_ ? radius_ : outer_radius_; }

  /// The parts at (dx, dy) from the star.
  std::array<double, parts> at(double dx, double dy) const {
    const double distance = std::hypot(dx, dy);
    // The disc has an edge of one pixel.
    const double disc = std::clamp(radius_ + 0.5 - distance, 0.0, 1.0);
    if (is_plain_) return {disc, 0.0, 0.0};
    return {disc, std::max(0.0, halo(distance) - halo(outer_radius_)),
            spike(dx, dy) + spike(dy, dx)};
  }

 private:
  double halo(double distance) const {
    const double q = star_halo_radii * distance / outer_radius_;
    return 1 / ((1 + q * q) * (1 + q * q));
  }
  double spike(double along, double across) const {
    const double left = std::max(0.0, 1 - std::abs(along) / outer_radius_);
    const double q = across / spike_width;
    return left * left * std::exp(-0.5 * q * q);
  }

  double radius_, outer_radius_;
  bool is_plain_;
};

}  // namespace

double Renderer::times_white(const glm::dvec2& pixel, std::span<const double> flux,
                             double area_scale) const {
  if (!draws_discs_ || (!star_settings_.white_point && !white_)) return 0;
  const glm::ivec2 own_pixel = camera_.neighbour(pixel, static_cast<int>(std::round(pixel.x)),
                                                 static_cast<int>(std::round(pixel.y)));
  const double area = camera_.solid_angle(own_pixel.x, own_pixel.y);
  if (!(area > 0)) return 0;
  std::vector<double> values;
  for (std::size_t p = 0; p < flux.size(); ++p) {
    const double brightness = flux[p] * area_scale / area * unit_factors_[p];
    values.push_back(counts_flux(scene_->unit) ? brightness * area : brightness);
  }
  if (!star_settings_.white_point) return white_->times(values);
  const double white_point = scene_->unit == PixelUnit::magnitude
                                 ? nanojansky(*star_settings_.white_point)
                                 : *star_settings_.white_point;
  return std::max(0.0, *std::ranges::max_element(values)) / white_point;
}

void Renderer::share_out(const glm::dvec2& pixel, std::span<const double> flux, double area_scale,
                         const std::function<void(int x, int y, double share)>& take) const {
  if (const double times = times_white(pixel, flux, area_scale); times > 1) {
    share_disc(pixel, times, take);
    return;
  }
  if (!star_settings_.antialiased) {
    const glm::ivec2 place = camera_.neighbour(pixel, static_cast<int>(std::round(pixel.x)),
                                               static_cast<int>(std::round(pixel.y)));
    take(place.x, place.y, 1);
    return;
  }
  // The four nearest pixels share a point's light, so that its centroid is exact.
  const double left = std::floor(pixel.x), below = std::floor(pixel.y);
  for (const double y : {below, below + 1}) {
    const double share_y = 1 - std::abs(pixel.y - y);
    for (const double x : {left, left + 1}) {
      const double share = share_y * (1 - std::abs(pixel.x - x));
      if (!(share > 0)) continue;
      const glm::ivec2 place = camera_.neighbour(pixel, static_cast<int>(x), static_cast<int>(y));
      take(place.x, place.y, share);
    }
  }
}

void Renderer::share_disc(const glm::dvec2& pixel, double pixels,
                          const std::function<void(int x, int y, double share)>& take) const {
  const double x = std::round(pixel.x), y = std::round(pixel.y);
  // A disc of one pixel has neither halo nor spikes, so that stars do not jump as they brighten.
  const double growth = 1 - 1 / pixels;
  const double halo = growth * star_settings_.halo, spikes = growth * star_settings_.spikes;
  const std::array<double, StarProfile::parts> shares = {1 - halo - spikes, halo, spikes};
  const StarProfile profile(
      std::min(std::sqrt(shares[0] * pixels / std::numbers::pi), star_settings_.largest_radius),
      !(halo + spikes > 0));
  const double reach = std::ceil(profile.reach()) + 1;
  std::array<double, StarProfile::parts> sums{};
  for (const bool is_second : {false, true}) {
    for (double j = y - reach; j <= y + reach; ++j) {
      for (double i = x - reach; i <= x + reach; ++i) {
        const auto value = profile.at(i - pixel.x, j - pixel.y);
        double share = 0;
        for (std::size_t k = 0; k < value.size(); ++k) {
          if (!is_second) {
            sums[k] += value[k];
          } else if (value[k] > 0) {
            share += shares[k] * value[k] / sums[k];
          }
        }
        if (!(share > 0)) continue;
        const glm::ivec2 place = camera_.neighbour(pixel, static_cast<int>(i), static_cast<int>(j));
        take(place.x, place.y, share);
      }
    }
  }
}

bool Renderer::add_stars(RowRange rows, LightSums& sums) const {
  const double reach = star_reach();
  bool any = !seam_stars_.empty();
  const auto begin = std::partition_point(
      stars_.begin(), stars_.end(),
      [&](const PlacedStar* star) { return star->pixel.y <= rows.first - reach; });
  for (auto placed = begin; placed != stars_.end() && (*placed)->pixel.y < rows.last - 1 + reach;
       ++placed) {
    any = true;
    add_star(**placed, rows, sums);
  }
  for (const PlacedStar* star : seam_stars_) add_star(*star, rows, sums);
  return any;
}

void Renderer::add_star(const PlacedStar& star, RowRange rows, LightSums& sums) const {
  std::vector<double> light(layout_.spectral());
  const ImageRegion& window = camera_.window();
  share_out(star.pixel, star.flux, star.area_scale, [&](int x, int y, double share) {
    if (y < rows.first || y >= rows.last || x < window.left || x >= window.right()) return;
    const double area = camera_.solid_angle(x, y) / star.area_scale;
    if (!(area > 0)) return;
    for (std::size_t p = 0; p < light.size(); ++p) light[p] = share * star.flux[p] / area;
    sums.add(static_cast<std::size_t>(y - rows.first), static_cast<std::size_t>(column_of(x)),
             {star.object, 0}, light, light);
  });
}

void Renderer::add_field_stars(RowRange rows, LightSums& sums, RenderCounts& counts) const {
  if (star_fields_->empty()) return;
  const ImageRegion& window = camera_.window();
  const int step = draws_discs_ ? wide_star_tile : star_tile;
  std::vector<double> seen(layout_.spectral()), dust_free(layout_.spectral());
  const auto paint = [&](const StarPainter::Tile& tile) {
    const auto take = [&](const StarPainter::Seen& star) {
      const std::size_t object = scene_->galaxies[static_cast<std::size_t>(star.galaxy)].object;
      share_out(star.pixel, star.flux, 1, [&](int x, int y, double share) {
        if (x < tile.left || x >= tile.right || y < tile.bottom || y >= tile.top) return;
        const double area = camera_.solid_angle(x, y);
        if (!(area > 0)) return;
        for (std::size_t p = 0; p < seen.size(); ++p) {
          seen[p] = share * star.flux[p] / area;
          if (layout_.dust_free()) dust_free[p] = share * star.dust_free[p] / area;
        }
        sums.add(static_cast<std::size_t>(y - rows.first), static_cast<std::size_t>(column_of(x)),
                 {object, star.emitter}, seen, dust_free);
      });
    };
    painter_.paint(tile, star_reach(), take, counts);
  };
  for (int bottom = rows.first; bottom < rows.last; bottom += step) {
    for (int left = window.left; left < window.right(); left += step) {
      paint({left, std::min(left + step, window.right()), bottom,
             std::min(bottom + step, rows.last)});
    }
  }
}

void Renderer::visit_field_stars(
    RowRange rows, StarPainter::Detail detail,
    const std::function<void(const StarPainter::Seen& star, glm::ivec2 pixel)>& take) const {
  if (star_fields_->empty()) return;
  const ImageRegion& window = camera_.window();
  const RowRange lines{rows.first + window.bottom, rows.last + window.bottom};
  RenderCounts counts;
  for (int left = window.left; left < window.right(); left += star_tile) {
    const StarPainter::Tile tile{left, std::min(left + star_tile, window.right()), lines.first,
                                 lines.last};
    const auto take_own = [&](const StarPainter::Seen& star) {
      const glm::ivec2 own =
          camera_.neighbour(star.pixel, static_cast<int>(std::round(star.pixel.x)),
                            static_cast<int>(std::round(star.pixel.y)));
      if (!(star.weight > 0) || own.x < tile.left || own.x >= tile.right || own.y < tile.bottom ||
          own.y >= tile.top) {
        return;
      }
      take(star, own);
    };
    painter_.paint(tile, 1, take_own, counts, detail);
  }
}

}  // namespace gamer
