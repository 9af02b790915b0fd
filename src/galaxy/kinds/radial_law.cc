#include "gamer/galaxy/kinds/radial_law.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/shared_values.h"
#include "galaxy/running_sums.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/error.h"
#include "gamer/core/units.h"
#include "gamer/galaxy/sample_batch.h"

namespace gamer {
namespace {

// End of integrals, in scale lengths x: the share (1 + x) e^-x of the light lies beyond. The end in
// widths of a ring, where the profile is e^-32.
constexpr double most_lengths = 30;
constexpr double ring_reach = 8;

// Bright range of the layer: scale lengths, and widths on each side of a ring.
constexpr double bright_scale_lengths = 3;
constexpr double bright_widths = 2;

// Number of steps in m of integrals.
constexpr int steps = 1 << 14;

/// ln(1 + e^x).
double softplus(double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); }

/// The x with 1 - (1 + x) e^-x = u, by Newton's method from `start`.
double gamma2_quantile(double u, double start) {
  double x = start;
  for (int i = 0; i < 50; ++i) {
    const double decay = std::exp(-x);
    const double step = (1 - (1 + x) * decay - u) / (x * decay);
    x = std::max(x - step, 0.5 * x);
    if (std::abs(step) < 1e-10 * x) break;
  }
  return x;
}

}  // namespace

RadialLaw::RadialLaw(double rh, double inner, const RadialShape& shape)
    : rh_(rh),
      inner_(inner),
      shape_(shape),
      end_(std::min(1 / shape.axis_ratio,
                    shape.is_ring()
                        ? shape.ring_radius + ring_reach * shape.ring_outer_width
                        : most_lengths * (shape.is_broken() ? std::max(rh, shape.outer_rh) : rh))),
      norm_(softplus(-shape.break_sharpness * shape.break_radius) / shape.break_sharpness),
      cosine_(std::cos(shape.position_angle)),
      sine_(std::sin(shape.position_angle)) {
  // Plain exponentials need no tables.
  if (shape.is_ring() || shape.is_broken() || inner > 0) tables_ = shared_tables();
}

std::shared_ptr<const RadialLaw::Tables> RadialLaw::shared_tables() const {
  // All numbers on which the tables depend.
  using Key = std::array<double, 10>;
  static SharedValues<Key, Tables> known;
  const Key key{rh_,
                inner_,
                end_,
                shape_.axis_ratio,
                shape_.break_radius,
                shape_.outer_rh,
                shape_.break_sharpness,
                shape_.ring_radius,
                shape_.ring_width,
                shape_.ring_outer_width};
  return known.find(key, [&] {
    auto tables = std::make_shared<Tables>();
    if (shape_.is_ring() || shape_.is_broken()) {
      tables->inside =
          running_sums(steps, [&](double x) { return end_ * x * std::exp(logarithm(end_ * x)); });
      for (double& share : tables->inside) share /= tables->inside.back();
    }
    if (shape_.is_ring() || inner_ > 0) tables->peak = largest();
    return tables;
  });
}

double RadialLaw::largest() const {
  constexpr int samples = 1000;
  double result = 0;
  const auto look_at = [&](double m) {
    result = std::max(result, std::exp(logarithm(m)) * hole(m) * taper_at(m * shape_.axis_ratio));
  };
  for (int i = 1; i < samples; ++i) look_at(end_ * i / samples);
  if (shape_.is_ring()) look_at(shape_.ring_radius);
  return result;
}

double RadialLaw::logarithm(double m) const {
  if (shape_.is_ring()) {
    const double away = m - shape_.ring_radius;
    const double q = away / (away < 0 ? shape_.ring_width : shape_.ring_outer_width);
    return -0.5 * q * q;
  }
  const double inner = -m / rh_;
  if (!shape_.is_broken()) return inner;
  const double s = shape_.break_sharpness;
  return inner +
         (1 / rh_ - 1 / shape_.outer_rh) * (softplus(s * (m - shape_.break_radius)) / s - norm_);
}

double RadialLaw::hole(double m) const {
  return inner_ > 0 ? -std::expm1(-std::pow(m / inner_, 4)) : 1.0;
}

double RadialLaw::limit(double least) const {
  if (shape_.is_ring()) return shape_.ring_radius + shape_.ring_outer_width * std::sqrt(-2 * least);
  if (!shape_.is_broken()) return -rh_ * least;
  // ln(1 + e^x) is between max(x, 0) and max(x, 0) + ln 2.
  const double change = 1 / rh_ - 1 / shape_.outer_rh;
  const double excess =
      change > 0 ? change * std::numbers::ln2 / shape_.break_sharpness : -change * norm_;
  const double within = rh_ * (excess - least);
  if (within <= shape_.break_radius) return within;
  return shape_.outer_rh * (excess - least - change * shape_.break_radius);
}

double RadialLaw::bound(double nearest, double farthest) const {
  if (!shape_.is_ring()) return std::exp(logarithm(nearest));
  const double outermost = farthest / shape_.axis_ratio;
  return std::exp(logarithm(std::clamp(shape_.ring_radius, nearest, outermost)));
}

std::vector<float> RadialLaw::quantiles(int parts) const {
  std::vector<float> result = {0.0f};
  const double end = std::min(1 / (rh_ * shape_.axis_ratio), most_lengths);
  const double whole = 1 - (1 + end) * std::exp(-end);
  // The first x is about sqrt(2 u). The search for each further x begins at the one before.
  double x = std::sqrt(2 * whole / parts);
  for (int k = 1; k < parts; ++k) {
    const double u = static_cast<double>(k) / parts;
    if (!has_integrals()) {
      x = gamma2_quantile(whole * u, x);
      result.push_back(static_cast<float>(rh_ * x));
      continue;
    }
    result.push_back(static_cast<float>(end_ * place_of_sum(tables_->inside, u)));
  }
  result.push_back(static_cast<float>(has_integrals() ? end_ : rh_ * end));
  return result;
}

double RadialLaw::length() const {
  if (shape_.is_ring()) return std::min(shape_.ring_width, shape_.ring_outer_width);
  return shape_.is_broken() ? std::min(rh_, shape_.outer_rh) : rh_;
}

double RadialLaw::bright_extent() const {
  const double extent = shape_.is_ring()
                            ? bright_widths * (shape_.ring_width + shape_.ring_outer_width)
                            : bright_scale_lengths * rh_;
  return std::min(extent, 1.0);
}

double RadialLaw::bright_circle() const {
  const double circle = 2 * std::numbers::pi;
  return shape_.is_ring() ? circle * shape_.ring_radius
                          : circle * bright_extent() / bright_scale_lengths;
}

void RadialLaw::stretch(const double from[3], double to[3]) const {
  std::copy_n(from, 3, to);
  if (shape_.is_round()) return;
  to[0] = cosine_ * from[0] + sine_ * from[1];
  to[1] = (cosine_ * from[1] - sine_ * from[0]) / shape_.axis_ratio;
}

void RadialLaw::place(double m, double psi, double& r, double& azimuth) const {
  const double along = m * std::cos(psi), across = shape_.axis_ratio * m * std::sin(psi);
  r = std::hypot(along, across);
  azimuth = std::remainder(std::atan2(across, along) + shape_.position_angle, 2 * std::numbers::pi);
}

namespace {

BoundTable radial_keys(RadialShape& p) {
  constexpr double least_width = 2e-3;
  return {{p.break_radius, "break_radius", "galaxy radii", Interval::right_open(0, 1).usual(0, 0.9),
           "where the scale length changes from rh to outer_rh; 0 for no break"},
          without_default({p.outer_rh, "outer_rh", "galaxy radii",
                           Interval::closed(0.01, 1).usual_logarithmic(0.02, 0.5),
                           "scale length outside the break; by default rh/2"}),
          {p.break_sharpness, "break_sharpness", "1/galaxy radii",
           Interval::closed(5, 1000).usual_logarithmic(5, 200), "s: the break is about 4/s wide"},
          {p.ring_radius, "ring_radius", "galaxy radii", Interval::right_open(0, 1).usual(0, 0.9),
           "radius of a ring in place of the exponential; 0 for none"},
          {p.ring_width, "ring_width", "galaxy radii",
           Interval::closed(least_width, 1).usual_logarithmic(0.002, 0.3),
           "standard deviation of the ring's profile"},
          without_default({p.ring_outer_width, "ring_outer_width", "galaxy radii",
                           Interval::closed(least_width, 1).usual_logarithmic(0.005, 0.5),
                           "standard deviation outside the crest; by default ring_width"}),
          {p.axis_ratio, "axis_ratio", "", Interval::closed(0.1, 1).usual(0.2, 1),
           "q: width over length of the ellipses of equal density in the plane"},
          {p.position_angle, "position_angle", "deg", Interval::any().usual(-180, 180),
           "angle of the ellipses from the x axis towards y"}};
}

}  // namespace

ParameterTable RadialLaw::parameters() { return declarations(radial_keys); }

RadialShape RadialLaw::read(const ParameterSet& values, const std::string& context) {
  RadialShape shape = read_object(values, radial_keys);
  if (!values.has("outer_rh")) shape.outer_rh = 0.5 * values.number("rh");
  if (!values.has("ring_outer_width")) shape.ring_outer_width = shape.ring_width;
  shape.position_angle = std::remainder(shape.position_angle, 360.0) * degree;
  const auto check = [&](const char* name, bool is_used, const std::string& why) {
    if (values.is_given(name) && !is_used) {
      throw InputError(values.where(name), context + "'" + name + "' " + why);
    }
  };
  for (const char* name : {"outer_rh", "break_sharpness"}) {
    check(name, shape.break_radius > 0, "belongs to a break; give 'break_radius'");
  }
  for (const char* name : {"ring_width", "ring_outer_width"}) {
    check(name, shape.is_ring(), "belongs to a ring; give 'ring_radius'");
  }
  for (const char* name : {"rh", "break_radius"}) {
    check(name, !shape.is_ring(), "and 'ring_radius' exclude each other");
  }
  check("position_angle", !shape.is_round(), "needs an 'axis_ratio' below 1");
  return shape;
}

}  // namespace gamer
