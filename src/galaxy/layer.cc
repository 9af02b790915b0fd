#include "gamer/galaxy/layer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/layer.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math-inl.h"
#include "gamer/core/random.h"

#ifndef GAMER_GALAXY_LAYER_KERNEL
#define GAMER_GALAXY_LAYER_KERNEL
namespace gamer {
namespace {

struct LayerKernelInput {
  float z_factor;       ///< -2/z0
  float r_factor;       ///< -1/rh
  float inverse_inner;  ///< 1/inner, or 0 for no hole
  float arm_width;      ///< 0 for no arms
  float shift;
  bool even;  ///< arms at equal angles
  float arm_count;
  const double* offsets;  ///< of uneven arms
  std::size_t offset_count;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Delta in [0, pi]: the distance of `angle` from the nearest multiple of the period.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V DistanceToMultiple(D d, V angle, float period) {
  const V turns = hn::Mul(angle, hn::Set(d, 1 / period));
  return hn::Mul(hn::Abs(hn::Sub(turns, hn::Round(turns))), hn::Set(d, period));
}

void LayerEnvelope(const SampleBatch& batch, const LayerKernelInput& in, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  constexpr float full_turn = 2 * std::numbers::pi_v<float>;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto r = hn::Load(d, batch.r.data() + i);
    const auto z = hn::Abs(hn::Load(d, batch.z.data() + i));
    // sech^2(u) = 4 e^(-2u)/(1 + e^(-2u))^2
    const auto e = Exp(d, hn::Mul(z, hn::Set(d, in.z_factor)));
    const auto sum = hn::Add(one, e);
    auto value = hn::Div(hn::Mul(hn::Set(d, 4.0f), e), hn::Mul(sum, sum));
    auto exponent = hn::Mul(r, hn::Set(d, in.r_factor));
    if (in.arm_width > 0) {
      const auto angle =
          hn::Sub(hn::Sub(hn::Load(d, batch.phi.data() + i), hn::Load(d, batch.winding.data() + i)),
                  hn::Set(d, in.shift));
      auto delta = hn::Set(d, full_turn);
      if (in.even) {
        delta = DistanceToMultiple(d, angle, full_turn / in.arm_count);
      } else {
        for (std::size_t k = 0; k < in.offset_count; ++k) {
          delta = hn::Min(
              delta,
              DistanceToMultiple(d, hn::Sub(angle, hn::Set(d, static_cast<float>(in.offsets[k]))),
                                 full_turn));
        }
      }
      const auto closeness = hn::NegMulAdd(delta, hn::Set(d, std::numbers::inv_pi_v<float>), one);
      exponent = hn::MulAdd(hn::Set(d, in.arm_width), Log(d, closeness), exponent);
    }
    value = hn::Mul(value, Exp(d, exponent));
    if (in.inverse_inner > 0) {
      auto q = hn::Mul(r, hn::Set(d, in.inverse_inner));
      q = hn::Mul(q, q);
      value = hn::Mul(value, hn::Sub(one, Exp(d, hn::Neg(hn::Mul(q, q)))));
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

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

// Points of the statistics of a texture.
constexpr std::size_t cloud_size = std::size_t{1} << 15;

// First steps of a ray: in scale heights, in scale lengths, and in periods of the noise's effective
// frequency. The adaptive sampler refines from there; coarser ones could step over structure.
constexpr double step_heights = 2.5;
constexpr double step_lengths = 1.0;
constexpr double step_periods = 1.0;

// Envelopes are followed down to this share of the threshold.
constexpr double tail = 1e-3;

// The shear of the twirl is bounded by the steepest winding outside this radius.
constexpr double twirl_core = 0.1;

double sech2(double u) {
  const double e = std::exp(-2 * std::abs(u));
  return 4 * e / ((1 + e) * (1 + e));
}

double smooth_taper(double radius) {
  const double u = std::clamp((1 - radius) / (1 - taper_start), 0.0, 1.0);
  return u * u * u * (u * (6 * u - 15) + 10);
}

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

/// The part of [begin, end] where |o + t d| < limit.
bool cut_slab(double o, double d, double limit, double& begin, double& end) {
  if (d == 0) return std::abs(o) < limit;
  const double t1 = (-limit - o) / d;
  const double t2 = (limit - o) / d;
  begin = std::max(begin, std::min(t1, t2));
  end = std::min(end, std::max(t1, t2));
  return begin < end;
}

}  // namespace

Layer::Layer(const LayerShape& shape, const ArmPattern& arms)
    : shape_(shape), arms_(arms), steepest_winding_(arms.steepest_winding(twirl_core)) {}

ParameterTable Layer::parameters() {
  return {
      {"z0", ParameterType::number, "galaxy radii", Interval::left_open(0, 1), 0.02,
       "scale height of sech^2(z/z0)"},
      {"rh", ParameterType::number, "galaxy radii", Interval::left_open(0, 1), 0.2,
       "scale length of exp(-r/rh)"},
      {"inner", ParameterType::number, "galaxy radii", Interval::right_open(0, 1), 0.0,
       "radius of a smooth central hole"},
      {"arm_width", ParameterType::number, "", Interval::closed(0, 100), 0.5,
       "A_w: larger makes narrower arms; 0 ignores them"},
      {"shift", ParameterType::number, "deg", Interval::any(), 0.0,
       "delta: turns the arms of this component"},
      {"twirl", ParameterType::number, "", Interval::closed(-10, 10), 0.1,
       "tau: the noise is wound by tau theta(r); at 1 its features run along the arms"},
  };
}

LayerShape Layer::read_shape(const ParameterSet& values) {
  LayerShape shape;
  shape.z0 = values.number("z0");
  shape.rh = values.number("rh");
  shape.inner = values.number("inner");
  shape.arm_width = values.number("arm_width");
  shape.shift = values.number("shift") * degree;
  return shape;
}

void Layer::envelope(const SampleBatch& batch, float* out) const {
  LayerKernelInput in{};
  in.z_factor = static_cast<float>(-2 / shape_.z0);
  in.r_factor = static_cast<float>(-1 / shape_.rh);
  in.inverse_inner = shape_.inner > 0 ? static_cast<float>(1 / shape_.inner) : 0.0f;
  in.arm_width = follows_arms() ? static_cast<float>(shape_.arm_width) : 0.0f;
  in.shift = static_cast<float>(shape_.shift);
  in.even = arms_.is_even();
  in.arm_count = static_cast<float>(std::max(arms_.count(), 1));
  in.offsets = arms_.offsets().data();
  in.offset_count = arms_.offsets().size();
  HWY_DYNAMIC_DISPATCH(LayerEnvelope)(batch, in, out);
}

double Layer::mean_arm_modifier() const {
  if (!follows_arms()) return 1;
  const double width = shape_.arm_width;
  if (arms_.is_even()) {
    const double n = arms_.count();
    return n / (width + 1) * (1 - std::pow(1 - 1 / n, width + 1));
  }
  constexpr int steps = 7200;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double angle = 2 * pi * (i + 0.5) / steps;
    double delta = 2 * pi;
    for (double offset : arms_.offsets()) {
      delta = std::min(delta, std::abs(std::remainder(angle - offset, 2 * pi)));
    }
    sum += std::pow(1 - delta / pi, width);
  }
  return sum / steps;
}

double Layer::envelope_integral() const {
  // z = z0 atanh(v) turns sech^2 into a constant; midpoint rules.
  constexpr int radial = 1000;
  constexpr int vertical = 100;
  double sum = 0;
  for (int i = 0; i < radial; ++i) {
    const double r = (i + 0.5) / radial;
    double column = 0;
    for (int j = 0; j < vertical; ++j) {
      const double z = shape_.z0 * std::atanh((j + 0.5) / vertical);
      column += smooth_taper(std::hypot(r, z));
    }
    const double hole = shape_.inner > 0 ? -std::expm1(-std::pow(r / shape_.inner, 4)) : 1.0;
    sum += r * std::exp(-r / shape_.rh) * hole * column / vertical;
  }
  return 2 * pi * 2 * shape_.z0 * sum / radial * mean_arm_modifier();
}

std::vector<WeightedBatch> Layer::cloud() const {
  // Points follow r exp(-r/rh) sech^2(z/z0); the rest of the envelope is their weight.
  std::vector<WeightedBatch> result(cloud_size / batch_capacity);
  const double end = 1 / shape_.rh;
  const double inside = 1 - (1 + end) * std::exp(-end);
  const R3Sequence sequence;
  std::uint64_t index = 0;
  for (WeightedBatch& batch : result) {
    SampleBatch samples;
    samples.size = batch.size = batch_capacity;
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      double u[3];
      sequence.point(index++, u);
      const double r = std::min(shape_.rh * gamma2_quantile(u[0] * inside), 1.0);
      const double angle = 2 * pi * (u[1] - 0.5);
      const double z = shape_.z0 * std::atanh(std::clamp(2 * u[2] - 1, -1 + 1e-12, 1 - 1e-12));
      batch.x[i] = samples.x[i] = static_cast<float>(r * std::cos(angle));
      batch.y[i] = samples.y[i] = static_cast<float>(r * std::sin(angle));
      batch.z[i] = samples.z[i] = static_cast<float>(z);
      samples.r[i] = static_cast<float>(r);
      samples.phi[i] = static_cast<float>(angle);
      samples.taper[i] = static_cast<float>(smooth_taper(std::hypot(r, z)));
    }
    arms_.winding(samples.r.data(), samples.size, samples.winding.data());
    envelope(samples, batch.weight.data());
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double followed =
          std::exp(-double{samples.r[i]} / shape_.rh) * sech2(double{batch.z[i]} / shape_.z0);
      batch.weight[i] = followed > 0 ? static_cast<float>(batch.weight[i] / followed) : 0.0f;
    }
    // The texture sees points turned back by the twirl.
    const double twirl = texture() != nullptr ? texture()->twirl : 0.0;
    if (twirl != 0) {
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        const double turn = -twirl * double{samples.winding[i]};
        const double c = std::cos(turn), s = std::sin(turn);
        const double x = batch.x[i], y = batch.y[i];
        batch.x[i] = static_cast<float>(c * x - s * y);
        batch.y[i] = static_cast<float>(s * x + c * y);
      }
    }
  }
  return result;
}

void Layer::mark(const BallRay& ray, const Accuracy& accuracy, Marks& marks) const {
  const auto& o = ray.origin;
  const auto& d = ray.direction;
  const double dd = d[0] * d[0] + d[1] * d[1];
  const double od = o[0] * d[0] + o[1] * d[1];
  const double oo = o[0] * o[0] + o[1] * o[1];
  double begin = 0, end = 0;
  // Where sech^2(z/z0) exp(-r/rh) can exceed `least`; false for nowhere.
  const auto span = [&](double least) {
    begin = ray.begin;
    end = ray.end;
    if (!cut_slab(o[2], d[2], shape_.z0 * std::acosh(1 / std::sqrt(least)), begin, end)) {
      return false;
    }
    const double r_limit = -shape_.rh * std::log(least);
    if (dd == 0) return oo < r_limit * r_limit;
    const double root2 = od * od - dd * (oo - r_limit * r_limit);
    if (root2 <= 0) return false;
    begin = std::max(begin, (-od - std::sqrt(root2)) / dd);
    end = std::min(end, (-od + std::sqrt(root2)) / dd);
    return begin < end;
  };
  double threshold = accuracy.texture_threshold;
  if (texture() != nullptr) threshold /= texture()->noise.rms();
  // A panel from the threshold to the ball's surface would not resolve the exponential.
  if (!span(threshold * tail)) return;
  marks.edges.push_back(begin);
  marks.edges.push_back(end);
  if (dd > 0) {
    const double axis = -od / dd;
    if (axis > begin && axis < end) marks.edges.push_back(axis);
  }
  if (d[2] != 0) {
    const double plane = -o[2] / d[2];
    if (plane > begin && plane < end) marks.edges.push_back(plane);
  }
  if (!span(threshold)) return;
  marks.edges.push_back(begin);
  marks.edges.push_back(end);
  // 1/step adds up: each structure along its own direction.
  double rate =
      std::abs(d[2]) / (step_heights * shape_.z0) + std::sqrt(dd) / (step_lengths * shape_.rh);
  if (texture() != nullptr) {
    double frequency = texture()->noise.effective_frequency() * texture()->noise.sharpness();
    if (texture()->twirl != 0) {
      frequency *= std::hypot(1.0, texture()->twirl * steepest_winding_);
    }
    rate += frequency * std::sqrt(dd + d[2] * d[2]) / step_periods;
  }
  marks.stretches.push_back({begin, end, accuracy.first_step / rate});
}

}  // namespace gamer
#endif
