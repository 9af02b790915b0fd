#include "gamer/galaxy/arm_pattern.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/arm_pattern.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/arm_courses.h"
#include "gamer/core/batch.h"
#include "gamer/core/units.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void RingermacherMead(const float* HWY_RESTRICT r, std::size_t size, float a, float b, float n,
                      float sign, float* HWY_RESTRICT theta) {
  const hn::ScalableTag<float> d;
  const auto start = hn::Set(d, sign * n * std::numbers::pi_v<float>);
  const auto factor = hn::Set(d, -2.0f * sign * n);
  const auto smallest = hn::Set(d, 1e-30f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto radius = hn::Max(hn::Load(d, r + i), smallest);
    const auto e = Exp(d, hn::Div(hn::Set(d, -a), radius));
    const auto angle = Atan2(d, hn::Mul(e, hn::Set(d, b)), hn::Set(d, 1.0f));
    hn::Store(hn::MulAdd(angle, factor, start), d, theta + i);
  }
}

void Logarithmic(const float* HWY_RESTRICT r, std::size_t size, float inverse_scale,
                 float core_square, float factor, float* HWY_RESTRICT theta) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto u = hn::Mul(hn::Load(d, r + i), hn::Set(d, inverse_scale));
    const auto square = hn::MulAdd(u, u, hn::Set(d, core_square));
    hn::Store(hn::Mul(Log(d, square), hn::Set(d, factor)), d, theta + i);
  }
}

/// y = B exp(-A/r): r dtheta/dr = -2N (A/r) y/(1 + y^2).
void RingermacherMeadShear(const float* HWY_RESTRICT r, std::size_t size, float a, float b,
                           float factor, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto radius = hn::Max(hn::Load(d, r + i), hn::Set(d, 1e-30f));
    // The bound 80 excludes infinities; beyond it the exponential is 0.
    const auto ratio = hn::Min(hn::Div(hn::Set(d, a), radius), hn::Set(d, 80.0f));
    const auto y = hn::Mul(Exp(d, hn::Neg(ratio)), hn::Set(d, b));
    const auto slope = hn::Div(y, hn::MulAdd(y, y, hn::Set(d, 1.0f)));
    hn::Store(hn::Mul(hn::Mul(ratio, slope), hn::Set(d, factor)), d, out + i);
  }
}

void LogarithmicShear(const float* HWY_RESTRICT r, std::size_t size, float inverse_scale,
                      float core_square, float factor, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto u = hn::Mul(hn::Load(d, r + i), hn::Set(d, inverse_scale));
    const auto square = hn::Mul(u, u);
    const auto share = hn::Div(square, hn::Add(square, hn::Set(d, core_square)));
    hn::Store(hn::Mul(share, hn::Set(d, factor)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(RingermacherMead);
HWY_EXPORT(Logarithmic);
HWY_EXPORT(RingermacherMeadShear);
HWY_EXPORT(LogarithmicShear);

namespace {

constexpr double default_logarithmic_scale = 0.1;
constexpr double default_ringermacher_mead_scale = 1.0;

constexpr std::size_t most_arms = 64;

// Largest winding. The kernels' angles are accurate up to ten times this value, since the largest
// twirl is 10.
constexpr double largest_winding = 800;

// Radius of the logarithmic spiral's core, in units of its scale; the winding stops inside it.
constexpr double logarithmic_core = 0.01;

/// Refuses keys that the winding law of these values does not use.
void check_law(const ParameterSet& values, const ConfigNode* list) {
  const std::string& model = values.text("model");
  const auto reject = [&](const char* key, const std::string& need) {
    if (values.is_given(key)) {
      throw InputError(values.where(key), std::string("'") + key + "' " + need);
    }
  };
  if (model != "ringermacher-mead") {
    reject("winding_b", "needs model = \"ringermacher-mead\"");
    reject("winding_n", "needs model = \"ringermacher-mead\"");
  }
  if (model != "logarithmic") reject("pitch_angle", "needs model = \"logarithmic\"");
  if (model == "none") {
    const std::string need = "needs model = \"ringermacher-mead\" or \"logarithmic\"";
    for (const char* key : {"scale", "count", "offsets", "handedness"}) reject(key, need);
    for (const Parameter& one : ArmCourses::common_table()) reject(one.name.c_str(), need);
    if (list != nullptr) throw InputError(list->key_where, "[[arm]] " + need);
  } else if (values.integer("handedness") == 0) {
    throw InputError(values.where("handedness"), "handedness must be 1 or -1");
  }
  if (list != nullptr) {
    reject("count", "and [[arm]] exclude each other: each [[arm]] is one arm");
    reject("offsets", "and [[arm]] exclude each other: each [[arm]] has an 'offset'");
  }
}

/// The angles of the arms from `offsets`, radians.
std::vector<double> given_offsets(const ParameterSet& values) {
  const std::vector<double>& given = values.numbers("offsets");
  const std::string lists = "'offsets' lists " + std::to_string(given.size()) + " arms";
  if (values.is_given("count") &&
      values.integer("count") != static_cast<std::int64_t>(given.size())) {
    throw InputError(values.where("offsets"),
                     lists + ", but count = " + std::to_string(values.integer("count")));
  }
  if (given.size() > most_arms) {
    throw InputError(values.where("offsets"),
                     lists + "; at most " + std::to_string(most_arms) + " are possible");
  }
  std::vector<double> result;
  for (double offset : given) result.push_back(std::remainder(offset, 360.0) * degree);
  return result;
}

/// Refuses arms that wind around more often than the kernels can resolve.
void check_sweep(const ArmPattern& arms, const ParameterSet& values) {
  const double sweep = std::max(std::abs(arms.winding(0)), std::abs(arms.winding(1)));
  if (sweep <= largest_winding) return;
  const char* key = values.is_given("pitch_angle") ? "pitch_angle" : "scale";
  throw InputError(values.where(key),
                   std::string(key) + " winds the arms too often around to be resolved; at most " +
                       std::to_string(std::lround(largest_winding / full_turn)) +
                       " turns are possible");
}

}  // namespace

ParameterTable ArmPattern::arm_table() { return ArmCourses::arm_table(); }

ParameterTable ArmPattern::table() {
  const ParameterTable law = {
      Parameter::choice("model", {"ringermacher-mead", "logarithmic", "none"}, "none",
                        "winding law of the arms"),
      Parameter::number(
          "winding_b", "", Interval::left_open(0, 100).usual_logarithmic(0.1, 5), 0.5,
          "W_B of ringermacher-mead: a larger value sweeps the arms farther and shortens the bar"),
      Parameter::number("winding_n", "", Interval::left_open(0, 100).usual(0.5, 16), 4.0,
                        "W_N of ringermacher-mead: a larger value winds the arms tighter"),
      Parameter::number("pitch_angle", "deg", Interval::open(0, 90).usual(4, 60), 15.0,
                        "pitch angle p of logarithmic"),
      Parameter::number("scale", "galaxy radii",
                        Interval::left_open(0, 10).usual_logarithmic(0.03, 3), std::nullopt,
                        "A: radius at which the pattern turns; default 1 for ringermacher-mead, "
                        "0.1 for logarithmic"),
      Parameter::integer("count", "", Interval::closed(0, most_arms).usual(0, 8), 2,
                         "number of arms, evenly spread"),
      Parameter::numbers("offsets", "deg", Interval::any(), std::nullopt,
                         "angles of the arms; by default they are evenly spread"),
      Parameter::integer("handedness", "", Interval::closed(-1, 1), 1, "1 or -1: sense of winding"),
  };
  return law + ArmCourses::common_table();
}

ArmPattern ArmPattern::read(const ConfigNode& node, const ConfigNode* list) {
  const ParameterSet values = ParameterSet::read(table(), node, "", "in [arms]");
  check_law(values, list);
  ArmPattern arms;
  const std::string& model = values.text("model");
  if (model == "none") return arms;
  arms.model_ = model == "logarithmic" ? Model::logarithmic : Model::ringermacher_mead;
  arms.winding_b_ = values.number("winding_b");
  arms.winding_n_ = values.number("winding_n");
  arms.pitch_ = values.number("pitch_angle") * degree;
  arms.scale_ = values.has("scale")
                    ? values.number("scale")
                    : (arms.model_ == Model::logarithmic ? default_logarithmic_scale
                                                         : default_ringermacher_mead_scale);
  arms.handedness_ = static_cast<double>(values.integer("handedness"));
  if (values.has("offsets")) {
    arms.even_ = false;
    arms.offsets_ = given_offsets(values);
  } else {
    const auto count = list != nullptr ? ArmCourses::trunks(*list) : values.integer("count");
    for (std::int64_t i = 0; i < count; ++i) {
      arms.offsets_.push_back(full_turn * static_cast<double>(i) / static_cast<double>(count));
    }
  }
  check_sweep(arms, values);
  if (list != nullptr || (arms.has_arms() && ArmCourses::are_asked_for(values, list))) {
    arms.courses_ = std::make_shared<const ArmCourses>(arms, values, list);
  }
  return arms;
}

double ArmPattern::winding(double r) const {
  switch (model_) {
    case Model::none: return 0;
    case Model::ringermacher_mead: {
      const double e = r > 0 ? std::exp(-scale_ / r) : 0.0;
      return handedness_ * winding_n_ * (std::numbers::pi - 2 * std::atan(winding_b_ * e));
    }
    case Model::logarithmic:
      return handedness_ * std::log(std::hypot(r / scale_, logarithmic_core)) / std::tan(pitch_);
  }
  return 0;
}

void ArmPattern::winding(const float* r, std::size_t size, float* theta) const {
  switch (model_) {
    case Model::none: std::fill(theta, theta + padded(size), 0.0f); return;
    case Model::ringermacher_mead:
      HWY_DYNAMIC_DISPATCH(RingermacherMead)
      (r, size, static_cast<float>(scale_), static_cast<float>(winding_b_),
       static_cast<float>(winding_n_), static_cast<float>(handedness_), theta);
      return;
    case Model::logarithmic:
      HWY_DYNAMIC_DISPATCH(Logarithmic)
      (r, size, static_cast<float>(1 / scale_),
       static_cast<float>(logarithmic_core * logarithmic_core),
       static_cast<float>(0.5 * handedness_ / std::tan(pitch_)), theta);
      return;
  }
}

void ArmPattern::shear(const float* r, std::size_t size, float* out) const {
  switch (model_) {
    case Model::none: std::fill(out, out + padded(size), 0.0f); return;
    case Model::ringermacher_mead:
      HWY_DYNAMIC_DISPATCH(RingermacherMeadShear)
      (r, size, static_cast<float>(scale_), static_cast<float>(winding_b_),
       static_cast<float>(-2 * handedness_ * winding_n_), out);
      return;
    case Model::logarithmic:
      HWY_DYNAMIC_DISPATCH(LogarithmicShear)
      (r, size, static_cast<float>(1 / scale_),
       static_cast<float>(logarithmic_core * logarithmic_core),
       static_cast<float>(handedness_ / std::tan(pitch_)), out);
      return;
  }
}

double ArmPattern::shear(double r) const {
  constexpr double step = 1e-4;
  return (winding(r * (1 + step)) - winding(r * (1 - step))) / (2 * step);
}

double ArmPattern::steepest_winding(double r_min) const {
  constexpr int samples = 200;
  double steepest = 0;
  for (int i = 0; i < samples; ++i) {
    steepest = std::max(steepest, std::abs(shear(r_min + (1 - r_min) * i / (samples - 1))));
  }
  return steepest;
}

double ArmPattern::largest_shear() const {
  // Margin for the error of shear() in single precision.
  constexpr double margin = 1 + 5e-5;
  switch (model_) {
    case Model::none: return 0;
    case Model::logarithmic: return margin / std::tan(pitch_);
    case Model::ringermacher_mead: break;
  }
  // 2N t y/(1 + y^2), t = A/r, y = B e^-t, is largest where 1/t = tanh(t - ln B), or at r = 1.
  const double shift = std::log(winding_b_);
  double low = 0, high = 2 + std::max(shift, 0.0);
  constexpr int halvings = 60;
  for (int i = 0; i < halvings; ++i) {
    const double t = 0.5 * (low + high);
    (t * std::tanh(t - shift) < 1 ? low : high) = t;
  }
  const double t = std::max(high, scale_);
  return margin * winding_n_ * t / std::cosh(t - shift);
}

}  // namespace gamer
#endif
