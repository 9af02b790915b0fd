#include "galaxy/kinds/bar.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/bar.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/kinds/radial_law-inl.h"
#include "galaxy/kinds/ray_cuts.h"
#include "galaxy/kinds/taper_column.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/units.h"
#include "gamer/galaxy/kinds/layer.h"
#include "gamer/galaxy/sample_batch.h"

#ifndef GAMER_GALAXY_BAR_KERNEL
#define GAMER_GALAXY_BAR_KERNEL
namespace gamer {
namespace {

// Place of the ansae, and their standard deviations along and across the bar, in a, a and b.
constexpr double ansa_radius = 0.85;
constexpr double ansa_length = 0.07;
constexpr double ansa_width = 0.4;

/// Constants of the kernel, in galaxy radii.
struct BarKernelInput {
  float u_of_x, u_of_y, v_of_x, v_of_y;
  float boxiness, inverse_boxiness;
  float root;  ///< 1/(c n)
  float decline, inverse_cut;
  float inverse_z0;
  float peanut, peanut_radius, inverse_peanut_width;
  float ansae;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// exp(-((u - centre)/width)^2/2).
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Gaussian(D d, V u, float centre, float inverse_width) {
  const V q = hn::Mul(hn::Sub(u, hn::Set(d, centre)), hn::Set(d, inverse_width));
  return Exp(d, hn::Mul(hn::Mul(q, q), hn::Set(d, -0.5f)));
}

/// The envelope, with an absolute error below 1.4e-7 (1 + k/n + 1/w + 6 F) for exact coordinates.
void BarEnvelope(const SampleBatch& batch, const BarKernelInput& in, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  // Beyond this exponent the cut is complete in single precision.
  const auto most = hn::Set(d, 80.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, batch.x.data() + i);
    const auto y = hn::Load(d, batch.y.data() + i);
    const auto z = hn::Abs(hn::Load(d, batch.z.data() + i));
    const auto u = hn::Abs(hn::MulAdd(x, hn::Set(d, in.u_of_x), hn::Mul(y, hn::Set(d, in.u_of_y))));
    const auto v = hn::Abs(hn::MulAdd(x, hn::Set(d, in.v_of_x), hn::Mul(y, hn::Set(d, in.v_of_y))));
    const auto c = hn::Set(d, in.boxiness);
    const auto log_sum =
        Log(d, hn::Add(Exp(d, hn::Mul(c, Log(d, u))), Exp(d, hn::Mul(c, Log(d, v)))));
    const auto m = Exp(d, hn::Mul(log_sum, hn::Set(d, in.inverse_boxiness)));
    const auto power = Exp(d, hn::Mul(log_sum, hn::Set(d, in.root)));
    const auto rest = Exp(d, hn::Min(hn::Mul(hn::Sub(one, m), hn::Set(d, in.inverse_cut)), most));
    auto value =
        hn::Mul(Exp(d, hn::Mul(power, hn::Set(d, -in.decline))), hn::Div(rest, hn::Add(one, rest)));
    if (in.ansae > 0) {
      auto spots =
          Gaussian(d, u, static_cast<float>(ansa_radius), static_cast<float>(1 / ansa_length));
      spots = hn::Mul(spots, Gaussian(d, v, 0, static_cast<float>(1 / ansa_width)));
      value = hn::MulAdd(spots, hn::Set(d, in.ansae), value);
    }
    auto inverse_height = one;
    if (in.peanut > 0) {
      const auto lobes = hn::Add(Gaussian(d, u, in.peanut_radius, in.inverse_peanut_width),
                                 Gaussian(d, u, -in.peanut_radius, in.inverse_peanut_width));
      inverse_height = hn::Div(one, hn::MulAdd(lobes, hn::Set(d, in.peanut), one));
    }
    const auto q = hn::Mul(z, hn::Mul(inverse_height, hn::Set(d, in.inverse_z0)));
    value = hn::Mul(hn::Mul(value, inverse_height),
                    SquaredSech(d, Exp(d, hn::Mul(q, hn::Set(d, -2.0f)))));
    hn::Store(hn::Mul(value, hn::Load(d, batch.taper.data() + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(BarEnvelope);

namespace {

// Number of nodes per width w of the cut.
constexpr double nodes_per_cut = 0.7;

// Density of nodes around the ray's closest approach to the axis, and the least distance used, in a
// and b.
constexpr double nodes_per_distance = 1.2;
constexpr double nearest_to_axis = 0.1;

// Standard deviations beyond which Gaussians are negligible in integrals.
constexpr double gaussian_reach = 6.5;

// Widths w beyond which the cut leaves nothing.
constexpr double cut_reach = 40;

// The distance in the plane, in e-folds of the cut and in b, beyond which columns are negligible.
constexpr double seen_cuts = 12;
constexpr double seen_ansae = 2;

// Least m at a distance of 1 in units of a and b, 2^(1/c - 1/2) for c = 4.
constexpr double least_metric = 0.84;

}  // namespace

Bar::Bar(const BarShape& shape)
    : shape_(shape),
      cosine_(std::cos(shape.position_angle)),
      sine_(std::sin(shape.position_angle)) {
  // The lobes' sum is largest at x_P, or at the centre where they merge.
  highest_ = std::max(height(0), height(shape.peanut_radius));
}

void Bar::turn(const double from[3], double to[3]) const {
  const double a = shape_.half_length;
  to[0] = (cosine_ * from[0] + sine_ * from[1]) / a;
  to[1] = (cosine_ * from[1] - sine_ * from[0]) / (a * shape_.axis_ratio);
  to[2] = from[2];
}

double Bar::metric(double u, double v) const {
  const double large = std::max(std::abs(u), std::abs(v));
  if (large == 0) return 0;
  const double ratio = std::min(std::abs(u), std::abs(v)) / large;
  return large * std::pow(1 + std::pow(ratio, shape_.boxiness), 1 / shape_.boxiness);
}

double Bar::body(double m) const {
  return std::exp(-shape_.decline * std::pow(m, 1 / shape_.index)) /
         (1 + std::exp(std::min((m - 1) / shape_.cut, 700.0)));
}

double Bar::height(double u) const {
  const auto lobe = [&](double centre) {
    return std::exp(-0.5 * std::pow((u - centre) / shape_.peanut_width, 2));
  };
  return shape_.z0 *
         (1 + shape_.peanut * (lobe(shape_.peanut_radius) + lobe(-shape_.peanut_radius)));
}

double Bar::column(double u, double v) const {
  const double r = shape_.half_length * std::hypot(u, shape_.axis_ratio * v);
  return 2 * shape_.z0 * mean_taper(r, height(u));
}

double Bar::integral_of_body() const {
  // Gauss' rule over directions in the plane of u and v. A point at the distance q from the centre
  // has m = q `stretch`.
  using Directions = boost::math::quadrature::gauss<double, 20>;
  using Radii = boost::math::quadrature::gauss<double, 20>;
  const double w = shape_.cut;
  const std::array<double, 6> ends = {
      0,          std::max(1 - 8 * w, 0.0), std::max(1 - 3 * w, 0.0), 1 + 3 * w,
      1 + 12 * w, 1 + cut_reach * w};
  const double quarter = Directions::integrate(
      [&](double angle) {
        const double cosine = std::cos(angle), sine = std::sin(angle);
        const double stretch = metric(cosine, sine);
        const auto ring = [&](double m) {
          return m * body(m) * column(m * cosine / stretch, m * sine / stretch);
        };
        double sum = 0;
        for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
          if (ends[k + 1] > ends[k]) sum += Radii::integrate(ring, ends[k], ends[k + 1]);
        }
        return sum / (stretch * stretch);
      },
      0.0, 0.5 * std::numbers::pi);
  return 4 * quarter;
}

double Bar::integral_of_ansae() const {
  if (shape_.ansae == 0) return 0;
  using Rule = boost::math::quadrature::gauss<double, 30>;
  const auto across = [&](double u) {
    const double along = (u - ansa_radius) / ansa_length;
    return std::exp(-0.5 * along * along) *
           Rule::integrate(
               [&](double v) {
                 return std::exp(-0.5 * std::pow(v / ansa_width, 2)) * column(u, v);
               },
               0.0, gaussian_reach * ansa_width);
  };
  return 4 * shape_.ansae *
         Rule::integrate(across, ansa_radius - gaussian_reach * ansa_length,
                         ansa_radius + gaussian_reach * ansa_length);
}

double Bar::envelope_integral() const {
  const double area = shape_.half_length * shape_.half_length * shape_.axis_ratio;
  return area * (integral_of_body() + integral_of_ansae());
}

void Bar::envelope(const SampleBatch& batch, float* out) const {
  const double a = shape_.half_length, b = a * shape_.axis_ratio;
  BarKernelInput in{};
  in.u_of_x = static_cast<float>(cosine_ / a);
  in.u_of_y = static_cast<float>(sine_ / a);
  in.v_of_x = static_cast<float>(-sine_ / b);
  in.v_of_y = static_cast<float>(cosine_ / b);
  in.boxiness = static_cast<float>(shape_.boxiness);
  in.inverse_boxiness = static_cast<float>(1 / shape_.boxiness);
  in.root = static_cast<float>(1 / (shape_.boxiness * shape_.index));
  in.decline = static_cast<float>(shape_.decline);
  in.inverse_cut = static_cast<float>(1 / shape_.cut);
  in.inverse_z0 = static_cast<float>(1 / shape_.z0);
  in.peanut = static_cast<float>(shape_.peanut);
  in.peanut_radius = static_cast<float>(shape_.peanut_radius);
  in.inverse_peanut_width = static_cast<float>(1 / shape_.peanut_width);
  in.ansae = static_cast<float>(shape_.ansae);
  HWY_DYNAMIC_DISPATCH(BarEnvelope)(batch, in, out);
}

void Bar::plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const {
  double o[3], d[3];
  turn(ray.origin, o);
  turn(ray.direction, d);
  // The box where the envelope can exceed the threshold.
  const double depth = -accuracy.log_envelope_threshold;
  const double spread = shape_.ansae > 0 ? std::sqrt(2 * depth) : 0.0;
  const double end_of_body = 1 + shape_.cut * depth;
  double begin = ray.begin, end = ray.end;
  if (!cut_slab(o[0], d[0], std::max(end_of_body, ansa_radius + ansa_length * spread), begin,
                end) ||
      !cut_slab(o[1], d[1], std::max(end_of_body, ansa_width * spread), begin, end) ||
      !cut_slab(o[2], d[2], highest_ * (std::numbers::ln2 + 0.5 * depth), begin, end)) {
    return;
  }
  out.extend(begin, end);
  // The envelope is largest near the plane, shifted towards the axis along grazing rays.
  const double dd = d[0] * d[0] + d[1] * d[1];
  const double od = o[0] * d[0] + o[1] * d[1];
  const bool is_upright = dd < least_divisor;
  const double axis = is_upright ? 0.5 * (begin + end) : -od / dd;
  const double fall = std::sqrt(dd) * std::max(shape_.decline, 1.0);
  double across = std::abs(d[2]) / shape_.z0, centre = axis;
  if (across > 0) {
    const double plane = -o[2] / d[2];
    across = std::abs(d[2]) / height(o[0] + plane * d[0]);
    const double shift = 0.5 * fall / (across * across);
    centre = is_upright ? plane : plane + std::clamp(axis - plane, -shift, shift);
  }
  centre = std::clamp(centre, begin, end);
  const double along = std::sqrt(dd) * nodes_per_cut / shape_.cut;
  out.focuses.push_back({centre, layer_width / (across + 0.5 * fall), across + fall + along});
  if (is_upright) return;
  if (axis > begin && axis < end) {
    const double oo = o[0] * o[0] + o[1] * o[1];
    const double impact2 = std::max(oo + od * axis, 0.0);
    const double width = std::sqrt((impact2 + nearest_to_axis * nearest_to_axis) / dd);
    out.focuses.push_back({axis, width, nodes_per_distance / width});
  }
  // Lobes of the height and ansae on rays along the bar.
  const auto add_pair = [&](double u, double along_bar, double width) {
    if (std::abs(d[0]) < least_divisor) return;
    const double rate = length(d[0] / along_bar, width > 0 ? d[1] / width : 0.0);
    for (const double side : {-u, u}) {
      const double place = (side - o[0]) / d[0];
      if (place > begin && place < end) out.focuses.push_back({place, layer_width / rate, rate});
    }
  };
  if (shape_.peanut > 0) add_pair(shape_.peanut_radius, shape_.peanut_width, 0);
  if (shape_.ansae > 0) add_pair(ansa_radius, ansa_length, ansa_width);
}

ColumnScale Bar::column_scale(const double nearest[3], const double direction[3],
                              double reach) const {
  double o[3], d[3];
  turn(nearest, o);
  turn(direction, d);
  const double b = shape_.half_length * shape_.axis_ratio;
  const double distance = length(nearest[0], nearest[1], nearest[2]);
  const double half_chord = std::sqrt(std::max(1 - distance * distance, 0.0));
  const double above = std::max(std::abs(nearest[2]) - half_chord * std::abs(direction[2]), 0.0);
  if (above - reach > seen_heights * highest_) return {};
  // The ray's least distance from the axis, in units of a and b; m is above 0.84 times this
  // distance.
  const double dd = d[0] * d[0] + d[1] * d[1];
  const double axis = dd > 0 ? -(o[0] * d[0] + o[1] * d[1]) / dd : 0.0;
  const double closest = length(o[0] + axis * d[0], o[1] + axis * d[1]);
  const double end = std::max(1 + seen_cuts * shape_.cut, shape_.ansae > 0 ? seen_ansae : 0.0);
  if (least_metric * closest - reach / b > end) return {};
  // The metric where the ray meets the plane within the ball, or else where it is closest to the
  // axis.
  double place = axis;
  if (d[2] != 0) {
    const double plane = -o[2] / d[2];
    if (std::abs(plane) < half_chord) place = plane;
  }
  const double m = metric(o[0] + place * d[0], o[1] + place * d[1]);
  // The edge and the ansae extend over many rays.
  const double outside = std::min(m + reach / b, 1 + shape_.cut);
  const double edge = shape_.cut * (1 + std::exp((1 - outside) / shape_.cut));
  double fine = column_lengths * b * edge;
  if (shape_.ansae > 0) fine = std::min({fine, ansa_width * b, ansa_length * shape_.half_length});
  const double plane = column_lengths * b / std::max(shape_.decline, 1.0);
  const double cosine = std::abs(direction[2]);
  const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
  double side = length(plane * cosine, column_lengths * shape_.z0 * sine);
  if (shape_.peanut > 0)
    side = std::min(side, length(plane, shape_.peanut_width * shape_.half_length));
  return {.envelope = std::min(plane, side), .edge = fine};
}

double Bar::column_brightness(const double nearest[3], const double direction[3],
                              double reach) const {
  double o[3], d[3];
  turn(nearest, o);
  turn(direction, d);
  const double distance = length(nearest[0], nearest[1], nearest[2]);
  const auto beyond = [](double far, double within) { return std::max(far - within, 0.0); };
  const double b = shape_.half_length * shape_.axis_ratio;
  const NeighbourBound near(o, d, distance, reach);
  const auto least = [](double from, double to) {
    return from * to < 0 ? 0.0 : std::min(std::abs(from), std::abs(to));
  };
  const auto bound = [&](double t0, double t1) {
    const double u0 = o[0] + t0 * d[0], u1 = o[0] + t1 * d[0];
    const double v0 = o[1] + t0 * d[1], v1 = o[1] + t1 * d[1];
    const double m = std::min(metric(u0, v0), metric(u1, v1));
    double value = body(beyond(m, reach / b)) / body(0);
    if (shape_.ansae > 0) {
      const double ansa = std::min(least(u0 - ansa_radius, u1 - ansa_radius),
                                   least(u0 + ansa_radius, u1 + ansa_radius));
      const double along = beyond(ansa, reach / shape_.half_length) / ansa_length;
      const double across = beyond(least(v0, v1), reach / b) / ansa_width;
      value += shape_.ansae * std::exp(-0.5 * (along * along + across * across));
    }
    const double cosh = std::cosh(beyond(std::abs(o[2] + t0 * d[2]), near.rise) / highest_);
    return value / (cosh * cosh);
  };
  const double step = d[2] != 0 ? highest_ / std::abs(d[2]) : near.far;
  return std::min(near.largest(step, bound), 1.0);
}

namespace {

BoundTable bar_keys(BarShape& p) {
  return {{p.half_length, "half_length", "galaxy radii",
           Interval::closed(1e-3, 1).usual_logarithmic(0.05, 0.8), "a: where the bar's light ends"},
          {p.axis_ratio, "axis_ratio", "", Interval::closed(0.05, 1).usual(0.05, 1),
           "b/a: width over length"},
          {p.boxiness, "boxiness", "", Interval::closed(2, 4),
           "c of the isophotes |x/a|^c + |y/b|^c: 2 is an ellipse, 4 nearly a box"},
          {p.index, "index", "", Interval::closed(0.5, 1),
           "n of exp(-k m^(1/n)): 0.5 is a Gaussian, 1 exponential"},
          {p.decline, "decline", "", Interval::closed(0, 20).usual(0, 8),
           "k: e-folds from the centre to the end; small is flat"},
          {p.cut, "cut", "", Interval::closed(0.02, 0.5).usual(0.02, 0.5),
           "w: scale length beyond the end, in half-lengths"},
          {p.z0, "z0", "galaxy radii",
           Interval::closed(Layer::least_height, 1).usual_logarithmic(0.002, 0.2),
           "scale height of sech^2(z/z0)"},
          {p.peanut, "peanut", "", Interval::closed(0, 20).usual(0, 5),
           "P: the height grows to about (1 + P) z0 at `peanut_radius`"},
          {p.peanut_radius, "peanut_radius", "", Interval::closed(0, 1),
           "x_P: where the bar is highest, in half-lengths"},
          {p.peanut_width, "peanut_width", "", Interval::closed(0.05, 1),
           "s_P: standard deviation of the height's maxima, in half-lengths"},
          {p.ansae, "ansae", "", Interval::closed(0, 10).usual(0, 4),
           "F: brightness of spots at the ends over that of the centre"},
          {p.position_angle, "position_angle", "deg", Interval::any().usual(-180, 180),
           "angle of the bar from the x axis towards y"}};
}

}  // namespace

ComponentKind bar_kind() {
  ComponentKind kind;
  kind.name = "bar";
  kind.description =
      "stellar bar: generalised ellipses with an end, boxy or like a peanut from the side";
  kind.parameters = declarations(bar_keys);
  kind.make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
    BarShape shape = read_object(input.values, bar_keys);
    shape.position_angle = std::remainder(shape.position_angle, 360.0) * degree;
    return std::make_unique<Bar>(shape);
  };
  return kind;
}

}  // namespace gamer
#endif
