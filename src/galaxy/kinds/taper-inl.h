// The taper of galaxies over vectors. Included once per SIMD target.

#if defined(GAMER_GALAXY_TAPER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_GALAXY_TAPER_INL_H_
#undef GAMER_GALAXY_TAPER_INL_H_
#else
#define GAMER_GALAXY_TAPER_INL_H_
#endif

#include "gamer/galaxy/sample_batch.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// taper_at(radius), absolute error below 1e-6.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Taper(D d, V radius) {
  const V one = hn::Set(d, 1.0f);
  V u = hn::Mul(hn::Sub(one, radius), hn::Set(d, static_cast<float>(1 / (1 - taper_start))));
  u = hn::Min(hn::Max(u, hn::Zero(d)), one);
  const V p = hn::MulAdd(u, hn::MulAdd(u, hn::Set(d, 6.0f), hn::Set(d, -15.0f)), hn::Set(d, 10.0f));
  return hn::Mul(hn::Mul(hn::Mul(u, u), u), p);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
