#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "render/renderer_workspace.h"

namespace gamer {

// The drawing of stars: as discs, or as points whose light several pixels share.

namespace {

// Largest sides, in pixels, of areas in which stars of star fields are searched.
constexpr int star_tile = 64, wide_star_tile = 256;

// Standard deviation of a spike across its length, pixels.
constexpr double spike_width = 0.6;

double taper(double share) {
  const double left = std::max(0.0, 1 - share * share);
  return left * left;
}

/// The light of a core of radius 1 with a halo of power p that ends at e, in units of a white disc
/// of radius 1. This light is the integral of 2 x/(1 + x^p) (1 - (x/e)^2)^2 from 0 to e, from a
/// table in e.
class LightWithin {
 public:
  explicit LightWithin(double power) : power_(power) {
    for (int k = 0; k <= entries; ++k) {
      const double end = most * k / entries;
      // A core of radius 1 has at least 16 nodes.
      const int nodes = 64 + static_cast<int>(16 * end);
      double sum = 0;
      for (int i = 0; i < nodes; ++i) {
        const double share = (i + 0.5) / nodes;
        sum += 2 * share / (1 + std::pow(share * end, power)) * taper(share) / nodes;
      }
      table_.push_back(end * end * sum);
    }
  }

  double power() const { return power_; }
  /// The light of a core whose halo ends at `end` radii. Larger ends than `most` count as `most`.
  double operator()(double end) const {
    if (!(end < most)) return table_.back();
    const double place = end / most * entries;
    const int k = std::min(static_cast<int>(place), entries - 1);
    const auto entry = [&](int i) { return table_[static_cast<std::size_t>(i)]; };
    return entry(k) + (place - k) * (entry(k + 1) - entry(k));
  }

 private:
  static constexpr int entries = 2048;
  static constexpr double most = 128;

  double power_;
  std::vector<double> table_;
};

/// The table of a power, which the thread keeps.
const LightWithin& light_within(double power) {
  thread_local LightWithin table(power);
  if (table.power() != power) table = LightWithin(power);
  return table;
}

/// The light of a bright star in a picture, as an exposure shows it: a saturated white core in a
/// halo of the star's colour. Lengths are in pixels, d is the distance from the star.
///
/// The light of plane k, in units of white, is 1/(1 + (d/r_k)^p) (1 - (d/e)^2)^2 with p = 2/halo.
/// It ends at e, star_halo_radii times the largest r_k. This is the aureole d^-p of a point, seen
/// with a response that saturates at white. The radius r_k follows from the plane's light, so that
/// all planes are white in the middle, and a red star becomes red outwards. Without a halo the star
/// is a disc. Four spikes along rows and columns leave the core and end with the halo. If a star is
/// hardly brighter than white, part of its light is a point, so that stars do not jump as they
/// brighten.
class StarProfile {
 public:
  /// `times` is the light of each plane, in units of one pixel of white; the largest exceeds 1.
  StarProfile(std::span<const double> times, const StarSettings& settings)
      : power_(2 / settings.halo),
        has_halo_(settings.halo > 0),
        is_antialiased_(settings.antialiased) {
    const double largest = *std::ranges::max_element(times);
    point_share_ = 1 / (largest * largest);
    spike_share_ = (1 - point_share_) * settings.spikes;
    const double rest = 1 - point_share_ - spike_share_;
    const auto light_to = [&](double end) { return has_halo_ ? light_within(power_)(end) : 1; };
    const double radius =
        std::sqrt(rest * largest / (std::numbers::pi * light_to(star_halo_radii)));
    radius_ = std::clamp(radius, least_radius, settings.largest_radius);
    // Where cores would become too large, all planes become brighter by one factor instead.
    const double level = std::max(1.0, radius / radius_ * (radius / radius_));
    end_ = has_halo_ || spike_share_ > 0 ? star_halo_radii * radius_ : radius_ + 0.5;
    for (const double light : times) {
      // Quadrature behind thick dust may leave a plane slightly negative.
      const double area = rest * std::max(light, 0.0) / level / std::numbers::pi;
      double own = radius_;
      // The share of light before the end depends on the radius; the steps converge.
      constexpr int steps = 8;
      for (int i = 0; i < steps; ++i) own = std::sqrt(area / light_to(end_ / own));
      radii_.push_back(std::max(own, least_radius));
    }
  }

  /// The distance along rows and columns within which all light is.
  double reach() const { return std::max(end_, 1.0); }

  /// The parts at a place, each up to a factor: the point, the spikes, and the core of each plane.
  void at(double dx, double dy, std::span<double> parts) const {
    if (std::max(std::abs(dx), std::abs(dy)) >= reach()) {
      std::ranges::fill(parts, 0.0);
      return;
    }
    const double distance = std::hypot(dx, dy);
    parts[0] = point(dx) * point(dy);
    parts[1] = 0;
    if (spike_share_ > 0) {
      const double outside = has_halo_ ? 1 - response(distance / radius_) : 1;
      parts[1] = outside * (spike(dx, dy) + spike(dy, dx));
    }
    const double end = taper(distance / end_);
    for (std::size_t p = 0; p < radii_.size(); ++p) {
      // A disc has an edge of one pixel.
      if (has_halo_) {
        parts[2 + p] = end > 0 ? end * response(distance / radii_[p]) : 0;
      } else {
        parts[2 + p] = std::clamp(radii_[p] + 0.5 - distance, 0.0, 1.0);
      }
    }
  }

  /// The share of plane p's light for parts and their sums over all pixels.
  double share(std::size_t p, std::span<const double> parts, std::span<const double> sums) const {
    const auto part = [&](double share, std::size_t k) {
      return parts[k] > 0 ? share * parts[k] / sums[k] : 0;
    };
    return part(point_share_, 0) + part(spike_share_, 1) +
           part(1 - point_share_ - spike_share_, 2 + p);
  }

 private:
  /// Smallest radius of a core. A disc of this radius, with its edge of one pixel, always reaches
  /// the middle of a pixel.
  static constexpr double least_radius = 0.5;

  double response(double q) const { return 1 / (1 + std::pow(q, power_)); }
  double point(double offset) const {
    return is_antialiased_ ? std::max(0.0, 1 - std::abs(offset)) : std::abs(offset) <= 0.5;
  }
  double spike(double along, double across) const {
    const double left = std::max(0.0, 1 - std::abs(along) / end_);
    const double q = across / spike_width;
    return left * left * std::exp(-0.5 * q * q);
  }

  double power_;
  bool has_halo_, is_antialiased_;
  double point_share_, spike_share_;
  double radius_, end_;        ///< of the brightest plane
  std::vector<double> radii_;  ///< [plane]
};

/// A lower bound of the areas of pixels within `margin` pixels of a tile, also beyond seams; 0
/// where none is known.
double least_area(const Camera& camera, const StarPainter::Tile& tile, double margin) {
  const double more = std::ceil(margin) + 1;
  const double left = tile.left - more, right = tile.right + more;
  const double bottom = tile.bottom - more, top = tile.top + more;
  const double last = camera.height() - 1;
  switch (camera.projection()) {
    case Projection::orthographic:
    case Projection::healpix: return camera.solid_angle(0, 0);
    case Projection::perspective:
    case Projection::sky: {
      if (!camera.is_flat()) return 0;
      // Areas fall with the distance from the middle. Those of small pixels are rounded.
      constexpr double rounding = 1e-6;
      return (1 - rounding) *
             std::min({camera.solid_angle(left, bottom), camera.solid_angle(left, top),
                       camera.solid_angle(right, bottom), camera.solid_angle(right, top)});
    }
    case Projection::equirectangular:
      return std::min(camera.solid_angle(0, std::clamp(bottom, 0.0, last)),
                      camera.solid_angle(0, std::clamp(top, 0.0, last)));
    case Projection::cubemap:
      // The pixel at a cube's corner is the smallest.
      return camera.solid_angle(0, 0);
    case Projection::fisheye: {
      // Areas fall with the angle. Up to about 220 degrees pixels differ little across the rim.
      const double middle = 0.5 * last;
      const double rim = camera.solid_angle(0, middle);
      return rim > 0.5 * camera.solid_angle(0.5 * (camera.width() - 1), middle) ? 0.5 * rim : 0;
    }
  }
  return 0;
}

}  // namespace

std::vector<double> Renderer::times_white(const glm::dvec2& pixel, std::span<const double> flux,
                                          double area_scale) const {
  if (white_.empty()) return {};
  const glm::ivec2 own = camera_.pixel_at(pixel);
  const double area = camera_.solid_angle(own.x, own.y);
  if (!(area > 0)) return {};
  std::vector<double> times;
  for (std::size_t p = 0; p < flux.size(); ++p) {
    const double brightness = flux[p] * area_scale / area * unit_factors_[p];
    times.push_back((counts_flux(scene_->unit) ? brightness * area : brightness) / white_[p]);
  }
  return times;
}

void Renderer::share_out(const glm::dvec2& pixel, std::span<const double> flux, double area_scale,
                         const TakeShares& take) const {
  const std::vector<double> times = times_white(pixel, flux, area_scale);
  if (std::ranges::any_of(times, [](double plane) { return plane > 1; })) {
    share_disc(pixel, times, take);
    return;
  }
  std::vector<double> shares(flux.size(), 1.0);
  if (!star_settings_.antialiased) {
    const glm::ivec2 place = camera_.pixel_at(pixel);
    take(place.x, place.y, shares);
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
      std::ranges::fill(shares, share);
      take(place.x, place.y, shares);
    }
  }
}

void Renderer::share_disc(const glm::dvec2& pixel, std::span<const double> times,
                          const TakeShares& take) const {
  const double x = std::round(pixel.x), y = std::round(pixel.y);
  const StarProfile profile(times, star_settings_);
  const double reach = std::ceil(profile.reach()) + 1;
  const std::size_t count = times.size() + 2;
  std::vector<double> sums(count), shares(times.size()), parts(count);
  for (double j = y - reach; j <= y + reach; ++j) {
    for (double i = x - reach; i <= x + reach; ++i) {
      profile.at(i - pixel.x, j - pixel.y, parts);
      for (std::size_t k = 0; k < count; ++k) sums[k] += parts[k];
    }
  }
  for (double j = y - reach; j <= y + reach; ++j) {
    for (double i = x - reach; i <= x + reach; ++i) {
      profile.at(i - pixel.x, j - pixel.y, parts);
      for (std::size_t p = 0; p < shares.size(); ++p) shares[p] = profile.share(p, parts, sums);
      if (std::ranges::none_of(shares, [](double share) { return share > 0; })) continue;
      const glm::ivec2 place = camera_.neighbour(pixel, static_cast<int>(i), static_cast<int>(j));
      take(place.x, place.y, shares);
    }
  }
}

StarPainter::Reach Renderer::make_star_reach() const {
  StarPainter::Reach reach{{{1, 1}}, {}, !counts_flux(scene_->unit)};
  if (white_.empty()) return reach;
  constexpr double growth = 4, slack = 1 + 1e-9;  // beyond rounding
  for (std::size_t p = 0; p < white_.size(); ++p) {
    reach.light_of_flux.push_back(slack * unit_factors_[p] / white_[p]);
  }
  const double widest = star_settings_.reach();
  for (double light = growth;; light *= growth) {
    const double margin = slack * StarProfile(std::span(&light, 1), star_settings_).reach();
    // Margins grow up to that of the largest core.
    if (margin >= widest - 1) break;
    reach.classes.push_back({light, margin});
  }
  reach.classes.push_back({HUGE_VAL, widest});
  return reach;
}

bool Renderer::add_stars(RowRange rows, LightSums& sums) const {
  bool any = !seam_stars_.empty();
  for (std::size_t i = 0; i < stars_.size(); ++i) {
    const double reach = star_reach_.classes[i].margin;
    const std::vector<const PlacedStar*>& stars = stars_[i];
    const auto begin = std::partition_point(
        stars.begin(), stars.end(),
        [&](const PlacedStar* star) { return star->pixel.y <= rows.first - reach; });
    for (auto placed = begin; placed != stars.end() && (*placed)->pixel.y < rows.last - 1 + reach;
         ++placed) {
      any = true;
      add_star(**placed, rows, sums);
    }
  }
  for (const PlacedStar* star : seam_stars_) add_star(*star, rows, sums);
  return any;
}

void Renderer::add_star(const PlacedStar& star, RowRange rows, LightSums& sums) const {
  std::vector<double> light(layout_.spectral());
  const ImageRegion& window = camera_.window();
  share_out(star.pixel, star.flux, star.area_scale,
            [&](int x, int y, std::span<const double> shares) {
              if (y < rows.first || y >= rows.last || x < window.left || x >= window.right())
                return;
              const double area = camera_.solid_angle(x, y) / star.area_scale;
              if (!(area > 0)) return;
              for (std::size_t p = 0; p < light.size(); ++p)
                light[p] = shares[p] * star.flux[p] / area;
              sums.add(static_cast<std::size_t>(y - rows.first),
                       static_cast<std::size_t>(column_of(x)), {star.object, 0}, light, light);
            });
}

int Renderer::field_tile() const { return draws_discs_ ? wide_star_tile : star_tile; }

StarPainter::Reach Renderer::reach_of(const StarPainter::Tile& tile) const {
  StarPainter::Reach reach = star_reach_;
  reach.least_area = least_area(camera_, tile, reach.classes.back().margin);
  return reach;
}

int Renderer::field_tiles() const {
  if (star_fields_->empty()) return 0;
  const int step = field_tile();
  return ((width() + step - 1) / step) * ((height() + step - 1) / step);
}

void Renderer::count_field_stars(int number, RenderCounts& counts) const {
  const ImageRegion& window = camera_.window();
  const int step = field_tile(), columns = (width() + step - 1) / step;
  const int left = window.left + number % columns * step;
  const int bottom = window.bottom + number / columns * step;
  const StarPainter::Tile tile{left, std::min(left + step, window.right()), bottom,
                               std::min(bottom + step, window.top())};
  painter_.paint(
      tile, reach_of(tile),
      [&](const StarPainter::Seen& star) {
        share_out(star.pixel, star.flux, 1, [](int, int, std::span<const double>) {});
      },
      counts);
}

void Renderer::add_field_stars(RowRange rows, LightSums& sums, RenderCounts& counts) const {
  if (star_fields_->empty()) return;
  const ImageRegion& window = camera_.window();
  const int step = field_tile();
  std::vector<double> seen(layout_.spectral()), dust_free(layout_.spectral());
  const auto paint = [&](const StarPainter::Tile& tile) {
    const auto take = [&](const StarPainter::Seen& star) {
      const std::size_t object = scene_->galaxies[static_cast<std::size_t>(star.galaxy)].object;
      share_out(star.pixel, star.flux, 1, [&](int x, int y, std::span<const double> shares) {
        if (x < tile.left || x >= tile.right || y < tile.bottom || y >= tile.top) return;
        const double area = camera_.solid_angle(x, y);
        if (!(area > 0)) return;
        for (std::size_t p = 0; p < seen.size(); ++p) {
          seen[p] = shares[p] * star.flux[p] / area;
          if (layout_.dust_free()) dust_free[p] = shares[p] * star.dust_free[p] / area;
        }
        sums.add(static_cast<std::size_t>(y - rows.first), static_cast<std::size_t>(column_of(x)),
                 {object, star.emitter}, seen, dust_free);
      });
    };
    painter_.paint(tile, reach_of(tile), take, counts);
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
      const glm::ivec2 own = camera_.pixel_at(star.pixel);
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
