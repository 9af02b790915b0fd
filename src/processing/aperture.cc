#include "processing/aperture.h"

#include <algorithm>
#include <array>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "core/message.h"
#include "core/no_value.h"
#include "gamer/core/units.h"

namespace gamer {
namespace {

using std::numbers::pi;

struct Vector {
  double x = 0, y = 0;
};
Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y}; }
Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y}; }
Vector operator*(double factor, Vector a) { return {factor * a.x, factor * a.y}; }
double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y; }
double cross(Vector a, Vector b) { return a.x * b.y - a.y * b.x; }

/// Signed area of the unit circle's sector from direction a to b.
double sector(Vector a, Vector b) { return std::atan2(cross(a, b), dot(a, b)) / 2; }

/// Signed area of the part of the unit circle within the triangle (centre, a, b). It is continuous
/// in a and b, also where the edge touches the circle or passes its centre.
double circle_in_triangle(Vector a, Vector b) {
  const Vector edge = b - a;
  const double length2 = dot(edge, edge);
  const double miss = cross(a, edge);
  const double discriminant = length2 - miss * miss;
  if (!(discriminant > 0)) return sector(a, b);
  const double root = std::sqrt(discriminant), along = dot(a, edge);
  const double enter = std::clamp((-along - root) / length2, 0.0, 1.0);
  const double leave = std::clamp((-along + root) / length2, 0.0, 1.0);
  const Vector in = a + enter * edge, out = a + leave * edge;
  double area = cross(in, out) / 2;
  if (enter > 0) area += sector(a, in);
  if (leave < 1) area += sector(out, b);
  return area;
}

/// Arcsec towards East and North per pixel along x and y.
struct SkyGradient {
  Vector east, north;
};

using Vector3 = std::array<double, 3>;
double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

SkyGradient sky_gradient(const CelestialWcs& wcs, double x, double y) {
  constexpr double step_size = 0.5;
  const auto direction = [&](double dx, double dy) {
    const auto sky = wcs.sky(PixelPosition{x + 1 + dx, y + 1 + dy});
    if (!sky) throw input_error("pixel ({:.6g}, {:.6g}) shows no sky", x + 1 + dx, y + 1 + dy);
    const double ra = sky->ra * degree, dec = sky->dec * degree;
    return Vector3{std::cos(dec) * std::cos(ra), std::cos(dec) * std::sin(ra), std::sin(dec)};
  };
  direction(0, 0);
  const SkyPosition center = *wcs.sky(PixelPosition{x + 1, y + 1});
  const double ra = center.ra * degree, dec = center.dec * degree;
  const Vector3 east = {-std::sin(ra), std::cos(ra), 0};
  const Vector3 north = {-std::sin(dec) * std::cos(ra), -std::sin(dec) * std::sin(ra),
                         std::cos(dec)};
  SkyGradient gradient;
  const auto derivative = [&](double dx, double dy, double& to_east, double& to_north) {
    const Vector3 after = direction(dx, dy), before = direction(-dx, -dy);
    const Vector3 difference = {after[0] - before[0], after[1] - before[1], after[2] - before[2]};
    to_east = dot(difference, east) / (2 * step_size * arcsecond);
    to_north = dot(difference, north) / (2 * step_size * arcsecond);
  };
  derivative(step_size, 0, gradient.east.x, gradient.north.x);
  derivative(0, step_size, gradient.east.y, gradient.north.y);
  return gradient;
}

/// The angle in [0, pi[ of an axis.
double half_turn(double angle) {
  const double positive = angle < 0 ? angle + pi : angle;
  return positive < pi ? positive : 0;
}

/// A part of a plane.
class Section final : public Plane {
 public:
  Section(const Plane& plane, const Area& area)
      : Plane(area.width, area.height), plane_(plane), area_(area) {}
  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    plane_.read({area_.x + area.x, area_.y + area.y, area.width, area.height}, out, stride);
  }

 private:
  const Plane& plane_;
  const Area area_;
};

/// Pixels of the box around an ellipse; nothing where the box misses the plane.
std::optional<Area> box(const Plane& plane, const Ellipses& ellipses, double radius) {
  const auto side = [](double center, double half, int size) {
    // Pixels reach half a pixel beyond their centres; the limits keep the numbers in the range of
    // int.
    const double limit = size;
    const double low = std::clamp(std::floor(center - half + 0.5), 0.0, limit);
    const double high = std::clamp(std::ceil(center + half - 0.5), -1.0, limit - 1);
    return std::pair(static_cast<int>(low), static_cast<int>(high));
  };
  const auto [left, right] = side(ellipses.x(), ellipses.half_width(radius), plane.width());
  const auto [bottom, top] = side(ellipses.y(), ellipses.half_height(radius), plane.height());
  if (left > right || bottom > top) return std::nullopt;
  return Area{left, bottom, right - left + 1, top - bottom + 1};
}

/// Calls use(x, y, value) for the pixels of the box around an ellipse, row by row, and end_row()
/// after each row.
template <class Use, class EndRow>
void for_each_pixel(const Plane& plane, const Ellipses& ellipses, double radius, int threads,
                    Use use, EndRow end_row) {
  const std::optional<Area> area = box(plane, ellipses, radius);
  if (!area) return;
  for_each_band(Section(plane, *area), threads, [&](const Area& band, const double* values) {
    for (int y = 0; y < band.height; ++y) {
      for (int x = 0; x < band.width; ++x) use(area->x + x, area->y + band.y + y, *values++);
      end_row();
    }
  });
}

/// Sums over rows of sums over pixels, so that rounding errors grow little with the number of
/// pixels.
template <std::size_t n>
struct RowSums {
  std::array<double, n> row{}, total{};
  void end_row() {
    for (std::size_t i = 0; i < n; ++i) total[i] += row[i];
    row = {};
  }
};

/// Adds light at an offset to the sums of the moments 1, x, y, x^2, y^2, x y.
void add_moments(RowSums<6>& sums, double light, double dx, double dy) {
  sums.row[0] += light;
  sums.row[1] += light * dx;
  sums.row[2] += light * dy;
  sums.row[3] += light * dx * dx;
  sums.row[4] += light * dy * dy;
  sums.row[5] += light * dx * dy;
}

}  // namespace

Ellipses::Ellipses(double x, double y, double axis_ratio, double angle) : x_(x), y_(y) {
  if (!(axis_ratio > 0 && axis_ratio <= 1)) throw std::invalid_argument("an axis ratio");
  const double c = std::cos(angle), s = std::sin(angle);
  set(c, s, -s / axis_ratio, c / axis_ratio);
}

Ellipses::Ellipses(const CelestialWcs& wcs, double x, double y, double axis_ratio,
                   double position_angle)
    : x_(x), y_(y) {
  if (!(axis_ratio > 0 && axis_ratio <= 1)) throw std::invalid_argument("an axis ratio");
  const auto [east, north] = sky_gradient(wcs, x, y);
  const double c = std::cos(position_angle), s = std::sin(position_angle);
  const Vector major = s * east + c * north, minor = (1 / axis_ratio) * (c * east - s * north);
  set(major.x, major.y, minor.x, minor.y);
}

void Ellipses::set(double ux, double uy, double vx, double vy) {
  ux_ = ux;
  uy_ = uy;
  vx_ = vx;
  vy_ = vy;
  determinant_ = std::fabs(ux * vy - uy * vx);
  pixel_reach_ = std::max(std::hypot(ux + uy, vx + vy), std::hypot(ux - uy, vx - vy)) / 2;
  if (!std::isfinite(x_ + y_ + pixel_reach_) || !(determinant_ > 0)) {
    throw std::invalid_argument("ellipses that are not finite");
  }
}

Ellipses Ellipses::moved_to(double x, double y) const {
  Ellipses moved = *this;
  moved.x_ = x;
  moved.y_ = y;
  return moved;
}

double Ellipses::radius(double x, double y) const {
  const double dx = x - x_, dy = y - y_;
  const double u = ux_ * dx + uy_ * dy, v = vx_ * dx + vy_ * dy;
  return std::sqrt(u * u + v * v);
}

double Ellipses::area(double radius) const { return pi * radius * radius / determinant_; }

double Ellipses::half_width(double radius) const {
  return radius * std::hypot(uy_, vy_) / determinant_;
}

double Ellipses::half_height(double radius) const {
  return radius * std::hypot(ux_, vx_) / determinant_;
}

double Ellipses::overlap(int x, int y, double radius) const {
  if (!(radius > 0)) return 0;
  const double center = this->radius(x, y);
  if (center + pixel_reach_ <= radius) return 1;
  if (center - pixel_reach_ >= radius) return 0;
  const double dx = x - x_, dy = y - y_;
  const auto corner = [&](double right, double up) {
    const double px = dx + right, py = dy + up;
    return Vector{(ux_ * px + uy_ * py) / radius, (vx_ * px + vy_ * py) / radius};
  };
  const std::array corners = {corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5),
                              corner(-0.5, 0.5)};
  double area = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    area += circle_in_triangle(corners[i], corners[(i + 1) % corners.size()]);
  }
  return std::clamp(std::fabs(area) * radius * radius / determinant_, 0.0, 1.0);
}

double position_angle_on_sky(const CelestialWcs& wcs, double x, double y, double angle) {
  const auto [east, north] = sky_gradient(wcs, x, y);
  const Vector direction = {std::cos(angle), std::sin(angle)};
  return half_turn(std::atan2(dot(east, direction), dot(north, direction)));
}

double position_angle_on_sky(const CelestialWcs& wcs, double x, double y,
                             const LightMoments& light) {
  const auto [east, north] = sky_gradient(wcs, x, y);
  const auto moment = [&light](Vector a, Vector b) {
    return a.x * b.x * light.xx + a.y * b.y * light.yy + (a.x * b.y + a.y * b.x) * light.xy;
  };
  return half_turn(std::atan2(2 * moment(east, north), moment(north, north) - moment(east, east)) /
                   2);
}

double angle_on_pixels(const CelestialWcs& wcs, double x, double y, double position_angle) {
  const auto [east, north] = sky_gradient(wcs, x, y);
  const double e = std::sin(position_angle), n = std::cos(position_angle);
  const double determinant = cross(east, north);
  return std::atan2((east.x * n - north.x * e) / determinant,
                    (e * north.y - n * east.y) / determinant);
}

std::vector<ApertureSum> aperture_sums(const Plane& plane, const Ellipses& ellipses,
                                       std::span<const double> radii, double background,
                                       int threads) {
  std::vector<ApertureSum> results(radii.size());
  if (radii.empty()) return results;
  std::vector<double> sorted(radii.begin(), radii.end());
  std::ranges::sort(sorted);
  // A pixel is counted in full for the smallest ellipse that contains it, and in part for each
  // ellipse that cuts it.
  struct Counts {
    double flux = 0, area = 0;
  };
  const std::size_t size = sorted.size();
  std::vector<Counts> row_whole(size + 1), row_part(size), whole(size), part(size);
  std::vector<std::int64_t> missing(size + 1);
  const double reach = ellipses.pixel_reach();
  const auto use = [&](int x, int y, double value) {
    const double radius = ellipses.radius(x, y);
    if (radius - reach >= sorted.back()) return;
    auto i = static_cast<std::size_t>(
        std::upper_bound(sorted.begin(), sorted.end(), radius - reach) - sorted.begin());
    if (!std::isfinite(value)) {
      while (i < size && !(ellipses.overlap(x, y, sorted[i]) > 0)) ++i;
      ++missing[i];
      return;
    }
    for (; i < size && sorted[i] < radius + reach; ++i) {
      const double overlap = ellipses.overlap(x, y, sorted[i]);
      row_part[i].flux += (value - background) * overlap;
      row_part[i].area += overlap;
    }
    row_whole[i].flux += value - background;
    row_whole[i].area += 1;
  };
  const auto end_row = [&] {
    for (std::size_t i = 0; i < size; ++i) {
      whole[i].flux += row_whole[i].flux;
      whole[i].area += row_whole[i].area;
      part[i].flux += row_part[i].flux;
      part[i].area += row_part[i].area;
      row_whole[i] = row_part[i] = {};
    }
    row_whole[size] = {};
  };
  for_each_pixel(plane, ellipses, sorted.back(), threads, use, end_row);
  for (std::size_t i = 1; i < size; ++i) {
    whole[i].flux += whole[i - 1].flux;
    whole[i].area += whole[i - 1].area;
    missing[i] += missing[i - 1];
  }
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const auto place = static_cast<std::size_t>(
        std::lower_bound(sorted.begin(), sorted.end(), radii[i]) - sorted.begin());
    results[i] = {whole[place].flux + part[place].flux, whole[place].area + part[place].area,
                  missing[place]};
  }
  return results;
}

double radius_of_flux(const Plane& plane, const Ellipses& ellipses, double flux, double largest,
                      double background, int threads) {
  constexpr int step_count = 64;
  constexpr double few_pixels = 1 << 18;
  if (!(flux > 0) || !(largest > 0)) return no_value;
  double low = 0, high = largest, low_flux = 0;
  const auto ring_pixels = [&] {
    return ellipses.area(high + ellipses.pixel_reach()) -
           ellipses.area(std::max(0.0, low - ellipses.pixel_reach()));
  };
  double ring = std::numeric_limits<double>::infinity(), before = ring;
  do {
    std::vector<double> radii;
    for (int i = 1; i <= step_count; ++i) radii.push_back(low + (high - low) * i / step_count);
    const std::vector<ApertureSum> sums =
        aperture_sums(plane, ellipses, radii, background, threads);
    const auto reached =
        std::ranges::find_if(sums, [&](const ApertureSum& sum) { return sum.flux >= flux; });
    if (reached == sums.end()) return no_value;
    const auto step = static_cast<std::size_t>(reached - sums.begin());
    if (step > 0) {
      low = radii[step - 1];
      low_flux = sums[step - 1].flux;
    }
    high = radii[step];
    before = ring;
    ring = ring_pixels();
  } while (ring > few_pixels && ring < before / 2);
  struct Pixel {
    int x, y;
    double value, overlap;
  };
  std::vector<Pixel> pixels;
  const double reach = ellipses.pixel_reach();
  for_each_pixel(
      plane, ellipses, high, threads,
      [&](int x, int y, double value) {
        const double radius = ellipses.radius(x, y);
        if (radius + reach <= low || radius - reach >= high || !std::isfinite(value)) return;
        pixels.push_back({x, y, value - background, ellipses.overlap(x, y, low)});
      },
      [] {});
  const auto excess = [&](double radius) {
    double sum = low_flux - flux;
    for (const Pixel& pixel : pixels) {
      sum += pixel.value * (ellipses.overlap(pixel.x, pixel.y, radius) - pixel.overlap);
    }
    return sum;
  };
  const double at_low = low_flux - flux, at_high = excess(high);
  if (!(at_high > 0)) return high;
  std::uintmax_t evaluations = 100;
  constexpr int bit_count = 40;  // 1e-12
  const auto [left, right] = boost::math::tools::toms748_solve(
      excess, low, high, at_low, at_high, boost::math::tools::eps_tolerance<double>(bit_count),
      evaluations);
  return (left + right) / 2;
}

Background annulus_background(const Plane& plane, const Ellipses& ellipses, double inner,
                              double outer, BackgroundMethod method, int threads) {
  const std::optional<Area> area = box(plane, ellipses, outer);
  if (!area) return {no_value, no_value, 0};
  const PlanePtr ring =
      changed(std::make_shared<Section>(plane, *area), [&](const Area& part, double* values) {
        for (int y = 0; y < part.height; ++y) {
          for (int x = 0; x < part.width; ++x, ++values) {
            const double radius = ellipses.radius(area->x + part.x + x, area->y + part.y + y);
            if (!(radius >= inner && radius <= outer)) *values = no_value;
          }
        }
      });
  if (method == BackgroundMethod::clipped) {
    constexpr double clip = 3;
    return clipped_background(*ring, clip, threads);
  }
  const Statistics all = statistics(*ring, threads);
  if (method == BackgroundMethod::mean) return {all.mean, all.sigma, all.count};
  const double level = median(*ring, threads);
  return {level, mad_sigma(*ring, level, threads), all.count};
}

double LightMoments::size() const { return std::sqrt(xx + yy); }

double LightMoments::angle() const { return std::atan2(2 * xy, xx - yy) / 2; }

double LightMoments::axis_ratio() const {
  const double ellipticity = std::hypot(e1(), e2());
  return std::sqrt((1 - ellipticity) / (1 + ellipticity));
}

LightMoments moments(const Plane& plane, const Ellipses& ellipses, double radius, double background,
                     int threads) {
  RowSums<6> sums;
  for_each_pixel(
      plane, ellipses, radius, threads,
      [&](int x, int y, double value) {
        if (!std::isfinite(value)) return;
        const double light = (value - background) * ellipses.overlap(x, y, radius);
        const double dx = x - ellipses.x(), dy = y - ellipses.y();
        add_moments(sums, light, dx, dy);
      },
      [&] { sums.end_row(); });
  const double flux = sums.total[0];
  if (!(flux > 0)) return {flux, no_value, no_value, no_value, no_value, no_value};
  const double x = sums.total[1] / flux, y = sums.total[2] / flux;
  const double xx = sums.total[3] / flux - x * x, yy = sums.total[4] / flux - y * y;
  // The moments of a single pixel are only rounding errors.
  constexpr double rounding_error = 8 * std::numeric_limits<double>::epsilon();
  const bool is_point = std::fabs(xx) + std::fabs(yy) <= rounding_error * (x * x + y * y);
  if (is_point) return {flux, ellipses.x() + x, ellipses.y() + y, 0, 0, 0};
  return {flux, ellipses.x() + x, ellipses.y() + y, xx, yy, sums.total[5] / flux - x * y};
}

Ellipses recentered(const Plane& plane, const Ellipses& ellipses, double radius, double background,
                    int threads) {
  constexpr int most_steps = 50;
  constexpr double settled = 1e-6;
  Ellipses moved = ellipses;
  for (int step = 0; step < most_steps; ++step) {
    const LightMoments light = moments(plane, moved, radius, background, threads);
    if (!(light.flux > 0) || !std::isfinite(light.x + light.y)) {
      throw input_error("the light about pixel ({:.6g}, {:.6g}) has no centroid: its sum is {:.6g}",
                        moved.x() + 1, moved.y() + 1, light.flux);
    }
    const double distance = std::hypot(light.x - moved.x(), light.y - moved.y());
    moved = moved.moved_to(light.x, light.y);
    if (distance < settled) break;
  }
  return moved;
}

std::optional<LightMoments> adaptive_moments(const Plane& plane, const Ellipses& ellipses,
                                             double radius, double sigma, double background,
                                             int threads) {
  constexpr int most_steps = 200;
  constexpr double settled = 1e-9;
  constexpr double reach_factor = 6;  // exp(-18) = 1.5e-8
  double xx = sigma * sigma, yy = xx, xy = 0;
  double center_x = ellipses.x(), center_y = ellipses.y();
  for (int step = 0; step < most_steps; ++step) {
    const double determinant = xx * yy - xy * xy;
    const double reach = reach_factor * std::sqrt(std::max(xx, yy));
    RowSums<6> sums;
    for_each_pixel(
        plane, Ellipses(center_x, center_y), reach, threads,
        [&](int x, int y, double value) {
          if (!std::isfinite(value)) return;
          const double dx = x - center_x, dy = y - center_y;
          const double distance2 = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / determinant;
          if (distance2 > reach_factor * reach_factor || ellipses.radius(x, y) > radius) return;
          const double light = (value - background) * std::exp(-distance2 / 2);
          add_moments(sums, light, dx, dy);
        },
        [&] { sums.end_row(); });
    const double flux = sums.total[0];
    if (!(flux > 0)) return std::nullopt;
    const double x = sums.total[1] / flux, y = sums.total[2] / flux;
    const LightMoments next = {2 * flux,
                               center_x + 2 * x,
                               center_y + 2 * y,
                               2 * (sums.total[3] / flux - x * x),
                               2 * (sums.total[4] / flux - y * y),
                               2 * (sums.total[5] / flux - x * y)};
    if (!(next.xx > 0 && next.yy > 0 && next.xx * next.yy > next.xy * next.xy)) return std::nullopt;
    const double scale = next.xx + next.yy;
    const double change = std::fabs(next.xx - xx) + std::fabs(next.yy - yy) +
                          2 * std::fabs(next.xy - xy) +
                          std::sqrt(scale) * (std::fabs(x) + std::fabs(y));
    center_x = next.x;
    center_y = next.y;
    xx = next.xx;
    yy = next.yy;
    xy = next.xy;
    if (change < settled * scale) return next;
  }
  return std::nullopt;
}

}  // namespace gamer
