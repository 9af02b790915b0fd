#include "gamer/galaxy/kinds/layer_warp.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/kinds/layer_warp.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "core/math-inl.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/units.h"

#ifndef GAMER_GALAXY_LAYER_WARP_KERNEL
#define GAMER_GALAXY_LAYER_WARP_KERNEL
namespace gamer {
namespace {

/// LayerWarp in single precision.
struct WarpKernelInput {
  float height, begin, inverse_rest, power, angle, twist;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void Lift(const SampleBatch& batch, const WarpKernelInput& in, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto beyond = hn::Sub(hn::Load(d, batch.r.data() + i), hn::Set(d, in.begin));
    const auto u = hn::Mul(hn::Max(beyond, hn::Zero(d)), hn::Set(d, in.inverse_rest));
    const auto rise = hn::Mul(Pow(d, u, hn::Set(d, in.power)), hn::Set(d, in.height));
    const auto node = hn::MulAdd(beyond, hn::Set(d, in.twist), hn::Set(d, in.angle));
    auto sine = hn::Zero(d), cosine = hn::Zero(d);
    SinCos(d, hn::Sub(hn::Load(d, batch.azimuth.data() + i), node), sine, cosine);
    hn::Store(hn::Mul(rise, sine), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(Lift);

namespace {

BoundTable warp_keys(LayerWarp& p) {
  return {
      {p.height, "warp_height", "galaxy radii", Interval::closed(0, 1).usual(0, 0.5),
       "height to which the warped plane rises at the galaxy's edge; 0 for a flat layer"},
      {p.begin, "warp_begin", "galaxy radii", Interval::closed(0, 0.9).usual(0, 0.8),
       "radius within which the plane is flat"},
      {p.power, "warp_power", "", Interval::closed(1, 10).usual(1, 4),
       "p: the plane rises as (r - warp_begin)^p; with p = 1 and warp_begin = 0 it is tilted"},
      {p.angle, "warp_angle", "deg", Interval::any().usual(-180, 180),
       "azimuth of the line of nodes, from the x axis towards y; the plane is highest 90 "
       "degrees further"},
      {p.twist, "warp_twist", "deg/galaxy radius", Interval::closed(-1000, 1000).usual(-400, 400),
       "turn of the line of nodes with the radius, from warp_begin on"}};
}

double relative_height(const LayerWarp& warp, double r) {
  const double u = std::max(r - warp.begin, 0.0) / (1 - warp.begin);
  if (warp.power == 1) return u;
  return warp.power == 2 ? u * u : std::pow(u, warp.power);
}

}  // namespace

double LayerWarp::most(double r) const { return height * relative_height(*this, r); }

double LayerWarp::lift(double x, double y) const {
  const double r = std::sqrt(x * x + y * y);
  if (!(r > begin)) return 0;
  const double node = angle + twist * (r - begin);
  return most(r) * (y * std::cos(node) - x * std::sin(node)) / r;
}

double LayerWarp::steepest(double r) const {
  // The slope along r is the derivative of u^power, times a sine. The slope along the azimuth is
  // u^power/r, times the cosine. The factor of the sine is the larger one. The twist adds to the
  // slope along r.
  if (!(r > begin) && power > 1) return 0;
  const double u = std::max(r - begin, 0.0) / (1 - begin);
  return height * std::pow(u, power - 1) * (power / (1 - begin) + u * std::abs(twist));
}

void LayerWarp::lift(const SampleBatch& batch, float* out) const {
  const WarpKernelInput in{static_cast<float>(height),          static_cast<float>(begin),
                           static_cast<float>(1 / (1 - begin)), static_cast<float>(power),
                           static_cast<float>(angle),           static_cast<float>(twist)};
  HWY_DYNAMIC_DISPATCH(Lift)(batch, in, out);
}

ParameterTable LayerWarp::parameters() { return declarations(warp_keys); }

LayerWarp LayerWarp::read(const ParameterSet& values) {
  LayerWarp warp = read_object(values, warp_keys);
  warp.angle = std::remainder(warp.angle, 360.0) * degree;
  warp.twist *= degree;
  return warp;
}

}  // namespace gamer
#endif
