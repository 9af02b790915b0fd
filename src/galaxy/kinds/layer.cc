#include "gamer/galaxy/kinds/layer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/layer.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/arm_courses-inl.h"
#include "galaxy/kinds/layer_cloud-inl.h"
#include "galaxy/kinds/radial_law-inl.h"
#include "galaxy/kinds/ray_cuts.h"
#include "galaxy/kinds/taper-inl.h"
#include "galaxy/kinds/taper_column.h"
#include "gamer/core/units.h"
#include "gamer/noise/footprint.h"

#ifndef GAMER_GALAXY_LAYER_KERNEL
#define GAMER_GALAXY_LAYER_KERNEL
namespace gamer {
namespace {

struct LayerKernelInput {
  float z_factor;  ///< -2/z0, over ln 2
  RadialConstants law;
  float flare;  ///< over ln 2
  float lopsidedness, lopsided_angle;
  float inverse_inner;  ///< 1/inner, or 0 for no hole
  float arm_width;      ///< 0 for no arms
  float shift;
  bool even;  ///< arms at equal angles
  float arm_count;
  const double* offsets;  ///< of uneven arms
  std::size_t offset_count;
  ArmFactorInput courses;  ///< without a table for arms that are alike
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Delta in [0, pi]: the distance of `angle` from the nearest multiple of the period.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V DistanceToMultiple(D d, V angle, double period) {
  const float high = std::floor(static_cast<float>(period) * 0x1p10f) * 0x1p-10f;
  return hn::Abs(NearestRest(d, angle, period, high));
}

/// The envelope, with an absolute error below 4e-7 + 1.5e-7 A_w for exact coordinates and windings.
void LayerEnvelope(const SampleBatch& batch, const LayerKernelInput& in, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  constexpr double full_turn = 2 * std::numbers::pi;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto r = hn::Load(d, batch.r.data() + i);
    auto z = hn::Abs(hn::Load(d, batch.z.data() + i));
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

// Largest product of frequency and footprint of octaves that nodes follow; four fifths of this
// octave are resolved. Finer octaves are faint, and doubled nodes find them.
constexpr double seen_cycles = fade_begin + 4 * (fade_end - fade_begin) / 15;

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

// Bright range of the layer, in scale heights.
constexpr double bright_height = 3.5;

// Intervals between radii at which the mean of arms that vary is known.
constexpr std::size_t mean_intervals = 256;

// Widths from a ring's crest within which rays need its nodes, and their number per width.
constexpr double seen_widths = 6;
constexpr double nodes_per_ring_width = 1.2;

// Radius outside which the steepest winding sets the texture's frequency.
constexpr double twirl_core = 0.1;

/// The side of `count` cubes that fill a box. In a thin box it is the side of squares that fill its
/// widest face, or the length of pieces of its longest edge.
double cell_side(std::array<double, 3> extents, double count) {
  std::sort(extents.begin(), extents.end());
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
      law_(shape.rh, shape.inner, shape.radial),
      arms_(arms),
      steepest_winding_(arms.steepest_winding(twirl_core)),
      largest_shear_(arms.largest_shear()),
      log_peak_(std::log(law_.peak())) {}

ParameterTable Layer::parameters() {
  const ParameterTable own = {
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
  const ParameterTable more = {
      Parameter::number("flare", "1/galaxy radii", Interval::closed(0, 5), 0.0,
                        "growth of the scale height, z0 exp(flare r)"),
      Parameter::number("lopsidedness", "1/galaxy radii", Interval::closed(0, 1), 0.0,
                        "L: one side is brighter by 1 + L r, the other fainter by 1 - L r"),
      Parameter::number("lopsided_angle", "deg", Interval::any(), 0.0,
                        "direction of the brighter side from the x axis towards y"),
  };
  return own + RadialLaw::parameters() + more;
}

LayerShape Layer::read_shape(const ComponentInput& input, bool has_arm_width) {
  const ParameterSet& values = input.values;
  LayerShape shape;
  shape.z0 = values.number("z0");
  shape.rh = values.number("rh");
  shape.inner = values.number("inner");
  shape.arm_width = has_arm_width ? values.number("arm_width") : 0.0;
  shape.shift = std::remainder(values.number("shift"), 360.0) * degree;
  shape.radial = RadialLaw::read(values, input.context);
  shape.flare = values.number("flare");
  shape.lopsidedness = values.number("lopsidedness");
  shape.lopsided_angle = std::remainder(values.number("lopsided_angle"), 360.0) * degree;
  return shape;
}

void Layer::envelope(const SampleBatch& batch, float* out) const {
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
  HWY_DYNAMIC_DISPATCH(LayerEnvelope)(batch, in, out);
}

ArmProfile Layer::profile() const { return {shape_.arm_width, arms_.courses()->trunks()}; }

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

double Layer::uneven_integral() const {
  // Midpoint rules in t and psi, m = end t^2, over the envelope in the plane.
  constexpr int radial = 500;
  const std::size_t azimuthal = follows_arms() ? 512 : 32;
  // The mean taper at equal steps of r, between which it is linear.
  constexpr std::size_t steps = 1500;
  std::vector<double> tapers(steps + 2, 0.0);
  for (std::size_t k = 0; k < steps; ++k) {
    const double r = static_cast<double>(k) / steps;
    tapers[k] = mean_taper(r, shape_.z0 * shape_.flare_at(r));
  }
  const auto taper_of = [&](double r) {
    const double at = std::min(r, 1.0) * steps;
    const auto k = static_cast<std::size_t>(at);
    return std::lerp(tapers[k], tapers[k + 1], at - static_cast<double>(k));
  };
  double sum = 0;
  SampleBatch batch{};
  BatchArray flare, values;
  for (int i = 0; i < radial; ++i) {
    const double t = (i + 0.5) / radial, m = law_.end() * t * t;
    for (std::size_t first = 0; first < azimuthal; first += batch.size) {
      batch.size = std::min(batch_capacity, azimuthal - first);
      for (std::size_t k = 0; k < batch.size; ++k) {
        const double share =
            (static_cast<double>(first + k) + 0.5) / static_cast<double>(azimuthal);
        batch.r[k] = static_cast<float>(m);
        batch.azimuth[k] = static_cast<float>(2 * pi * (share - 0.5));
        flare[k] = 1;
      }
      place(batch, flare);
      for (std::size_t k = 0; k < batch.size; ++k) {
        batch.taper[k] = flare[k] * static_cast<float>(taper_of(double{batch.r[k]}));
      }
      arms_.winding(batch.r.data(), batch.size, batch.winding.data());
      envelope(batch, values.data());
      for (std::size_t k = 0; k < batch.size; ++k) sum += t * m * double{values[k]};
    }
  }
  return 2 * pi * shape_.radial.axis_ratio * 2 * law_.end() * sum / radial /
         static_cast<double>(azimuthal);
}

/// Cells that hold equal shares of m f, of the angle psi and of sech^2.
struct Layer::Cells {
  CloudInput input;
  std::vector<float> node_radius;
  std::size_t count;
};

Layer::Cells Layer::cells(std::size_t radial, std::size_t azimuthal, std::size_t vertical) const {
  Cells result{{}, std::vector<float>(cloud_nodes + 1, 0.0f), radial * azimuthal * vertical};
  for (int k = 1; k <= cloud_nodes; ++k) {
    const double share = static_cast<double>(k) / cloud_nodes;
    result.node_radius[static_cast<std::size_t>(k)] = static_cast<float>(law_.quantile(share));
  }
  result.input = {static_cast<float>(radial),
                  static_cast<float>(azimuthal),
                  static_cast<float>(vertical),
                  result.node_radius.data(),
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
  const auto own = std::make_shared<const Cells>(cells(radial, azimuthal, vertical));
  const auto fill = [this, own](std::size_t b, WeightedBatch& batch) {
    SampleBatch samples{};
    BatchArray share, weight;
    const std::size_t first = b * batch_capacity;
    batch.size = samples.size = std::min(batch_capacity, own->count - first);
    HWY_DYNAMIC_DISPATCH(DrawCloud)(own->input, first, samples, share, weight);
    place(samples, weight);
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
  // Heights have equal shares of sech^2, for the height where the layer is bright.
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
  const Cells own = cells(std::max<std::size_t>(size / azimuthal, 1), azimuthal, 1);
  result.columns.resize((own.count + batch_capacity - 1) / batch_capacity);
  for (std::size_t b = 0; b < result.columns.size(); ++b) {
    SampleBatch samples{};
    BatchArray share;
    const std::size_t first = b * batch_capacity;
    WeightedBatch& batch = result.columns[b];
    batch.size = samples.size = std::min(batch_capacity, own.count - first);
    HWY_DYNAMIC_DISPATCH(DrawCloud)(own.input, first, samples, share, batch.weight);
    place(samples, batch.weight);
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
  if (distance - reach > std::max(law_.limit(-seen_lengths), seen_lengths * shape_.z0)) return {};
  const double largest_flare = shape_.flare_at(std::min(law_.limit(-seen_lengths), 1.0));
  // The ray's least height above the plane, within the ball.
  const double half_chord = std::sqrt(std::max(1 - distance * distance, 0.0));
  const double height = std::max(std::abs(nearest[2]) - half_chord * std::abs(direction[2]), 0.0);
  if (height - reach > seen_heights * shape_.z0 * largest_flare) return {};
  const double cosine = std::abs(direction[2]);
  const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
  const double shortest = law_.length() * shape_.radial.axis_ratio;
  double scale =
      column_lengths * std::min(shortest, std::hypot(shortest * cosine, shape_.z0 * sine));
  if (shape_.inner > 0 && distance - reach < 2 * shape_.inner) {
    scale = std::min(
        scale, std::hypot(rim_width * shape_.inner * cosine, column_lengths * shape_.z0 * sine));
  }
  const double r = std::max(plane_radius(nearest, direction) - reach, 0.0);
  if (!shape_.radial.is_ring()) scale = std::min(scale, std::hypot(r, cusp_lengths * shortest));
  // Arms extend over many rays, whose errors average out like those of a texture.
  const double frequency = texture_frequency();
  double texture = frequency > 0 ? texture_periods / frequency : HUGE_VAL;
  if (follows_arms()) {
    const double fall = follows_courses() ? profile().width : std::numbers::pi / shape_.arm_width;
    const double length = r > 0 ? arm_lengths * fall * r / std::hypot(1.0, arms_.shear(r)) : 0.0;
    texture = std::min(texture, std::max(length, finest_arm));
  }
  return {.envelope = scale, .texture = texture};
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
  if (!cut_slab(o[2], d[2], z_limit, path.begin, path.end)) return false;
  if (path.is_upright) return path.oo < r_limit * r_limit;
  const double root2 = path.od * path.od - path.dd * (path.oo - r_limit * r_limit);
  if (root2 <= 0) return false;
  const double root = std::sqrt(root2);
  path.begin = std::max(path.begin, (-path.od - root) * path.per_dd);
  path.end = std::min(path.end, (-path.od + root) * path.per_dd);
  return path.end > path.begin;
}

double Layer::texture_rate(const BallRay& ray, double speed) const {
  double frequency = texture_frequency();
  if (texture() != nullptr && ray.footprint > 0) {
    const double seen = seen_cycles * texture()->sharpness() / footprint_scale();
    frequency = std::min(frequency, seen / ray.footprint);
  }
  return nodes_per_period * frequency * speed;
}

void Layer::plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const {
  Path path;
  if (!cut(ray, accuracy, path)) return;
  const auto& [o, d, begin, end, dd, od, oo, is_upright, per_dd] = path;
  out.extend(begin, end);
  out.has_texture = out.has_texture || texture() != nullptr;
  // The envelope is largest near the plane, shifted towards the axis along grazing rays. There the
  // derivatives of 2 ln cosh(z/z0) and of r/rh along the ray balance. A ring has places of its own.
  const bool is_ring = shape_.radial.is_ring();
  double across = std::abs(d[2]) / shape_.z0;
  const double along = std::sqrt(dd) / law_.length();
  const double axis = is_upright ? 0.5 * (begin + end) : -od * per_dd;
  double centre = axis;
  if (across > 0) {
    const double plane = -o[2] / d[2];
    if (shape_.flare > 0) {
      across /=
          shape_.flare_at(std::min(std::hypot(o[0] + plane * d[0], o[1] + plane * d[1]), 1.0));
    }
    const double shift = is_ring ? 0.0 : 0.5 * along / (across * across);
    centre = is_upright ? plane : plane + std::clamp(axis - plane, -shift, shift);
  }
  centre = std::clamp(centre, begin, end);
  const double speed = std::sqrt(dd + d[2] * d[2]);
  out.focuses.push_back(
      {centre, layer_width / (across + 0.5 * along), across + along + texture_rate(ray, speed)});
  if (is_ring) {
    if (!is_upright) add_ring(path, out);
    return;
  }
  // The cusp of exp(-r/rh) at the axis, and a hole.
  if (!is_upright && axis > begin && axis < end) {
    const double impact2 = std::max(oo + od * axis, 0.0);
    const double finest = shape_.inner > 0 ? hole_width * shape_.inner : cusp_width * shape_.rh;
    const double width = std::sqrt(std::max(impact2 + finest * finest, least_divisor) * per_dd);
    out.focuses.push_back({axis, width, nodes_per_width / width});
  }
}

void Layer::add_ring(const Path& path, RayPlan& out) const {
  const auto& [o, d, begin, end, dd, od, oo, is_upright, per_dd] = path;
  const double radius = shape_.radial.ring_radius, ring_width = law_.length(), axis = -od / dd;
  const double inside2 = radius * radius - std::max(oo + od * axis, 0.0);
  if (inside2 < 0 && std::sqrt(radius * radius - inside2) - radius > seen_widths * ring_width) {
    return;
  }
  // m changes at sqrt(inside2 dd)/r_0, and next to the axis quadratically.
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
#endif
