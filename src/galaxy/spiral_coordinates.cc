#include "galaxy/spiral_coordinates.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/spiral_coordinates.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/math-inl.h"
#include "galaxy/arm_courses.h"
#include "gamer/core/units.h"

#ifndef GAMER_GALAXY_SPIRAL_COORDINATES_KERNEL
#define GAMER_GALAXY_SPIRAL_COORDINATES_KERNEL
namespace gamer {
namespace {

// Number of steps of the table for a varying pitch, in s = ln r.
constexpr int table_steps = 512;
constexpr double table_radius = 1e-3;
const double table_start = std::log(table_radius);
const double table_step = -table_start / table_steps;

struct SpiralKernelInput {
  float cosine, sine;  ///< of the turn to the first arm
  float orientation;
  float core_square, u_start;  ///< of a constant pitch: u = u_slope ln(r^2 + core^2)/2 + u_start
  float u_slope, v_slope;      ///< of a constant pitch
  float u_factor, v_factor;    ///< n/2pi, n'/2pi
  const float* table;          ///< null for a constant pitch
  float start, inverse_step;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// The angle of a direction from `along` towards `across`, in turns. It is found by octants, so
/// that it is exactly +-1/2 at the cut.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Turns(D d, V along, V across) {
  const V a = hn::Abs(along);
  const V b = hn::Abs(across);
  V turns = hn::Mul(AtanOfRatio(d, hn::Min(a, b), hn::Max(a, b)),
                    hn::Set(d, 0.5f * std::numbers::inv_pi_v<float>));
  turns = hn::IfThenElse(hn::Gt(b, a), hn::Sub(hn::Set(d, 0.25f), turns), turns);
  turns = hn::IfThenElse(hn::Lt(along, hn::Zero(d)), hn::Sub(hn::Set(d, 0.5f), turns), turns);
  return hn::CopySign(turns, across);
}

/// Cubics in s through the values and slopes of two neighbouring nodes of the table.
template <class D, class V = hn::Vec<D>>
class TableCubic {
 public:
  HWY_INLINE TableCubic(D d, V s, const SpiralKernelInput& in)
      : table_(in.table), inverse_step_(hn::Set(d, in.inverse_step)) {
    V position = hn::Mul(hn::Sub(s, hn::Set(d, in.start)), inverse_step_);
    position = hn::Min(hn::Max(position, hn::Zero(d)), hn::Set(d, static_cast<float>(table_steps)));
    const V node = hn::Min(hn::Floor(position), hn::Set(d, table_steps - 1.0f));
    t_ = hn::Sub(position, node);
    rest_ = hn::Sub(hn::Set(d, 1.0f), t_);
    bend_ = hn::Mul(t_, rest_);
    at_ = hn::ShiftLeft<2>(hn::ConvertTo(hn::RebindToSigned<D>(), node));
  }

  /// Quantity k of the table (0 u, 2 v) and its slope.
  HWY_INLINE V Value(D d, int k, V& slope) const {
    const V value = Get(d, k);
    const V rise = hn::Sub(Get(d, k + 4), value);
    const V first = Get(d, k + 1);
    const V second = Get(d, k + 5);
    slope = hn::Mul(hn::MulAdd(t_, hn::Sub(second, first), first), inverse_step_);
    const V curve =
        hn::Sub(hn::Mul(hn::Sub(first, rise), rest_), hn::Mul(hn::Sub(second, rise), t_));
    return hn::Add(hn::MulAdd(t_, rise, value), hn::Mul(bend_, curve));
  }

 private:
  HWY_INLINE V Get(D d, int k) const { return hn::GatherIndex(d, table_ + k, at_); }

  const float* table_;
  V inverse_step_, t_, rest_, bend_;
  hn::Vec<hn::RebindToSigned<D>> at_;
};

void SpiralKernel(const Points& points, const SpiralKernelInput& in, SpiralBatch& out) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  // r |grad v| from its two parts.
  const auto length = [&](auto slope) HWY_ATTR {
    return hn::Sqrt(hn::MulAdd(slope, slope, hn::Set(d, in.v_factor * in.v_factor)));
  };
  const auto constant_length = length(hn::Set(d, in.v_slope));
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, points.x + i);
    const auto y = hn::Load(d, points.y + i);
    const auto along = hn::MulAdd(x, hn::Set(d, in.cosine), hn::Mul(y, hn::Set(d, in.sine)));
    const auto across = hn::MulSub(y, hn::Set(d, in.cosine), hn::Mul(x, hn::Set(d, in.sine)));
    hn::Store(Turns(d, along, hn::Mul(across, hn::Set(d, in.orientation))), d,
              out.turns.data() + i);
    // The smallest square is far below the structure of any galaxy, and a normal number.
    const auto square = hn::Max(hn::MulAdd(x, x, hn::Mul(y, y)), hn::Set(d, 1e-12f));
    const auto s = hn::Mul(Log(d, square), hn::Set(d, 0.5f));
    const auto inverse = hn::Div(one, hn::Sqrt(square));
    hn::Store(s, d, out.s.data() + i);
    hn::Store(inverse, d, out.inverse_radius.data() + i);
    auto v = hn::Mul(s, hn::Set(d, in.v_slope));
    auto u_slope = hn::Set(d, in.u_slope);
    auto v_length = constant_length;
    auto u = hn::Set(d, in.u_start);
    if (in.table == nullptr) {
      const auto sum = hn::Add(square, hn::Set(d, in.core_square));
      u = hn::MulAdd(hn::Mul(Log(d, sum), hn::Set(d, 0.5f)), u_slope, u);
      u_slope = hn::Mul(u_slope, hn::Div(square, sum));
    } else {
      const TableCubic cubic(d, s, in);
      u = cubic.Value(d, 0, u_slope);
      auto v_slope = one;
      v = cubic.Value(d, 2, v_slope);
      v_length = length(v_slope);
    }
    hn::Store(u, d, out.u_radial.data() + i);
    hn::Store(v, d, out.v_radial.data() + i);
    const auto u_length =
        hn::Sqrt(hn::MulAdd(u_slope, u_slope, hn::Set(d, in.u_factor * in.u_factor)));
    hn::Store(hn::Mul(u_length, inverse), d, out.u_gradient.data() + i);
    hn::Store(hn::Div(v_length, u_length), d, out.ratio.data() + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SpiralKernel);

namespace {

// The largest tan p in h, which would grow without limit in a bar.
const double steepest_tangent = std::tan(80 * full_turn / 360);

// The reference pitch is the median over radii from this one to 1.
constexpr double reference_radius = 0.15;
constexpr int reference_samples = 33;

// Largest deviation of offsets from equal angles for evenly spread arms, radians.
constexpr double offset_tolerance = 1e-6;

/// r dtheta/dr of the arms: cot p with the sign of the winding.
double slope_of(const ArmPattern& arms, double r) {
  constexpr double h = 1e-5;
  return (arms.winding(r * (1 + h)) - arms.winding(r * (1 - h))) / (2 * h);
}

}  // namespace

bool SpiralCoordinates::fits(const ArmPattern& arms) {
  if (!arms.has_arms()) return false;
  const double spacing = full_turn / arms.count();
  std::vector<double> angles;
  for (const double offset : arms.offsets()) {
    const double away = offset - arms.offsets().front();
    angles.push_back(away - full_turn * std::floor((away + offset_tolerance) / full_turn));
  }
  std::ranges::sort(angles);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    if (std::abs(angles[i] - spacing * static_cast<double>(i)) > offset_tolerance) return false;
  }
  return true;
}

SpiralCoordinates::SpiralCoordinates(const ArmPattern& arms, double shift) {
  if (!fits(arms)) throw std::invalid_argument("spiral coordinates need evenly spread arms");
  count_ = arms.count();
  shift_ = shift;
  if (arms.courses() != nullptr) courses_ = arms;
  orientation_ = arms.winding(1) >= arms.winding(0.5) ? 1 : -1;
  std::array<double, reference_samples> tangents{};
  for (int k = 0; k < reference_samples; ++k) {
    const double r = reference_radius + (1 - reference_radius) * k / (reference_samples - 1);
    tangents[static_cast<std::size_t>(k)] =
        std::min(1 / std::abs(slope_of(arms, r)), steepest_tangent);
  }
  std::ranges::sort(tangents);
  tangent_ = tangents[reference_samples / 2];
  cycle_ = count_ / tangent_;
  const double first = arms.offsets().front() + shift;
  shift_cosine_ = std::cos(first);
  shift_sine_ = std::sin(first);
  const auto slopes = [&](double s) {
    const double cotangent = orientation_ * slope_of(arms, std::exp(s));
    return std::pair{cotangent, std::min(1 / std::max(cotangent, 1e-9), steepest_tangent)};
  };
  if (arms.model() == ArmPattern::Model::logarithmic) {
    // g = ln(r^2 + core^2)/(2 tan p) + start; values at its ends give the constants.
    constexpr double far = 1e6;
    const double low = orientation_ * arms.winding(0);
    const double high = orientation_ * arms.winding(far);
    tangent_ = std::log(10) / (orientation_ * arms.winding(10 * far) - high);
    cycle_ = count_ / tangent_;
    core_ = far * std::exp(tangent_ * (low - high));
    start_ = high - std::log(far) / tangent_;
    return;
  }
  // h by Simpson's rule, backwards from r = 1.
  nodes_.resize(4 * (table_steps + 1));
  double h = 0;
  for (int k = table_steps; k >= 0; --k) {
    const double s = table_start + k * table_step;
    const auto [g_slope, h_slope] = slopes(s);
    if (k < table_steps) {
      h -= table_step / 6 *
           (h_slope + 4 * slopes(s + 0.5 * table_step).second + slopes(s + table_step).second);
    }
    double* node = nodes_.data() + 4 * k;
    node[0] = count_ / full_turn * orientation_ * arms.winding(std::exp(s));
    node[1] = count_ / full_turn * g_slope * table_step;
    node[2] = -cycle_ / full_turn * h;
    node[3] = -cycle_ / full_turn * h_slope * table_step;
  }
  table_.assign(nodes_.begin(), nodes_.end());
}

SpiralCoordinates SpiralCoordinates::logarithmic(int count, double beta) {
  SpiralCoordinates result;
  result.count_ = count;
  result.tangent_ = std::log(beta);
  result.cycle_ = count / result.tangent_;
  return result;
}

SpiralCoordinates::Law SpiralCoordinates::law(double s) const {
  if (nodes_.empty()) {
    const double square = std::exp(2 * s);
    const double sum = square + core_ * core_;
    return {start_ + 0.5 * std::log(sum) / tangent_, square / sum / tangent_, s * tangent_};
  }
  const double position = std::clamp((s - table_start) / table_step, 0.0, double{table_steps});
  const int k = std::min(static_cast<int>(position), table_steps - 1);
  const double t = position - k;
  const double* node = nodes_.data() + 4 * k;
  const auto cubic = [&](int c) {
    const double rise = node[c + 4] - node[c];
    return node[c] + t * rise +
           t * (1 - t) * ((node[c + 1] - rise) * (1 - t) - (node[c + 5] - rise) * t);
  };
  const double slope = (node[1] + t * (node[5] - node[1])) / table_step;
  return {full_turn / count_ * cubic(0), full_turn / count_ * slope,
          -full_turn / cycle_ * cubic(2)};
}

SpiralCoordinates::Position SpiralCoordinates::at(double r, double theta) const {
  const Law known = law(std::log(r));
  return {count_ / full_turn * (known.g - theta), -cycle_ / full_turn * (known.h + theta)};
}

double SpiralCoordinates::u_gradient(double r) const {
  return count_ / full_turn * std::hypot(1.0, law(std::log(r)).g_slope) / r;
}

void SpiralCoordinates::at(const Points& points, SpiralBatch& out) const {
  SpiralKernelInput in{};
  in.cosine = static_cast<float>(shift_cosine_);
  in.sine = static_cast<float>(shift_sine_);
  in.orientation = static_cast<float>(orientation_);
  in.u_factor = static_cast<float>(count_ / full_turn);
  in.v_factor = static_cast<float>(cycle_ / full_turn);
  in.u_slope = static_cast<float>(count_ / full_turn / tangent_);
  in.v_slope = static_cast<float>(-cycle_ / full_turn * tangent_);
  in.core_square = static_cast<float>(core_ * core_);
  in.u_start = static_cast<float>(count_ / full_turn * start_);
  in.table = table_.empty() ? nullptr : table_.data();
  in.start = static_cast<float>(table_start);
  in.inverse_step = static_cast<float>(1 / table_step);
  if (courses_.courses() == nullptr) {
    HWY_DYNAMIC_DISPATCH(SpiralKernel)(points, in, out);
    return;
  }
  BatchArray x, y;
  courses_.courses()->straighten(points, courses_, shift_, x.data(), y.data());
  HWY_DYNAMIC_DISPATCH(SpiralKernel)({x.data(), y.data(), points.z, points.size}, in, out);
}

HelicalMap HelicalMap::along(const SpiralCoordinates& coordinates, double frequency, double stretch,
                             double angle) {
  const double n = coordinates.count();
  const double cycle = coordinates.cycle();
  const double tangent = coordinates.reference_tangent();
  const double wanted[2][2] = {
      {frequency * std::cos(angle), frequency * std::sin(angle)},
      {frequency / stretch * std::sin(angle), -frequency / stretch * std::cos(angle)}};
  double slope[2];
  int image[2];
  for (int row = 0; row < 2; ++row) {
    const double turned = wanted[row][0] * n + wanted[row][1] * cycle;
    const double whole = std::round(turned);
    const double share = (whole - turned) / (n * n + cycle * cycle);
    const double m_u = wanted[row][0] + share * n;
    const double m_v = wanted[row][1] + share * cycle;
    // The sign of a lattice's axis has no effect.
    const double sign = whole < 0 ? -1 : 1;
    image[row] = static_cast<int>(sign * whole);
    slope[row] = sign * (m_u * n / tangent - m_v * cycle * tangent) / full_turn;
  }
  return {slope[0], slope[1], image[0], image[1]};
}

HelicalMap HelicalMap::isotropic(const SpiralCoordinates& coordinates, double frequency) {
  const double around =
      frequency * coordinates.count() * std::hypot(1.0, 1 / coordinates.reference_tangent());
  const int p = static_cast<int>(std::max(std::round(around), 1.0));
  return {.x_slope = 0, .y_slope = p / full_turn, .p = p, .q = 0};
}

double HelicalMap::x_frequency() const { return std::hypot(x_slope, p / full_turn); }
double HelicalMap::y_frequency() const { return std::hypot(y_slope, q / full_turn); }
double HelicalMap::mean_frequency() const { return std::sqrt(x_frequency() * y_frequency()); }

}  // namespace gamer
#endif
