#include "gamer/galaxy/kinds/layer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/layer.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/arm_courses-inl.h"
#include "galaxy/kinds/taper-inl.h"
#include "gamer/core/random.h"
#include "gamer/core/units.h"
#include "gamer/noise/footprint.h"

#ifndef GAMER_GALAXY_LAYER_KERNEL
#define GAMER_GALAXY_LAYER_KERNEL
namespace gamer {
namespace {

struct LayerKernelInput {
  float z_factor;       ///< -2/z0, over ln 2
  float r_factor;       ///< -1/rh, over ln 2
  float inverse_inner;  ///< 1/inner, or 0 for no hole
  float arm_width;      ///< 0 for no arms
  float shift;
  bool even;  ///< arms at equal angles
  float arm_count;
  const double* offsets;  ///< of uneven arms
  std::size_t offset_count;
  const float* courses;  ///< tables of ArmCourses; null for arms that are alike
  std::size_t course_count;
  float floor, inverse_width;  ///< of ArmProfile
};

/// The cells of a cloud in a layer: radial x azimuthal x vertical, counted along z first.
struct CloudInput {
  float radial, azimuthal, vertical;
  const float* node_radius;  ///< of cloud_nodes + 1 equal steps of the light inside
  float z0;
  float twirl;
};

// Number of nodes between which r is linear in the share of the light inside.
constexpr int cloud_nodes = 1024;

// Largest share of the light on one side of the plane, which keeps the cloud within finite heights.
constexpr float largest_share = 1 - 1e-6f;

// Upper bound of the points of a cloud, which single precision can count.
constexpr std::size_t largest_cloud_size = std::size_t{1} << 23;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Delta in [0, pi]: the distance of `angle` from the nearest multiple of the period.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V DistanceToMultiple(D d, V angle, double period) {
  // The period has two parts. The first has few bits, so that its multiples are exact.
  const float high = std::floor(static_cast<float>(period) * 0x1p10f) * 0x1p-10f;
  const auto low = static_cast<float>(period - double{high});
  const V n = hn::Round(hn::Mul(angle, hn::Set(d, static_cast<float>(1 / period))));
  const V rest = hn::NegMulAdd(n, hn::Set(d, high), angle);
  return hn::Abs(hn::NegMulAdd(n, hn::Set(d, low), rest));
}

/// ArmCourses' F at this angle from the pattern's winding.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V CourseFactor(D d, V r, V angle, const LayerKernelInput& in) {
  const V one = hn::Set(d, 1.0f);
  // x^2/2 as a power of 2.
  const float scale = -0.5f * std::numbers::log2e_v<float>;
  const ArmNodes nodes(d, r);
  V missed = one;
  for (std::size_t k = 0; k < in.course_count; ++k) {
    const float* table = in.courses + k * ArmCourses::arm_size;
    const V strength = nodes.At(d, table, 1);
    if (hn::AllFalse(d, hn::Gt(strength, hn::Zero(d)))) continue;
    const V away = WithoutTurns(d, hn::Sub(angle, nodes.At(d, table, 0)));
    const V x = hn::Mul(hn::Mul(away, hn::Set(d, in.inverse_width)), nodes.At(d, table, 2));
    const V gauss = Exp2(d, hn::Mul(hn::Mul(x, x), hn::Set(d, scale)));
    missed = hn::NegMulAdd(hn::Mul(strength, gauss), missed, missed);
  }
  return hn::MulAdd(hn::Set(d, in.floor - 1), missed, one);
}

/// The envelope, with an absolute error below 4e-7 + 1.5e-7 A_w for exact coordinates and windings.
void LayerEnvelope(const SampleBatch& batch, const LayerKernelInput& in, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  constexpr double full_turn = 2 * std::numbers::pi;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto r = hn::Load(d, batch.r.data() + i);
    const auto z = hn::Abs(hn::Load(d, batch.z.data() + i));
    // sech^2(u) = 4 e^(-2u)/(1 + e^(-2u))^2
    const auto e = Exp2(d, hn::Mul(z, hn::Set(d, in.z_factor)));
    const auto sum = hn::Add(one, e);
    auto value = hn::Div(hn::Mul(hn::Set(d, 4.0f), e), hn::Mul(sum, sum));
    auto exponent = hn::Mul(r, hn::Set(d, in.r_factor));
    if (in.arm_width > 0) {
      // The winding, which may be many turns, is added last, for a single rounding of large
      // numbers.
      const auto angle =
          hn::Sub(hn::Sub(hn::Load(d, batch.azimuth.data() + i), hn::Set(d, in.shift)),
                  hn::Load(d, batch.winding.data() + i));
      auto delta = hn::Set(d, static_cast<float>(full_turn));
      if (in.courses != nullptr) {
        value = hn::Mul(value, CourseFactor(d, r, angle, in));
      } else if (in.even) {
        delta = DistanceToMultiple(d, angle, full_turn / double{in.arm_count});
      } else {
        for (std::size_t k = 0; k < in.offset_count; ++k) {
          delta = hn::Min(
              delta,
              DistanceToMultiple(d, hn::Sub(angle, hn::Set(d, static_cast<float>(in.offsets[k]))),
                                 full_turn));
        }
      }
      if (in.courses == nullptr) {
        const auto closeness = hn::NegMulAdd(delta, hn::Set(d, std::numbers::inv_pi_v<float>), one);
        exponent = hn::MulAdd(hn::Set(d, in.arm_width * std::numbers::log2e_v<float>),
                              Log(d, closeness), exponent);
      }
    }
    value = hn::Mul(value, Exp2(d, exponent));
    if (in.inverse_inner > 0) {
      auto q = hn::Mul(r, hn::Set(d, in.inverse_inner));
      q = hn::Mul(q, q);
      value = hn::Mul(value, hn::Sub(one, Exp(d, hn::Neg(hn::Mul(q, q)))));
    }
    hn::Store(hn::Mul(value, hn::Load(d, batch.taper.data() + i)), d, out + i);
  }
}

/// Points of the cloud from index `first` on: r, phi, and the weight that the placing gives them.
void DrawCloud(const CloudInput& in, std::size_t first, SampleBatch& batch, BatchArray& share,
               BatchArray& weight) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  constexpr float half_turn = std::numbers::pi_v<float>;
  const auto half = hn::Set(d, 0.5f);
  const auto one = hn::Set(d, 1.0f);
  const auto vertical = hn::Set(d, in.vertical);
  const auto azimuthal = hn::Set(d, in.azimuthal);
  // Within its cell a point is shifted by multiples of irrational numbers.
  const auto shifted = [&](auto cell, auto one_cell, std::size_t one_step, auto other_cell,
                           std::size_t other_step) HWY_ATTR {
    const auto step = [](std::size_t k) {
      return static_cast<std::uint32_t>(R3Sequence::steps[k] >> 32);
    };
    const auto bits = [&](auto value)
                          HWY_ATTR { return hn::BitCast(du, hn::ConvertTo(di, value)); };
    const auto word = hn::Add(hn::Mul(bits(one_cell), hn::Set(du, step(one_step))),
                              hn::Mul(bits(other_cell), hn::Set(du, step(other_step))));
    const auto shift = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(word)));
    return hn::MulAdd(shift, hn::Set(d, 0x1p-24f), cell);
  };
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto index = hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(first + i)));
    const auto column = hn::Floor(hn::Div(hn::Add(index, half), vertical));
    const auto c = hn::NegMulAdd(column, vertical, index);
    const auto a = hn::Floor(hn::Div(hn::Add(column, half), azimuthal));
    const auto b = hn::NegMulAdd(a, azimuthal, column);
    const auto u_radial = shifted(a, b, 0, c, 1);
    const auto u_angle = shifted(b, c, 2, a, 0);
    const auto u_height = shifted(c, a, 1, b, 2);
    const auto node = hn::Mul(u_radial, hn::Set(d, cloud_nodes / in.radial));
    const auto k = hn::Min(hn::Floor(node), hn::Set(d, cloud_nodes - 1.0f));
    const auto at = hn::Max(hn::ConvertTo(di, k), hn::Zero(di));
    const auto inner = hn::GatherIndex(d, in.node_radius, at);
    const auto width = hn::Sub(hn::GatherIndex(d, in.node_radius + 1, at), inner);
    const auto r = hn::MulAdd(hn::Sub(node, k), width, inner);
    auto v = hn::Sub(hn::Div(hn::Add(u_height, u_height), vertical), one);
    v = hn::Min(hn::Max(v, hn::Set(d, -largest_share)), hn::Set(d, largest_share));
    hn::Store(r, d, batch.r.data() + i);
    hn::Store(hn::Mul(hn::Sub(hn::Div(u_angle, azimuthal), half), hn::Set(d, 2 * half_turn)), d,
              batch.azimuth.data() + i);
    hn::Store(v, d, share.data() + i);
    hn::Store(hn::Div(hn::Mul(r, width), hn::NegMulAdd(v, v, one)), d, weight.data() + i);
  }
}

/// z = z0 atanh(v), and x, y turned back by the twirl.
void PlaceCloud(const SampleBatch& batch, const BatchArray& v, const CloudInput& in,
                WeightedBatch& points, BatchArray& taper) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto share = hn::Load(d, v.data() + i);
    const auto ratio = hn::Div(hn::Add(one, share), hn::Sub(one, share));
    const auto z = hn::Mul(Log(d, ratio), hn::Set(d, 0.5f * in.z0));
    const auto r = hn::Load(d, batch.r.data() + i);
    auto sine = hn::Zero(d);
    auto cosine = hn::Zero(d);
    SinCos(d,
           hn::NegMulAdd(hn::Load(d, batch.winding.data() + i), hn::Set(d, in.twirl),
                         hn::Load(d, batch.azimuth.data() + i)),
           sine, cosine);
    hn::Store(hn::Mul(r, cosine), d, points.x.data() + i);
    hn::Store(hn::Mul(r, sine), d, points.y.data() + i);
    hn::Store(z, d, points.z.data() + i);
    hn::Store(Taper(d, hn::Sqrt(hn::MulAdd(r, r, hn::Mul(z, z)))), d, taper.data() + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(LayerEnvelope);
HWY_EXPORT(DrawCloud);
HWY_EXPORT(PlaceCloud);

namespace {

constexpr double pi = std::numbers::pi;

// Range of equally spaced nodes around the layer's brightest place, in scale heights or lengths.
constexpr double layer_width = 1.5;

// Density of nodes around the ray's closest approach to the axis, and the least distance used, in
// scale lengths or radii of the hole.
constexpr double nodes_per_width = 1.2;
constexpr double cusp_width = 0.15;
constexpr double hole_width = 0.5;

// Number of nodes per period of the texture's sharpest features. Fewer nodes would miss features
// unnoticed.
constexpr double nodes_per_period = 2;

// Smallest divisor.
constexpr double least_divisor = std::numeric_limits<double>::min();

// Largest product of frequency and footprint of octaves that nodes follow; four fifths of this
// octave are resolved. Finer octaves are faint, and doubled nodes find them.
constexpr double seen_cycles = fade_begin + 4 * (fade_end - fade_begin) / 15;

// End of integrals over the layer, in scale lengths x; (1 + x) e^-x of the light is beyond.
constexpr double reach = 30;

// Scale lengths (e^-9) and heights (sech^2 of 5) beyond which the layer's column is negligible.
constexpr double seen_lengths = 9;
constexpr double seen_heights = 5;

// Lengths over which columns change, in scale lengths or heights, and in periods of a texture.
constexpr double column_lengths = 2;
constexpr double texture_periods = 0.35;

// Size of the cusp of exp(-r/rh) at the axis, in scale lengths. Length over which the profile of
// arms changes, in lengths over which it falls by e. Where this length is below finest_arm galaxy
// radii there is little light.
constexpr double cusp_lengths = 0.5;
constexpr double arm_lengths = 1;
constexpr double finest_arm = 1.0 / 96;

// Width of a hole's rim as a share of its radius.
constexpr double rim_width = 0.6;

// Bright range of the layer, in scale lengths and heights.
constexpr double bright_radius = 3;
constexpr double bright_height = 3.5;

// Intervals between radii at which the mean of arms that vary is known.
constexpr std::size_t mean_intervals = 128;

// Radius outside which the steepest winding sets the texture's frequency.
constexpr double twirl_core = 0.1;

/// The x with 1 - (1 + x) e^-x = u, by Newton's method from a series or asymptotic start.
double gamma2_quantile(double u) {
  double x =
      u < 0.5 ? std::sqrt(2 * u) * (1 + std::sqrt(2 * u) / 3) : 1.7 - 1.2 * std::log(2 * (1 - u));
  for (int i = 0; i < 50; ++i) {
    const double f = 1 - (1 + x) * std::exp(-x) - u;
    const double step = f / (x * std::exp(-x));
    x = std::max(x - step, 0.5 * x);
    if (std::abs(step) < 1e-10 * x) break;
  }
  return x;
}

/// The side of `count` cubes that fill a box. In a thin box it is the side of squares that fill its
/// widest face, or the length of pieces of its longest edge.
double cell_side(std::array<double, 3> extents, double count) {
  std::sort(extents.begin(), extents.end());
  const auto [thin, middle, longest] = extents;
  if (const double cube = std::cbrt(thin * middle * longest / count); thin >= cube) return cube;
  const double square = std::sqrt(middle * longest / count);
  return middle >= square ? square : longest / count;
}

/// The largest value of a layer's radial profile in the plane.
double radial_peak(const LayerShape& shape) {
  if (shape.inner == 0) return 1;
  constexpr int samples = 1000;
  const double end = std::min(1.0, reach * shape.rh);
  double peak = 0;
  for (int i = 1; i < samples; ++i) {
    const double r = end * i / samples;
    peak = std::max(
        peak, std::exp(-r / shape.rh) * -std::expm1(-std::pow(r / shape.inner, 4)) * taper_at(r));
  }
  return peak;
}

/// The part of [begin, end] where |o + t d| < limit.
bool cut_slab(double o, double d, double limit, double& begin, double& end) {
  if (std::abs(d) < least_divisor) return std::abs(o) < limit;
  const double per_d = 1 / d;
  const double t1 = (-limit - o) * per_d;
  const double t2 = (limit - o) * per_d;
  begin = std::max(begin, std::min(t1, t2));
  end = std::min(end, std::max(t1, t2));
  return begin < end;
}

/// The distance from the axis at which a ray meets the plane. If the ray meets the plane outside
/// the ball, the distance is that of its closest approach to the axis.
double plane_radius(const double nearest[3], const double direction[3]) {
  const double along = nearest[2] / direction[2];
  const double x = nearest[0] - along * direction[0], y = nearest[1] - along * direction[1];
  if (const double r = std::hypot(x, y); r < 1) return r;
  return std::abs(nearest[0] * direction[1] - nearest[1] * direction[0]) /
         std::hypot(direction[0], direction[1]);
}

}  // namespace

Layer::Layer(const LayerShape& shape, const ArmPattern& arms)
    : shape_(shape),
      arms_(arms),
      steepest_winding_(arms.steepest_winding(twirl_core)),
      largest_shear_(arms.largest_shear()),
      peak_(radial_peak(shape)),
      log_peak_(std::log(peak_)) {}

ParameterTable Layer::parameters() {
  return {
      Parameter::number("z0", "galaxy radii", Interval::closed(least_height, 1), 0.02,
                        "scale height of sech^2(z/z0)"),
      Parameter::number("rh", "galaxy radii", Interval::left_open(0, 1), 0.2,
                        "scale length of exp(-r/rh)"),
      Parameter::number("inner", "galaxy radii", Interval::right_open(0, 1), 0.0,
                        "radius of a smooth central hole"),
      Parameter::number("arm_width", "", Interval::closed(0, 100), 0.5,
                        "A_w: larger makes narrower arms; 0 ignores them"),
      Parameter::number(
          "shift", "deg", Interval::any(), 0.0,
          "delta: angle by which this component's arms are turned; towards the concave side it is "
          "negative for ringermacher-mead and positive for logarithmic, times the handedness"),
      Parameter::number(
          "twirl", "", Interval::closed(-10, 10), 0.1,
          "tau: the noise is wound by tau theta(r); at 1 its features run along the arms"),
  };
}

LayerShape Layer::read_shape(const ParameterSet& values, bool has_arm_width) {
  LayerShape shape;
  shape.z0 = values.number("z0");
  shape.rh = values.number("rh");
  shape.inner = values.number("inner");
  shape.arm_width = has_arm_width ? values.number("arm_width") : 0.0;
  shape.shift = std::remainder(values.number("shift"), 360.0) * degree;
  return shape;
}

void Layer::envelope(const SampleBatch& batch, float* out) const {
  LayerKernelInput in{};
  in.z_factor = static_cast<float>(-2 / shape_.z0 / std::numbers::ln2);
  in.r_factor = static_cast<float>(-1 / shape_.rh / std::numbers::ln2);
  in.inverse_inner = shape_.inner > 0 ? static_cast<float>(1 / shape_.inner) : 0.0f;
  in.arm_width = follows_arms() ? static_cast<float>(shape_.arm_width) : 0.0f;
  in.shift = static_cast<float>(shape_.shift);
  in.even = arms_.is_even();
  in.arm_count = static_cast<float>(std::max(arms_.count(), 1));
  in.offsets = arms_.offsets().data();
  in.offset_count = arms_.offsets().size();
  if (follows_courses()) {
    const ArmProfile profile(shape_.arm_width, arms_.courses()->trunks());
    in.courses = arms_.courses()->table();
    in.course_count = arms_.courses()->size();
    in.floor = static_cast<float>(profile.floor);
    in.inverse_width = static_cast<float>(1 / profile.width);
  }
  HWY_DYNAMIC_DISPATCH(LayerEnvelope)(batch, in, out);
}

std::vector<double> Layer::mean_course_factors() const {
  const ArmProfile profile(shape_.arm_width, arms_.courses()->trunks());
  std::vector<double> result;
  for (std::size_t k = 0; k <= mean_intervals; ++k) {
    result.push_back(profile.mean(*arms_.courses(), static_cast<double>(k) / mean_intervals));
  }
  return result;
}

double Layer::mean_arm_modifier() const {
  if (!follows_arms()) return 1;
  // Between neighbours a gap g apart Delta rises to g/2 and falls again.
  std::vector<double> angles;
  for (double offset : arms_.offsets()) {
    angles.push_back(offset - 2 * pi * std::floor(offset / (2 * pi)));
  }
  std::sort(angles.begin(), angles.end());
  const double power = shape_.arm_width + 1;
  double sum = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double next = i + 1 < angles.size() ? angles[i + 1] : angles[0] + 2 * pi;
    sum += 1 - std::pow(1 - (next - angles[i]) / (2 * pi), power);
  }
  return sum / power;
}

double Layer::envelope_integral() const {
  // Midpoint rules in v and t: z = z0 atanh(v) turns sech^2 into a constant, and with r = end t^2
  // the integrand's first derivatives vanish at the centre.
  constexpr int radial = 1000;
  constexpr int vertical = 200;
  const double end = std::min(1.0, reach * shape_.rh);
  std::array<double, vertical> height2;
  for (int j = 0; j < vertical; ++j) {
    height2[static_cast<std::size_t>(j)] =
        std::pow(shape_.z0 * std::atanh((j + 0.5) / vertical), 2);
  }
  const bool varies = follows_courses();
  const std::vector<double> factors =
      varies ? mean_course_factors() : std::vector<double>(mean_intervals + 1, 1.0);
  double sum = 0;
  for (int i = 0; i < radial; ++i) {
    const double t = (i + 0.5) / radial;
    const double r = end * t * t;
    const auto node = std::min(static_cast<std::size_t>(r * mean_intervals), mean_intervals - 1);
    const double beyond = r * mean_intervals - static_cast<double>(node);
    const double arms = factors[node] + beyond * (factors[node + 1] - factors[node]);
    double column = 0;
    if (r * r + height2.back() < taper_start * taper_start) {
      column = vertical;
    } else {
      for (const double z2 : height2) column += taper_at(std::sqrt(r * r + z2));
    }
    const double hole = shape_.inner > 0 ? -std::expm1(-std::pow(r / shape_.inner, 4)) : 1.0;
    sum += 2 * end * t * r * std::exp(-r / shape_.rh) * hole * column / vertical * arms;
  }
  return 2 * pi * 2 * shape_.z0 * sum / radial * (varies ? 1 : mean_arm_modifier());
}

/// Cells that hold equal shares of r exp(-r/rh), of the angle and of sech^2.
struct Layer::Cells {
  CloudInput input;
  std::vector<float> node_radius;
  std::size_t count;
};

Layer::Cells Layer::cells(std::size_t radial, std::size_t azimuthal, std::size_t vertical) const {
  const double end = std::min(1 / shape_.rh, reach);
  const double inside = 1 - (1 + end) * std::exp(-end);
  Cells result{{}, std::vector<float>(cloud_nodes + 1, 0.0f), radial * azimuthal * vertical};
  for (int k = 1; k <= cloud_nodes; ++k) {
    const double lengths = k < cloud_nodes ? gamma2_quantile(inside * k / cloud_nodes) : end;
    result.node_radius[static_cast<std::size_t>(k)] = static_cast<float>(shape_.rh * lengths);
  }
  result.input = {static_cast<float>(radial),
                  static_cast<float>(azimuthal),
                  static_cast<float>(vertical),
                  result.node_radius.data(),
                  static_cast<float>(shape_.z0),
                  texture() != nullptr ? static_cast<float>(texture()->twirl()) : 0.0f};
  return result;
}

Cloud Layer::cloud(std::size_t size) const {
  // Each cell has one point, weighted with the rest of the envelope. The sides of cells are about
  // equal where the layer is bright. The mean of a noise of any frequency then converges faster
  // than over points of equal weight (tests: <Phi> = 1 to 1 %).
  const double length = std::min(bright_radius * shape_.rh, 1.0);
  const double circle = 2 * pi * length / bright_radius;
  const double height = std::min(bright_height * shape_.z0, 1.0);
  const double side = cell_side({length, circle, height}, static_cast<double>(size));
  const auto count = [side](double extent) {
    return static_cast<std::size_t>(std::max(std::round(extent / side), 1.0));
  };
  const std::size_t vertical = count(height);
  const std::size_t azimuthal = count(circle);
  const std::size_t radial = std::min(count(length), largest_cloud_size / (azimuthal * vertical));
  const auto own = std::make_shared<const Cells>(cells(radial, azimuthal, vertical));
  const auto fill = [this, own](std::size_t b, WeightedBatch& batch) {
    SampleBatch samples{};
    BatchArray share, weight;
    const std::size_t first = b * batch_capacity;
    batch.size = samples.size = std::min(batch_capacity, own->count - first);
    HWY_DYNAMIC_DISPATCH(DrawCloud)(own->input, first, samples, share, weight);
    arms_.winding(samples.r.data(), samples.size, samples.winding.data());
    HWY_DYNAMIC_DISPATCH(PlaceCloud)(samples, share, own->input, batch, samples.taper);
    samples.z = batch.z;
    envelope(samples, batch.weight.data());
    for (std::size_t i = 0; i < batch.size; ++i) batch.weight[i] *= weight[i];
  };
  return {(own->count + batch_capacity - 1) / batch_capacity, fill};
}

ColumnCloud Layer::columns(std::size_t size, std::size_t heights) const {
  ColumnCloud result;
  // Heights have equal shares of sech^2.
  for (std::size_t k = 0; k < heights; ++k) {
    const double share = (2 * static_cast<double>(k) + 1) / static_cast<double>(heights) - 1;
    result.heights.push_back(static_cast<float>(shape_.z0 * std::atanh(share)));
    result.steps.push_back(
        static_cast<float>(2 * shape_.z0 / static_cast<double>(heights) / (1 - share * share)));
  }
  const double length = std::min(bright_radius * shape_.rh, 1.0);
  const double circle = 2 * pi * length / bright_radius;
  const double side = std::sqrt(length * circle / static_cast<double>(size));
  const auto azimuthal = static_cast<std::size_t>(std::ceil(circle / side));
  const Cells own = cells(std::max<std::size_t>(size / azimuthal, 1), azimuthal, 1);
  result.columns.resize((own.count + batch_capacity - 1) / batch_capacity);
  for (std::size_t b = 0; b < result.columns.size(); ++b) {
    SampleBatch samples{};
    BatchArray share;
    const std::size_t first = b * batch_capacity;
    WeightedBatch& batch = result.columns[b];
    batch.size = samples.size = std::min(batch_capacity, own.count - first);
    HWY_DYNAMIC_DISPATCH(DrawCloud)(own.input, first, samples, share, batch.weight);
    for (std::size_t i = 0; i < batch.size; ++i) {
      batch.x[i] = samples.r[i] * std::cos(samples.azimuth[i]);
      batch.y[i] = samples.r[i] * std::sin(samples.azimuth[i]);
      // The columns' weights exclude the factor of the height.
      batch.weight[i] *= 1 - share[i] * share[i];
    }
  }
  return result;
}

double Layer::texture_frequency() const {
  if (texture() == nullptr) return 0;
  const double frequency = texture()->frequency();
  const double twirl = texture()->twirl();
  return twirl != 0 ? frequency * std::hypot(1.0, twirl * steepest_winding_) : frequency;
}

bool Layer::hides_texture(double footprint) const {
  if (texture() == nullptr) return false;
  // The margin covers a footprint that single precision rounds up.
  constexpr double margin = 1 + 1e-5;
  return texture()->hides(footprint * margin * footprint_scale() *
                          stretch_of(texture()->twirl() * largest_shear_));
}

ColumnScale Layer::column_scale(const double nearest[3], const double direction[3],
                                double reach) const {
  const double distance = std::hypot(nearest[0], nearest[1], nearest[2]);
  if (distance - reach > seen_lengths * std::max(shape_.rh, shape_.z0)) return {};
  // The ray's least height above the plane, within the ball.
  const double half_chord = std::sqrt(std::max(1 - distance * distance, 0.0));
  const double height = std::max(std::abs(nearest[2]) - half_chord * std::abs(direction[2]), 0.0);
  if (height - reach > seen_heights * shape_.z0) return {};
  const double cosine = std::abs(direction[2]);
  const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
  double scale =
      column_lengths * std::min(shape_.rh, std::hypot(shape_.rh * cosine, shape_.z0 * sine));
  if (shape_.inner > 0 && distance - reach < 2 * shape_.inner) {
    scale = std::min(
        scale, std::hypot(rim_width * shape_.inner * cosine, column_lengths * shape_.z0 * sine));
  }
  const double r = std::max(plane_radius(nearest, direction) - reach, 0.0);
  scale = std::min(scale, std::hypot(r, cusp_lengths * shape_.rh));
  // Arms extend over many rays, whose errors average out like those of a texture.
  const double frequency = texture_frequency();
  double texture = frequency > 0 ? texture_periods / frequency : HUGE_VAL;
  if (follows_arms()) {
    const double fall = follows_courses()
                            ? ArmProfile(shape_.arm_width, arms_.courses()->trunks()).width
                            : std::numbers::pi / shape_.arm_width;
    const double length = r > 0 ? arm_lengths * fall * r / std::hypot(1.0, arms_.shear(r)) : 0.0;
    texture = std::min(texture, std::max(length, finest_arm));
  }
  return {.envelope = scale, .texture = texture};
}

void Layer::plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const {
  const auto& o = ray.origin;
  const auto& d = ray.direction;
  const double dd = d[0] * d[0] + d[1] * d[1];
  const double od = o[0] * d[0] + o[1] * d[1];
  const double oo = o[0] * o[0] + o[1] * o[1];
  // The part of the ray where sech^2(z/z0) exp(-r/rh) can exceed the threshold.
  double begin = ray.begin, end = ray.end;
  const double log_least = accuracy.log_envelope_threshold + log_peak_;
  // sech^2(u) < 4 e^(-2u)
  const double z_limit = shape_.z0 * (std::numbers::ln2 - 0.5 * log_least);
  if (!cut_slab(o[2], d[2], z_limit, begin, end)) return;
  const double r_limit = -shape_.rh * log_least;
  const bool is_upright = dd < least_divisor;
  const double per_dd = is_upright ? 0.0 : 1 / dd;
  if (!is_upright) {
    const double root2 = od * od - dd * (oo - r_limit * r_limit);
    if (root2 <= 0) return;
    const double root = std::sqrt(root2);
    begin = std::max(begin, (-od - root) * per_dd);
    end = std::min(end, (-od + root) * per_dd);
    if (end <= begin) return;
  } else if (oo >= r_limit * r_limit) {
    return;
  }
  out.extend(begin, end);
  out.has_texture = out.has_texture || texture() != nullptr;
  // The envelope is largest near the plane, shifted towards the axis along grazing rays. There the
  // derivatives of 2 ln cosh(z/z0) and of r/rh along the ray balance.
  const double across = std::abs(d[2]) / shape_.z0;
  const double along = std::sqrt(dd) / shape_.rh;
  const double axis = is_upright ? 0.5 * (begin + end) : -od * per_dd;
  double centre = axis;
  if (across > 0) {
    const double plane = -o[2] / d[2];
    const double shift = 0.5 * along / (across * across);
    centre = is_upright ? plane : plane + std::clamp(axis - plane, -shift, shift);
  }
  centre = std::clamp(centre, begin, end);
  const double speed = std::sqrt(dd + d[2] * d[2]);
  double frequency = texture_frequency();
  if (texture() != nullptr && ray.footprint > 0) {
    const double seen = seen_cycles * texture()->sharpness() / footprint_scale();
    frequency = std::min(frequency, seen / ray.footprint);
  }
  const double texture_rate = nodes_per_period * frequency * speed;
  out.focuses.push_back(
      {centre, layer_width / (across + 0.5 * along), across + along + texture_rate});
  // The cusp of exp(-r/rh) at the axis, and a hole.
  if (!is_upright && axis > begin && axis < end) {
    const double impact2 = std::max(oo + od * axis, 0.0);
    const double finest = shape_.inner > 0 ? hole_width * shape_.inner : cusp_width * shape_.rh;
    const double width = std::sqrt(std::max(impact2 + finest * finest, least_divisor) * per_dd);
    out.focuses.push_back({axis, width, nodes_per_width / width});
  }
}

}  // namespace gamer
#endif
