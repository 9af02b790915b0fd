// The metric of spheroids over vectors. Included once per SIMD target.

#if defined(GAMER_GALAXY_SPHEROID_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_GALAXY_SPHEROID_INL_H_
#undef GAMER_GALAXY_SPHEROID_INL_H_
#else
#define GAMER_GALAXY_SPHEROID_INL_H_
#endif

#include "core/math-inl.h"
#include "galaxy/kinds/spheroid.h"
#include "gamer/galaxy/sample_batch.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// (m / unit)^2 of the points of a batch from index i on.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V MetricSquared(D d, const SampleBatch& batch, std::size_t i,
                           const SpheroidMetric& metric) {
  const V x = hn::Mul(hn::Load(d, batch.x.data() + i), hn::Set(d, metric.inverse_axis[0]));
  const V y = hn::Mul(hn::Load(d, batch.y.data() + i), hn::Set(d, metric.inverse_axis[1]));
  const V z = hn::Mul(hn::Load(d, batch.z.data() + i), hn::Set(d, metric.inverse_axis[2]));
  if (metric.boxiness == 2) {
    return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::MulAdd(z, z, hn::Set(d, metric.softening))));
  }
  // Relative to the largest coordinate, so that no power leaves the domain of Exp.
  const V ax = hn::Abs(x), ay = hn::Abs(y), az = hn::Abs(z);
  const V largest = hn::Max(hn::Max(ax, ay), hn::Max(az, hn::Set(d, 1e-30f)));
  const V unit = hn::Div(hn::Set(d, 1.0f), largest), c = hn::Set(d, metric.boxiness);
  const auto power = [&](V value)
                         HWY_ATTR { return Exp(d, hn::Mul(c, Log(d, hn::Mul(value, unit)))); };
  const V sum = hn::Add(power(ax), hn::Add(power(ay), power(az)));
  const V stretch = Exp(d, hn::Mul(hn::Set(d, 2 / metric.boxiness), Log(d, sum)));
  return hn::MulAdd(hn::Mul(largest, largest), stretch, hn::Set(d, metric.softening));
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
