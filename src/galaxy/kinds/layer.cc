#include "gamer/galaxy/kinds/layer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/layer.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/arm_courses-inl.h"
#include "galaxy/kinds/layer_cloud-inl.h"
#include "galaxy/kinds/radial_law-inl.h"
#include "galaxy/kinds/taper-inl.h"
#include "galaxy/kinds/taper_column.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/units.h"

#ifndef GAMER_GALAXY_LAYER_KERNEL
#define GAMER_GALAXY_LAYER_KERNEL
namespace gamer {
namespace {

struct LayerKernelInput {
  float z_factor;  ///< -2/(z0 ln 2)
  RadialConstants law;
  float flare;  ///< flare/ln 2
  float lopsidedness, lopsided_angle;
  float inverse_inner;  ///< 1/inner, or 0 for no hole
  float arm_width;      ///< 0 for no arms
  float shift;
  bool even;  ///< arms at equal angles
  float arm_count;
  const double* offsets;  ///< offsets of uneven arms
  std::size_t offset_count;
  ArmFactorInput courses;  ///< without a table for arms that are alike
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Delta in [0, pi]: the distance of `angle` from the nearest multiple of the period.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V DistanceToMultiple(D d, V angle, double period) {
  const float high = std::floor(static_cast<float>(period) * 0x1p10f) * 0x1p-10f;
  return hn::Abs(NearestRest(d, angle, period, high));
}

/// The envelope, with an absolute error below 4e-7 + 1.5e-7 A_w for exact coordinates and windings.
/// The points are `heights` above the mid-plane.
void LayerEnvelope(const SampleBatch& batch, const float* heights, const LayerKernelInput& in,
                   float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto r = hn::Load(d, batch.r.data() + i);
    auto z = hn::Abs(hn::Load(d, heights + i));
    const auto thinning = hn::Mul(r, hn::Set(d, -in.flare));
    if (in.flare > 0) z = hn::Mul(z, Exp2(d, thinning));
    auto value = SquaredSech(d, Exp2(d, hn::Mul(z, hn::Set(d, in.z_factor))));
    auto m = r;
    if (!in.law.is_round) m = EllipseRadius(d, r, hn::Load(d, batch.azimuth.data() + i), in.law);
    auto exponent = RadialExponent(d, m, in.law);
    if (in.flare > 0) exponent = hn::Add(exponent, thinning);
    if (in.arm_width > 0) {
      // The winding, which may be many turns, is added last, for a single rounding of large
      // numbers.
      const auto angle =
          hn::Sub(hn::Sub(hn::Load(d, batch.azimuth.data() + i), hn::Set(d, in.shift)),
                  hn::Load(d, batch.winding.data() + i));
      auto delta = hn::Set(d, static_cast<float>(full_turn));
      if (in.courses.table != nullptr) {
        value = hn::Mul(value, ArmFactor(d, r, angle, in.courses));
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
      if (in.courses.table == nullptr) {
        const auto closeness = hn::NegMulAdd(delta, hn::Set(d, std::numbers::inv_pi_v<float>), one);
        exponent = hn::MulAdd(hn::Set(d, in.arm_width * std::numbers::log2e_v<float>),
                              Log(d, closeness), exponent);
      }
    }
    value = hn::Mul(value, Exp2(d, exponent));
    if (in.inverse_inner > 0) {
      auto q = hn::Mul(m, hn::Set(d, in.inverse_inner));
      q = hn::Mul(q, q);
      value = hn::Mul(value, hn::Sub(one, Exp(d, hn::Neg(hn::Mul(q, q)))));
    }
    if (in.lopsidedness > 0) {
      auto sine = hn::Zero(d), cosine = hn::Zero(d);
      SinCos(d, hn::Sub(hn::Load(d, batch.azimuth.data() + i), hn::Set(d, in.lopsided_angle)), sine,
             cosine);
      const auto excess = hn::Mul(hn::Mul(r, hn::Set(d, in.lopsidedness)), cosine);
      value = hn::MulAdd(value, excess, value);
    }
    hn::Store(hn::Mul(value, hn::Load(d, batch.taper.data() + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(LayerEnvelope);
HWY_EXPORT(DrawCloud);
HWY_EXPORT(PlaceCloud);

namespace {

constexpr double pi = std::numbers::pi;

// Bright range of the layer, in scale heights.
constexpr double bright_height = 3.5;

// Number of intervals in r of the table of means of arms with courses of their own.
constexpr std::size_t mean_intervals = 256;

// Scale lengths within which the slope of a warp decides how far its texture is stretched.
constexpr double sloped_lengths = 4;

// Angles at which the mean taper of a warped layer is computed. It is linear between them.
constexpr int taper_angles = 64;

// Radius outside which the steepest winding sets the texture's frequency.
constexpr double twirl_core = 0.1;

/// The side of `count` cubes that fill a box. In a thin box it is the side of `count` squares that
/// fill the widest face. In a thin and narrow box it is the length of `count` pieces of the longest
/// edge.
double cell_side(std::array<double, 3> extents, double count) {
  std::ranges::sort(extents);
  const auto [thin, middle, longest] = extents;
  if (const double cube = std::cbrt(thin * middle * longest / count); thin >= cube) return cube;
  const double square = std::sqrt(middle * longest / count);
  return middle >= square ? square : longest / count;
}

/// Squares of z = z0 atanh(v) at midpoints of v, which turns sech^2(z/z0) into a constant.
std::vector<double> squared_heights(double z0, int count) {
  std::vector<double> result;
  for (int j = 0; j < count; ++j) result.push_back(std::pow(z0 * std::atanh((j + 0.5) / count), 2));
  return result;
}

double sum_of_taper(double r, const std::vector<double>& heights2) {
  if (r * r + heights2.back() < taper_start * taper_start) {
    return static_cast<double>(heights2.size());
  }
  double sum = 0;
  for (const double z2 : heights2) sum += taper_at(std::sqrt(r * r + z2));
  return sum;
}

}  // namespace

Layer::Layer(const LayerShape& shape, const ArmPattern& arms)
    : shape_(shape),
      law_(shape.rh, shape.inner, shape.radial),
      arms_(arms),
      steepest_winding_(arms.steepest_winding(twirl_core)),
      largest_shear_(arms.largest_shear()),
      log_peak_(std::log(law_.peak())),
      texture_stretch_(
          stretch_of(shape.warp.steepest(std::min(law_.limit(-sloped_lengths), 1.0)))) {}

namespace {

/// The keys that precede those of the radial law.
BoundTable layer_keys(LayerShape& p) {
  return {{p.z0, "z0", "galaxy radii",
           Interval::closed(Layer::least_height, 1).usual_logarithmic(0.002, 0.2),
           "scale height of sech^2(z/z0)"},
          {p.rh, "rh", "galaxy radii", Interval::left_open(0, 1).usual_logarithmic(0.03, 0.6),
           "scale length of exp(-r/rh)"},
          {p.inner, "inner", "galaxy radii", Interval::right_open(0, 1).usual(0, 0.6),
           "radius of a smooth central hole"},
          Parameter::number("arm_width", "", Interval::closed(0, 100).usual(0, 60), 0.5,
                            "A_w: larger makes narrower arms; 0 ignores them"),
          {p.shift, "shift", "deg", Interval::any().usual(-90, 90),
           "delta: angle by which this component's arms are turned; towards the concave side it is "
           "negative for ringermacher-mead and positive for logarithmic, times the handedness"},
          Parameter::number(
              "twirl", "", Interval::closed(-10, 10).usual(0, 1), 0.1,
              "tau: the noise is wound by tau theta(r); at 1 its features run along the arms")};
}

BoundTable asymmetry_keys(LayerShape& p) {
  return {{p.flare, "flare", "1/galaxy radii", Interval::closed(0, 5).usual(0, 3),
           "growth of the scale height, z0 exp(flare r)"},
          {p.lopsidedness, "lopsidedness", "1/galaxy radii", Interval::closed(0, 1).usual(0, 1),
           "L: one side is brighter by 1 + L r, the other fainter by 1 - L r"},
          {p.lopsided_angle, "lopsided_angle", "deg", Interval::any().usual(0, 360),
           "direction of the brighter side from the x axis towards y"}};
}

}  // namespace

ParameterTable Layer::parameters() {
  return declarations(layer_keys) + RadialLaw::parameters() + declarations(asymmetry_keys) +
         LayerWarp::parameters();
}

LayerShape Layer::read_shape(const ComponentInput& input, bool has_arm_width) {
  const ParameterSet& values = input.values;
  LayerShape shape = read_object(values, layer_keys);
  put_values(values, asymmetry_keys(shape));
  shape.arm_width = has_arm_width ? values.number("arm_width") : 0.0;
  shape.shift = std::remainder(shape.shift, 360.0) * degree;
  shape.radial = RadialLaw::read(values, input.context);
  shape.lopsided_angle = std::remainder(shape.lopsided_angle, 360.0) * degree;
  shape.warp = LayerWarp::read(values);
  return shape;
}

void Layer::envelope_above_plane(const Points& points, float* out) const {
  SampleBatch batch{};
  batch.size = points.size;
  for (std::size_t i = 0; i < batch.size; ++i) {
    batch.x[i] = points.x[i];
    batch.y[i] = points.y[i];
    batch.z[i] = points.z[i];
    batch.r[i] = std::hypot(batch.x[i], batch.y[i]);
    batch.azimuth[i] = std::atan2(batch.y[i], batch.x[i]);
  }
  if (is_warped()) {
    BatchArray lifted;
    lift(batch, lifted.data());
    for (std::size_t i = 0; i < batch.size; ++i) batch.z[i] += lifted[i];
  }
  for (std::size_t i = 0; i < batch.size; ++i) {
    batch.taper[i] =
        static_cast<float>(taper_at(std::hypot(double{batch.r[i]}, double{batch.z[i]})));
  }
  arms_.winding(batch.r.data(), batch.size, batch.winding.data());
  envelope(batch, out);
}

void Layer::envelope(const SampleBatch& batch, float* out) const {
  if (!is_warped()) return envelope_at(batch, batch.z.data(), out);
  BatchArray heights;
  lift(batch, heights.data());
  for (std::size_t i = 0; i < padded(batch.size); ++i) heights[i] = batch.z[i] - heights[i];
  envelope_at(batch, heights.data(), out);
}

void Layer::envelope_at(const SampleBatch& batch, const float* heights, float* out) const {
  LayerKernelInput in{};
  in.z_factor = static_cast<float>(-2 / shape_.z0 / std::numbers::ln2);
  in.law = RadialConstants(shape_.rh, shape_.radial);
  in.flare = static_cast<float>(shape_.flare / std::numbers::ln2);
  in.lopsidedness = static_cast<float>(shape_.lopsidedness);
  in.lopsided_angle = static_cast<float>(shape_.lopsided_angle);
  in.inverse_inner = shape_.inner > 0 ? static_cast<float>(1 / shape_.inner) : 0.0f;
  in.arm_width = follows_arms() ? static_cast<float>(shape_.arm_width) : 0.0f;
  in.shift = static_cast<float>(shape_.shift);
  in.even = arms_.is_even();
  in.arm_count = static_cast<float>(std::max(arms_.count(), 1));
  in.offsets = arms_.offsets().data();
  in.offset_count = arms_.offsets().size();
  if (follows_courses()) in.courses = profile().input(*arms_.courses());
  HWY_DYNAMIC_DISPATCH(LayerEnvelope)(batch, heights, in, out);
}

ArmProfile Layer::profile() const { return {shape_.arm_width, arms_.courses()->trunks()}; }

double Layer::mean_arm_modifier() const {
  if (!follows_arms()) return 1;
  // Between neighbouring arms at the distance g, Delta rises to g/2 and falls again.
  std::vector<double> angles;
  for (double offset : arms_.offsets()) {
    angles.push_back(offset - 2 * pi * std::floor(offset / (2 * pi)));
  }
  std::ranges::sort(angles);
  const double power = shape_.arm_width + 1;
  double sum = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double next = i + 1 < angles.size() ? angles[i + 1] : angles[0] + 2 * pi;
    sum += 1 - std::pow(1 - (next - angles[i]) / (2 * pi), power);
  }
  return sum / power;
}

double Layer::envelope_integral() const {
  const double column = 2 * shape_.z0;
  if (!shape_.is_even()) return column * uneven_integral();
  // A midpoint rule in t: with r = end t^2 the integrand's first derivatives vanish at the centre.
  constexpr int radial = 1000, vertical = 200;
  const std::vector<double> heights2 = squared_heights(shape_.z0, vertical);
  const std::vector<double> arms = follows_courses()
                                       ? profile().means(*arms_.courses(), mean_intervals)
                                       : std::vector<double>(mean_intervals + 1, 1.0);
  const auto factor = [&arms](double r) {
    const auto node = std::min(static_cast<std::size_t>(r * mean_intervals), mean_intervals - 1);
    return std::lerp(arms[node], arms[node + 1], r * mean_intervals - static_cast<double>(node));
  };
  double sum = 0;
  for (int i = 0; i < radial; ++i) {
    const double t = (i + 0.5) / radial;
    const double r = law_.end() * t * t;
    sum += 2 * law_.end() * t * r * std::exp(law_.logarithm(r)) * law_.hole(r) *
           sum_of_taper(r, heights2) / vertical * factor(r);
  }
  return 2 * pi * column * sum / radial * (follows_courses() ? 1 : mean_arm_modifier());
}

std::vector<double> Layer::tapers_around(double m) const {
  std::vector<double> tapers;
  for (int k = 0; k <= taper_angles; ++k) {
    const double psi = 2 * pi * (static_cast<double>(k) / taper_angles - 0.5);
    double r = m, azimuth = psi;
    if (!shape_.radial.is_round()) law_.place(m, psi, r, azimuth);
    tapers.push_back(mean_taper(r, shape_.z0 * shape_.flare_at(r),
                                shape_.warp.lift(r * std::cos(azimuth), r * std::sin(azimuth))));
  }
  return tapers;
}

double Layer::uneven_integral() const {
  // Midpoint rules in t and psi, m = end t^2, over the envelope in the plane.
  constexpr int radial = 500;
  const std::size_t azimuthal = follows_arms() ? 512 : is_warped() ? 64 : 32;
  // The mean taper without a warp at equal steps of r, between which it is linear.
  constexpr std::size_t steps = 1500;
  std::vector<double> tapers(steps + 2, 0.0);
  for (std::size_t k = 0; k < steps && !is_warped(); ++k) {
    const double r = static_cast<double>(k) / steps;
    tapers[k] = mean_taper(r, shape_.z0 * shape_.flare_at(r));
  }
  const auto taper_of = [&](double r) {
    const double at = std::min(r, 1.0) * steps;
    const auto k = static_cast<std::size_t>(at);
    return std::lerp(tapers[k], tapers[k + 1], at - static_cast<double>(k));
  };
  // In the mid-plane of a warp the taper depends on the azimuth too.
  std::vector<double> around;
  const auto taper_in = [&](double r, double share) {
    if (!is_warped()) return taper_of(r);
    const double at = share * taper_angles;
    const auto k = static_cast<std::size_t>(at);
    return std::lerp(around[k], around[k + 1], at - static_cast<double>(k));
  };
  const auto share_of = [azimuthal](std::size_t k) {
    return (static_cast<double>(k) + 0.5) / static_cast<double>(azimuthal);
  };
  double sum = 0;
  SampleBatch batch{};
  BatchArray flare, values;
  for (int i = 0; i < radial; ++i) {
    const double t = (i + 0.5) / radial, m = law_.end() * t * t;
    if (is_warped()) around = tapers_around(m);
    for (std::size_t first = 0; first < azimuthal; first += batch.size) {
      batch.size = std::min(batch_capacity, azimuthal - first);
      for (std::size_t k = 0; k < batch.size; ++k) {
        batch.r[k] = static_cast<float>(m);
        batch.azimuth[k] = static_cast<float>(2 * pi * (share_of(first + k) - 0.5));
        flare[k] = 1;
      }
      place(batch, flare);
      for (std::size_t k = 0; k < batch.size; ++k) {
        const double taper = taper_in(double{batch.r[k]}, share_of(first + k));
        batch.taper[k] = flare[k] * static_cast<float>(taper);
      }
      arms_.winding(batch.r.data(), batch.size, batch.winding.data());
      envelope_at(batch, batch.z.data(), values.data());
      for (std::size_t k = 0; k < batch.size; ++k) sum += t * m * double{values[k]};
    }
  }
  return 2 * pi * shape_.radial.axis_ratio * 2 * law_.end() * sum / radial /
         static_cast<double>(azimuthal);
}

/// Cells that hold equal shares of m f, of the angle psi and of sech^2.
struct Layer::Cells {
  CloudInput input;
  std::size_t count;
};

Layer::Cells Layer::cells(std::size_t radial, std::size_t azimuthal, std::size_t vertical) const {
  std::call_once(has_node_radius_, [&] { node_radius_ = law_.quantiles(cloud_nodes); });
  Cells result{{}, radial * azimuthal * vertical};
  result.input = {static_cast<float>(radial),
                  static_cast<float>(azimuthal),
                  static_cast<float>(vertical),
                  node_radius_.data(),
                  static_cast<float>(shape_.z0),
                  static_cast<float>(shape_.flare),
                  texture() != nullptr ? static_cast<float>(texture()->twirl()) : 0.0f};
  return result;
}

void Layer::place(SampleBatch& batch, BatchArray& weight) const {
  for (std::size_t i = 0; i < batch.size && !shape_.radial.is_round(); ++i) {
    double r = 0, azimuth = 0;
    law_.place(double{batch.r[i]}, double{batch.azimuth[i]}, r, azimuth);
    batch.r[i] = static_cast<float>(r);
    batch.azimuth[i] = static_cast<float>(azimuth);
  }
  for (std::size_t i = 0; i < batch.size && shape_.flare > 0; ++i) {
    weight[i] *= static_cast<float>(shape_.flare_at(double{batch.r[i]}));
  }
}

Cloud Layer::cloud(std::size_t size) const {
  // Each cell has one point, weighted with the rest of the envelope. The sides of cells are about
  // equal where the layer is bright. The mean of a noise of any frequency then converges faster
  // than over points of equal weight (tests: <Phi> = 1 to 1 %).
  const double length = law_.bright_extent();
  const double circle = law_.bright_circle();
  const double height = std::min(bright_height * shape_.z0, 1.0);
  const double side = cell_side({length, circle, height}, static_cast<double>(size));
  const auto count = [side](double extent) {
    return static_cast<std::size_t>(std::max(std::round(extent / side), 1.0));
  };
  const std::size_t vertical = count(height);
  const std::size_t azimuthal = count(circle);
  const std::size_t radial = std::min(count(length), largest_cloud_size / (azimuthal * vertical));
  const auto drawn = std::make_shared<const Cells>(cells(radial, azimuthal, vertical));
  const auto fill = [this, drawn](std::size_t b, WeightedBatch& batch) {
    SampleBatch samples{};
    BatchArray share, weight;
    const std::size_t first = b * batch_capacity;
    batch.size = samples.size = std::min(batch_capacity, drawn->count - first);
    HWY_DYNAMIC_DISPATCH(DrawCloud)(drawn->input, first, samples, share, weight);
    place(samples, weight);
    arms_.winding(samples.r.data(), samples.size, samples.winding.data());
    HWY_DYNAMIC_DISPATCH(PlaceCloud)(samples, share, drawn->input, batch, samples.taper);
    if (is_warped()) {
      lift(samples, samples.z.data());
      for (std::size_t i = 0; i < batch.size; ++i) {
        const float z = batch.z[i] + samples.z[i];
        samples.taper[i] =
            static_cast<float>(taper_at(std::hypot(double{samples.r[i]}, double{z})));
      }
    }
    envelope_at(samples, batch.z.data(), batch.weight.data());
    for (std::size_t i = 0; i < batch.size; ++i) batch.weight[i] *= weight[i];
  };
  return {(drawn->count + batch_capacity - 1) / batch_capacity, fill};
}

ColumnCloud Layer::columns(std::size_t size, std::size_t heights) const {
  ColumnCloud result;
  // Heights have equal shares of sech^2, for the scale height where the layer is bright.
  const double length = law_.bright_extent();
  const double circle = law_.bright_circle();
  const double h = shape_.z0 * shape_.flare_at(std::min(circle / (2 * pi), 1.0));
  for (std::size_t k = 0; k < heights; ++k) {
    const double share = (2 * static_cast<double>(k) + 1) / static_cast<double>(heights) - 1;
    result.heights.push_back(static_cast<float>(h * std::atanh(share)));
    result.steps.push_back(
        static_cast<float>(2 * h / static_cast<double>(heights) / (1 - share * share)));
  }
  const double side = std::sqrt(length * circle / static_cast<double>(size));
  const auto azimuthal = static_cast<std::size_t>(std::ceil(circle / side));
  const Cells drawn = cells(std::max<std::size_t>(size / azimuthal, 1), azimuthal, 1);
  result.columns.resize((drawn.count + batch_capacity - 1) / batch_capacity);
  for (std::size_t b = 0; b < result.columns.size(); ++b) {
    SampleBatch samples{};
    BatchArray share;
    const std::size_t first = b * batch_capacity;
    WeightedBatch& batch = result.columns[b];
    batch.size = samples.size = std::min(batch_capacity, drawn.count - first);
    HWY_DYNAMIC_DISPATCH(DrawCloud)(drawn.input, first, samples, share, batch.weight);
    place(samples, batch.weight);
    for (std::size_t i = 0; i < batch.size; ++i) {
      batch.x[i] = samples.r[i] * std::cos(samples.azimuth[i]);
      batch.y[i] = samples.r[i] * std::sin(samples.azimuth[i]);
      // A weight of DrawCloud() has the height's factor 1/(1 - v^2), which columns do not need.
      batch.weight[i] *= 1 - share[i] * share[i];
    }
  }
  return result;
}

}  // namespace gamer
#endif
