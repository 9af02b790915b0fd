// The functions of a layer for the march along rays: lengths over which the layer changes, and
// nodes.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "galaxy/arm_courses.h"
#include "galaxy/kinds/ray_cuts.h"
#include "galaxy/kinds/warped_ray.h"
#include "gamer/galaxy/kinds/layer.h"
#include "gamer/noise/footprint.h"

namespace gamer {
namespace {

// Density of nodes around the ray's closest approach to the axis, and the least distance used, in
// scale lengths or radii of the hole.
constexpr double nodes_per_arm_width = 1.2;
constexpr double cusp_width = 0.15;
constexpr double hole_width = 0.5;

// Number of nodes per period of the texture's sharpest features. Fewer nodes would miss features
// unnoticed.
constexpr double nodes_per_period = 2;

// Nodes follow octaves up to this product of frequency and footprint, at which four fifths of an
// octave are resolved. Finer octaves are faint, and doubled nodes find them.
constexpr double seen_cycles = fade_begin + 4 * (fade_end - fade_begin) / 15;

// Scale lengths (e^-9) beyond which the layer's column is negligible.
constexpr double seen_lengths = 9;

// Length over which a texture's columns change, in its periods.
constexpr double texture_periods = 0.35;

// Size of the cusp of exp(-r/rh) at the axis, in scale lengths.
constexpr double cusp_lengths = 0.5;
// Length over which the profile of arms changes, in its e-folding lengths.
constexpr double arm_lengths = 1;
// Smallest such length that counts, in galaxy radii. There is little light where arms are finer.
constexpr double finest_arm = 1.0 / 96;

// Width of a hole's rim as a share of its radius.
constexpr double rim_width = 0.6;

// Widths from a ring's crest within which rays need its nodes, and their number per width.
constexpr double seen_widths = 6;
constexpr double nodes_per_ring_width = 1.2;

/// The distance along a ray from the plane to the layer's brightest place, which is on the side of
/// the axis. It holds for heights below z0. At this place the derivatives of 2 ln cosh(z/z0) and of
/// r/rh along the ray balance.
/// `along` and `across` are the scale lengths and heights that the ray passes per unit of length.
double brightest_shift(double along, double across) { return 0.5 * along / (across * across); }

/// The distance from the axis at which a ray meets the plane. For a ray that meets the plane
/// outside the ball, it is the distance at the closest approach to the axis.
double plane_radius(const double nearest[3], const double direction[3]) {
  const double along = nearest[2] / direction[2];
  const double x = nearest[0] - along * direction[0], y = nearest[1] - along * direction[1];
  if (const double r = length(x, y); r < 1) return r;
  return std::abs(nearest[0] * direction[1] - nearest[1] * direction[0]) /
         length(direction[0], direction[1]);
}

}  // namespace

double Layer::texture_frequency() const {
  if (texture() == nullptr) return 0;
  const double frequency = texture()->frequency() * texture_stretch_;
  const double twirl = texture()->twirl();
  return twirl != 0 ? frequency * length(1.0, twirl * steepest_winding_) : frequency;
}

bool Layer::hides_texture(double footprint) const {
  if (texture() == nullptr) return false;
  // The margin covers a footprint that single precision rounds up.
  constexpr double margin = 1 + 1e-5;
  return texture()->hides(footprint * margin * footprint_scale() *
                          stretch_of(texture()->twirl() * largest_shear_));
}

double Layer::column_brightness(const double nearest[3], const double direction[3],
                                double reach) const {
  if (is_warped()) return std::min(warped_brightness(nearest, direction, reach), 1.0);
  return std::min(flat_brightness(nearest, direction, reach), 1.0);
}

double Layer::flat_brightness(const double nearest[3], const double direction[3],
                              double reach) const {
  double o[3], d[3];
  law_.stretch(nearest, o);
  law_.stretch(direction, d);
  const auto m_at = [&](double t) { return length(o[0] + t * d[0], o[1] + t * d[1]); };
  const double distance = length(nearest[0], nearest[1], nearest[2]);
  const NeighbourBound near(o, d, distance, reach);
  const double far = near.far, plane = std::clamp(near.plane, -far, far);
  const double sideways = reach / shape_.radial.axis_ratio;
  const double across = std::abs(d[2]) / height_at(m_at(plane));
  if (shape_.radial.is_ring()) {
    const double within = across > 0 ? seen_heights / across + near.neighbours : far;
    const double begin = std::max(plane - within, -far), end = std::min(plane + within, far);
    const double inside = m_at(std::clamp(near.axis, begin, end)) - sideways;
    const double outside = std::max(m_at(begin), m_at(end)) + sideways;
    return law_.bound(std::max(inside, 0.0), outside) / law_.peak();
  }
  const auto bound = [&](double t0, double t1) {
    const double m = m_at(t1);
    const double above = std::max(std::abs(o[2] + t0 * d[2]) - near.rise, 0.0);
    const double cosh = std::cosh(above / height_at(m_at(t0) + sideways));
    return law_.bound(std::max(m - sideways, 0.0), m + sideways) / (law_.peak() * cosh * cosh);
  };
  return near.largest(across > 0 ? 1 / across : far, bound);
}

double Layer::height_at(double m) const { return shape_.z0 * shape_.flare_at(std::min(m, 1.0)); }

double Layer::texture_scale(double r) const {
  // Arms extend over many rays, whose errors average out like those of a texture.
  const double frequency = texture_frequency();
  const double texture = frequency > 0 ? texture_periods / frequency : HUGE_VAL;
  if (!follows_arms()) return texture;
  const double fall = follows_courses() ? profile().width : std::numbers::pi / shape_.arm_width;
  const double period = r > 0 ? arm_lengths * fall * r / length(1.0, arms_.shear(r)) : 0.0;
  return std::min(texture, std::max(period, finest_arm));
}

double Layer::crossing_scale(double cosine, double closest) const {
  const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
  const double shortest = minor_length();
  const double scale =
      column_lengths * std::min(shortest, length(shortest * cosine, shape_.z0 * sine));
  if (!(shape_.inner > 0 && closest < 2 * shape_.inner)) return scale;
  return std::min(scale,
                  length(rim_width * shape_.inner * cosine, column_lengths * shape_.z0 * sine));
}

ColumnScale Layer::column_scale(const double nearest[3], const double direction[3],
                                double reach) const {
  if (is_warped()) return warped_column_scale(nearest, direction, reach);
  const double distance = length(nearest[0], nearest[1], nearest[2]);
  if (distance - reach > std::max(law_.limit(-seen_lengths), seen_lengths * shape_.z0)) return {};
  const double largest_flare = shape_.flare_at(std::min(law_.limit(-seen_lengths), 1.0));
  // The ray's least height above the plane, within the ball.
  const double half_chord = std::sqrt(std::max(1 - distance * distance, 0.0));
  const double height = std::max(std::abs(nearest[2]) - half_chord * std::abs(direction[2]), 0.0);
  if (height - reach > seen_heights * shape_.z0 * largest_flare) return {};
  double scale = crossing_scale(std::abs(direction[2]), distance - reach);
  const double r = std::max(plane_radius(nearest, direction) - reach, 0.0);
  if (!shape_.radial.is_ring()) scale = std::min(scale, length(r, cusp_lengths * minor_length()));
  return {.envelope = scale, .texture = texture_scale(r)};
}

namespace {

/// A ray and its neighbours through a warped layer, up to where a neighbour leaves the ball.
struct WarpedNeighbours {
  WarpedNeighbours(const LayerWarp& warp, const double nearest[3], const double direction[3],
                   double reach)
      : inside(std::max(length(nearest[0], nearest[1], nearest[2]) - reach, 0.0)),
        far(std::sqrt(std::max(1 - inside * inside, 0.0))),
        steepest(warp.steepest(1)),
        sinking(reach * length(1.0, steepest)),
        ray(warp, nearest, direction, -far, far, steepest) {}

  double inside;    ///< least distance of a neighbour from the centre
  double far;       ///< half of the longest chord
  double steepest;  ///< slope of the mid-plane
  double sinking;   ///< largest difference of a neighbour's height above the mid-plane
  WarpedRay ray;
};

}  // namespace

double Layer::warped_brightness(const double nearest[3], const double direction[3],
                                double reach) const {
  const WarpedNeighbours near(shape_.warp, nearest, direction, reach);
  double o[3], d[3];
  law_.stretch(nearest, o);
  law_.stretch(direction, d);
  const auto m_at = [&](double t) { return length(o[0] + t * d[0], o[1] + t * d[1]); };
  const double sideways = reach / shape_.radial.axis_ratio;
  const double half_way = 0.5 * near.ray.step() * length(d[0], d[1]);
  double brightness = 0;
  for (int i = 0; i < WarpedRay::steps; ++i) {
    const double middle = 0.5 * (m_at(near.ray.t_at(i)) + m_at(near.ray.t_at(i + 1)));
    const double low = std::max(middle - half_way - sideways, 0.0);
    const double high = middle + half_way + sideways;
    const double above = std::max(near.ray.least(i) - near.sinking, 0.0);
    const double cosh = std::cosh(std::min(above / height_at(high), 300.0));
    brightness = std::max(brightness, law_.bound(low, high) / (law_.peak() * cosh * cosh));
  }
  return brightness;
}

ColumnScale Layer::warped_column_scale(const double nearest[3], const double direction[3],
                                       double reach) const {
  const double distance = length(nearest[0], nearest[1], nearest[2]);
  const double r_limit = std::min(law_.limit(-seen_lengths), 1.0);
  const double farthest = std::max(law_.limit(-seen_lengths), seen_lengths * shape_.z0);
  if (distance - reach > farthest + shape_.warp.most(r_limit)) return {};
  if (warped_brightness(nearest, direction, reach) < std::exp(-2 * seen_heights)) return {};
  const WarpedNeighbours near(shape_.warp, nearest, direction, reach);
  double scale = HUGE_VAL, nearest_axis = HUGE_VAL;
  const auto add = [&](double cosine, double r) {
    scale = std::min(scale, crossing_scale(cosine, distance - reach));
    nearest_axis = std::min(nearest_axis, std::max(r - reach, 0.0));
  };
  const double from_axis = std::abs(nearest[0] * direction[1] - nearest[1] * direction[0]) /
                           std::max(length(direction[0], direction[1]), least_divisor);
  for (const WarpedRay::Pass& pass : near.ray.passes()) {
    const double x = nearest[0] + pass.t * direction[0], y = nearest[1] + pass.t * direction[1];
    const double r = length(x, y);
    if (r > 1 || pass.height - near.sinking > seen_heights * height_at(r)) continue;
    // A neighbour that is closer to a fold passes at a smaller angle.
    const double slope2 = std::max(pass.slope * pass.slope - 2 * pass.curvature * reach, 0.0);
    add(std::min(std::sqrt(slope2) / length(1.0, shape_.warp.steepest(r)), 1.0), r);
  }
  if (nearest_axis == HUGE_VAL) add(0, from_axis);
  const double r = nearest_axis;
  if (!shape_.radial.is_ring()) scale = std::min(scale, length(r, cusp_lengths * minor_length()));
  return {.envelope = scale, .texture = texture_scale(r)};
}

/// A ray through a layer, in the coordinates of RadialLaw::stretch().
struct Layer::Path {
  double o[3], d[3];  ///< origin and direction
  double begin, end;  ///< the part that is integrated
  double dd, od, oo;  ///< products of the vectors within the plane
  bool is_upright;    ///< runs along the axis
  double per_dd;      ///< 1/dd, or 0 for an upright ray
};

bool Layer::cut(const BallRay& ray, const Accuracy& accuracy, Path& path) const {
  law_.stretch(ray.origin, path.o);
  law_.stretch(ray.direction, path.d);
  const double* const o = path.o;
  const double* const d = path.d;
  path.dd = d[0] * d[0] + d[1] * d[1];
  path.od = o[0] * d[0] + o[1] * d[1];
  path.oo = o[0] * o[0] + o[1] * o[1];
  path.begin = ray.begin;
  path.end = ray.end;
  path.is_upright = path.dd < least_divisor;
  path.per_dd = path.is_upright ? 0.0 : 1 / path.dd;
  // The part of the ray where sech^2(z/z0) f can exceed the threshold; sech^2(u) < 4 e^(-2u).
  const double log_least = accuracy.log_envelope_threshold + log_peak_;
  const double r_limit = law_.limit(log_least);
  const double z_limit =
      shape_.z0 * shape_.flare_at(std::min(r_limit, 1.0)) * (std::numbers::ln2 - 0.5 * log_least);
  const double slab = z_limit + shape_.warp.most(std::min(r_limit, 1.0));
  if (!cut_slab(o[2], d[2], slab, path.begin, path.end)) return false;
  if (path.is_upright) return path.oo < r_limit * r_limit;
  const double root2 = path.od * path.od - path.dd * (path.oo - r_limit * r_limit);
  if (root2 <= 0) return false;
  const double root = std::sqrt(root2);
  path.begin = std::max(path.begin, (-path.od - root) * path.per_dd);
  path.end = std::min(path.end, (-path.od + root) * path.per_dd);
  if (path.end <= path.begin) return false;
  return !is_warped() || narrow(ray, z_limit, std::min(r_limit, 1.0), path);
}

bool Layer::narrow(const BallRay& ray, double limit, double radius, Path& path) const {
  const WarpedRay warped(shape_.warp, ray.origin, ray.direction, path.begin, path.end,
                         shape_.warp.steepest(radius));
  int first = 0, last = WarpedRay::steps - 1;
  while (first <= last && warped.least(first) > limit) ++first;
  while (last >= first && warped.least(last) > limit) --last;
  if (first > last) return false;
  path.begin = warped.t_at(first);
  path.end = std::min(warped.t_at(last + 1), path.end);
  return path.end > path.begin;
}

double Layer::texture_rate(const BallRay& ray, double speed) const {
  double frequency = texture_frequency();
  if (texture() == nullptr) return nodes_per_period * frequency * speed;
  if (ray.footprint > 0) {
    const double seen = seen_cycles * texture()->sharpness() / footprint_scale();
    frequency = std::min(frequency, seen / ray.footprint);
  }
  const double cosine = std::abs(ray.direction[2]) / speed;  // without the slope of a warp
  const double finer = texture()->refinement(footprint_scale() * ray.footprint, cosine);
  return nodes_per_period * finer * frequency * speed;
}

void Layer::plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const {
  Path path;
  if (!cut(ray, accuracy, path)) return;
  const auto& [o, d, begin, end, dd, od, oo, is_upright, per_dd] = path;
  out.extend(begin, end);
  out.has_texture = out.has_texture || texture() != nullptr;
  if (is_warped()) {
    add_warped_plane(ray, path, out);
  } else {
    add_plane(ray, path, out);
  }
  // A ring has places of its own.
  if (shape_.radial.is_ring()) {
    if (!is_upright) add_ring(path, out);
    return;
  }
  // The cusp of exp(-r/rh) at the axis, and a hole.
  const double axis = is_upright ? 0.5 * (begin + end) : -od * per_dd;
  if (!is_upright && axis > begin && axis < end) {
    const double impact2 = std::max(oo + od * axis, 0.0);
    const double finest = shape_.inner > 0 ? hole_width * shape_.inner : cusp_width * shape_.rh;
    const double width = std::sqrt(std::max(impact2 + finest * finest, least_divisor) * per_dd);
    out.focuses.push_back({axis, width, nodes_per_arm_width / width});
  }
}

void Layer::add_plane(const BallRay& ray, const Path& path, RayPlan& out) const {
  const auto& [o, d, begin, end, dd, od, oo, is_upright, per_dd] = path;
  // The envelope is largest near the plane, shifted towards the axis along grazing rays, but not in
  // a ring.
  double across = std::abs(d[2]) / shape_.z0;
  const double along = std::sqrt(dd) / law_.length();
  const double axis = is_upright ? 0.5 * (begin + end) : -od * per_dd;
  double centre = axis;
  if (across > 0) {
    const double plane = -o[2] / d[2];
    if (shape_.flare > 0) {
      across /= shape_.flare_at(std::min(length(o[0] + plane * d[0], o[1] + plane * d[1]), 1.0));
    }
    const double shift = shape_.radial.is_ring() ? 0.0 : brightest_shift(along, across);
    centre = is_upright ? plane : plane + std::clamp(axis - plane, -shift, shift);
  }
  centre = std::clamp(centre, begin, end);
  const double speed = std::sqrt(dd + d[2] * d[2]);
  out.focuses.push_back(
      {centre, layer_width / (across + 0.5 * along), across + along + texture_rate(ray, speed)});
}

void Layer::add_warped_plane(const BallRay& ray, const Path& path, RayPlan& out) const {
  const auto& [o, d, begin, end, dd, od, oo, is_upright, per_dd] = path;
  const double along = std::sqrt(dd) / law_.length();
  const double axis = is_upright ? 0.5 * (begin + end) : -od * per_dd;
  const double texture = texture_rate(ray, std::sqrt(dd + d[2] * d[2]));
  bool is_passed = false;
  const auto add = [&](double plane, double across) {
    const double shift = shape_.radial.is_ring() || is_upright ? 0 : brightest_shift(along, across);
    const double centre = plane + std::clamp(axis - plane, -shift, shift);
    out.focuses.push_back({std::clamp(centre, begin, end), layer_width / (across + 0.5 * along),
                           across + along + texture});
    is_passed = true;
  };
  const WarpedRay warped(shape_.warp, ray.origin, ray.direction, begin, end, 0);
  for (const WarpedRay::Pass& pass : warped.passes()) {
    const double r = length(o[0] + pass.t * d[0], o[1] + pass.t * d[1]);
    const double h = height_at(r);
    if (pass.height > seen_heights * h) continue;
    // Next to a fold the height changes by h over sqrt(h/curvature).
    add(pass.t, length(pass.slope, std::sqrt(pass.curvature * h)) / h);
  }
  if (!is_passed) add(std::clamp(axis, begin, end), std::abs(d[2]) / shape_.z0);
}

void Layer::add_ring(const Path& path, RayPlan& out) const {
  const auto& [o, d, begin, end, dd, od, oo, is_upright, per_dd] = path;
  const double radius = shape_.radial.ring_radius, ring_width = law_.length(), axis = -od / dd;
  const double inside2 = radius * radius - std::max(oo + od * axis, 0.0);
  if (inside2 < 0 && std::sqrt(radius * radius - inside2) - radius > seen_widths * ring_width) {
    return;
  }
  // Along the ray m changes at the rate sqrt(inside2 dd)/r_0, and quadratically next to the axis.
  const double half = std::sqrt(std::max(inside2, 0.0) / dd);
  const double width =
      ring_width * radius / std::sqrt(dd * (std::max(inside2, 0.0) + ring_width * radius));
  for (const double place : {axis - half, axis + half}) {
    if (place > begin && place < end) {
      out.focuses.push_back({place, layer_width * width, nodes_per_ring_width / width});
    }
    if (half == 0) return;
  }
}

}  // namespace gamer
