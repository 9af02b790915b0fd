#include "bench/peak.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/peak.cc"
#include "hwy/foreach_target.h"

#include "hwy/highway.h"

#ifndef GAMER_BENCH_PEAK_KERNEL
#define GAMER_BENCH_PEAK_KERNEL
namespace gamer {
namespace {

constexpr std::size_t rounds = 4096;
// Number of independent chains: more than latency times ports of any core.
constexpr std::size_t chains = 12;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t LanesAtPeak() { return hn::Lanes(hn::ScalableTag<float>()); }

float WorkAtPeak(float factor, float term) {
  const hn::ScalableTag<float> d;
  using V = hn::Vec<decltype(d)>;
  const V f = hn::Set(d, factor);
  const V t = hn::Set(d, term);
  // A compiler would merge chains that start alike.
  V x0 = t, x1 = hn::Add(x0, f), x2 = hn::Add(x1, f), x3 = hn::Add(x2, f), x4 = hn::Add(x3, f),
    x5 = hn::Add(x4, f), x6 = hn::Add(x5, f), x7 = hn::Add(x6, f), x8 = hn::Add(x7, f),
    x9 = hn::Add(x8, f), x10 = hn::Add(x9, f), x11 = hn::Add(x10, f);
  for (std::size_t i = 0; i < rounds; ++i) {
    x0 = hn::MulAdd(x0, f, t);
    x1 = hn::MulAdd(x1, f, t);
    x2 = hn::MulAdd(x2, f, t);
    x3 = hn::MulAdd(x3, f, t);
    x4 = hn::MulAdd(x4, f, t);
    x5 = hn::MulAdd(x5, f, t);
    x6 = hn::MulAdd(x6, f, t);
    x7 = hn::MulAdd(x7, f, t);
    x8 = hn::MulAdd(x8, f, t);
    x9 = hn::MulAdd(x9, f, t);
    x10 = hn::MulAdd(x10, f, t);
    x11 = hn::MulAdd(x11, f, t);
  }
  const V first = hn::Add(hn::Add(hn::Add(x0, x1), hn::Add(x2, x3)), hn::Add(x4, x5));
  const V second = hn::Add(hn::Add(hn::Add(x6, x7), hn::Add(x8, x9)), hn::Add(x10, x11));
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(first, second)));
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(LanesAtPeak);
HWY_EXPORT(WorkAtPeak);

std::size_t peak_operations() { return 2 * rounds * chains * HWY_DYNAMIC_DISPATCH(LanesAtPeak)(); }

float work_at_peak() {
  volatile float factor = 0.75f, term = 0.5f;
  return HWY_DYNAMIC_DISPATCH(WorkAtPeak)(factor, term);
}

}  // namespace gamer
#endif
