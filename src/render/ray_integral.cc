#include "render/ray_integral.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/ray_integral.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <memory>

#include "core/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// A vector of runs, every node of them or every second one.
template <class D>
class RunLanes {
  using DI = hn::RebindToSigned<D>;
  using V = hn::Vec<D>;
  using VI = hn::Vec<DI>;

 public:
  RunLanes(const RunNodes& runs, std::size_t from, std::int32_t stride)
      : runs_(runs), stride_(stride) {
    const D d;
    const DI di;
    HWY_ALIGN std::int32_t first[HWY_MAX_BYTES / sizeof(float)];
    HWY_ALIGN std::int32_t count[HWY_MAX_BYTES / sizeof(float)];
    HWY_ALIGN std::int32_t cover[HWY_MAX_BYTES / sizeof(float)];
    HWY_ALIGN float open[HWY_MAX_BYTES / sizeof(float)];
    longest_ = 0;
    any_open_ = false;
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      // Lanes beyond the last run repeat it.
      const std::size_t run = std::min(from + lane, runs.runs - 1);
      first[lane] = runs.first[run];
      count[lane] = (runs.count[run] + stride - 1) / stride;
      cover[lane] = runs.cover[run];
      open[lane] = runs.open[run] != 0 ? 1.0f : 0.0f;
      longest_ = std::max(longest_, count[lane]);
      any_open_ = any_open_ || runs.open[run] != 0;
    }
    first_ = hn::Load(di, first);
    count_ = hn::Load(di, count);
    cover_ = hn::Load(di, cover);
    open_ = hn::Gt(hn::Load(d, open), hn::Zero(d));
  }

  std::int32_t longest() const { return longest_; }
  bool any_open() const { return any_open_; }
  hn::Mask<D> open() const { return open_; }
  VI cover() const { return cover_; }
  hn::Mask<D> has(std::int32_t k) const {
    return hn::RebindMask(D(), hn::Lt(hn::Set(DI(), k), count_));
  }
  /// Index of node k; of the last one beyond it.
  VI at(std::int32_t k) const {
    const DI di;
    const VI own = hn::Min(hn::Set(di, k), hn::Sub(count_, hn::Set(di, 1)));
    return hn::Add(stride_ == 1 ? own : hn::ShiftLeft<1>(own), first_);
  }
  /// Zero beyond a run's last node.
  V weight(std::int32_t k) const {
    const D d;
    const V value = hn::GatherIndex(d, runs_.weight, at(k));
    return hn::IfThenElseZero(has(k), hn::Mul(value, hn::Set(d, static_cast<float>(stride_))));
  }

 private:
  const RunNodes& runs_;
  std::int32_t stride_;
  std::int32_t longest_;
  bool any_open_;
  hn::Mask<D> open_;
  VI first_, count_, cover_;
};

/// Optical depths up to one node after the other, in `channels` spectral nodes.
template <class D>
class DepthMarch {
  using V = hn::Vec<D>;

 public:
  /// extinction(slot, channel) of the lanes' covers; `memory` holds
  /// size(dust_slots, channels) vectors.
  template <class Extinction>
  DepthMarch(const RunNodes& runs, const RunLanes<D>& lanes, std::size_t channels,
             const Extinction& extinction, float* memory)
      : runs_(runs), lanes_(lanes), channels_(channels), extinction_(memory) {
    const D d;
    const std::size_t n = hn::Lanes(d);
    window_ = extinction_ + runs.dust_slots * channels * n;
    depth_ = window_ + 4 * channels * n;
    for (std::size_t slot = 0; slot < runs.dust_slots; ++slot) {
      for (std::size_t c = 0; c < channels; ++c) {
        hn::Store(extinction(slot, c), d, extinction_ + (slot * channels + c) * n);
      }
    }
    std::fill_n(window_, 5 * channels * n, 0.0f);
    if (!lanes.any_open()) return;
    // The cubic through the first four nodes continues to a node before them.
    constexpr float continuation[] = {4, -6, 4, -1};
    for (std::int32_t k = 0; k < 4; ++k) {
      load(k);
      for (std::size_t c = 0; c < channels; ++c) {
        float* before = window_ + (4 * c + 1) * n;
        hn::Store(hn::MulAdd(hn::Set(d, continuation[k]), newest(c), hn::Load(d, before)), d,
                  before);
      }
    }
    for (std::size_t c = 0; c < channels; ++c) {
      float* window = window_ + 4 * c * n;
      // Slot 1 holds the sum; it becomes node -1 in slot 3.
      const V before = hn::IfThenElseZero(lanes.open(), hn::Load(d, window + n));
      hn::Store(hn::Zero(d), d, window + n);
      hn::Store(before, d, window + 3 * n);
    }
  }

  static std::size_t size(std::size_t dust_slots, std::size_t channels) {
    return dust_slots * channels + 5 * channels;
  }

  /// Takes node k in; false where there is no dust within its reach.
  HWY_INLINE void take(std::int32_t k) {
    const D d;
    const std::size_t n = hn::Lanes(d);
    for (std::size_t c = 0; c < channels_; ++c) {
      float* window = window_ + 4 * c * n;
      for (std::size_t i = 0; i < 3; ++i) {
        hn::Store(hn::Load(d, window + (i + 1) * n), d, window + i * n);
      }
    }
    load_last(k);
  }

  /// Moves the depths on to node k - 1, where node k was taken in last.
  HWY_INLINE void advance(std::int32_t k) {
    const D d;
    const std::size_t n = hn::Lanes(d);
    if (k < 2) return;
    const auto own = lanes_.has(k - 1);
    const V inner = hn::Set(d, 13.0f / 24), outer = hn::Set(d, 1.0f / 24);
    for (std::size_t c = 0; c < channels_; ++c) {
      const float* window = window_ + 4 * c * n;
      const V near = hn::Add(hn::Load(d, window + n), hn::Load(d, window + 2 * n));
      const V far = hn::Add(hn::Load(d, window), hn::Load(d, window + 3 * n));
      const V more = hn::NegMulAdd(outer, far, hn::Mul(inner, near));
      float* depth = depth_ + c * n;
      hn::Store(hn::Add(hn::Load(d, depth), hn::IfThenElseZero(own, more)), d, depth);
    }
  }

  V depth(std::size_t channel) const {
    const D d;
    return hn::Load(d, depth_ + channel * hn::Lanes(d));
  }

 private:
  V newest(std::size_t c) const {
    const D d;
    return hn::Load(d, window_ + (4 * c + 3) * hn::Lanes(d));
  }
  /// Opacity times weight at node k, into the windows' last places.
  HWY_INLINE void load(std::int32_t k) { load_last(k); }
  HWY_INLINE void load_last(std::int32_t k) {
    const D d;
    const std::size_t n = hn::Lanes(d);
    for (std::size_t c = 0; c < channels_; ++c) {
      hn::Store(hn::Zero(d), d, window_ + (4 * c + 3) * n);
    }
    if (k >= lanes_.longest()) return;
    const auto at = lanes_.at(k);
    const V weight = lanes_.weight(k);
    for (std::size_t slot = 0; slot < runs_.dust_slots; ++slot) {
      const V opacity = hn::Mul(weight, hn::GatherIndex(d, runs_.dust[slot], at));
      for (std::size_t c = 0; c < channels_; ++c) {
        float* last = window_ + (4 * c + 3) * n;
        const V relative = hn::Load(d, extinction_ + (slot * channels_ + c) * n);
        hn::Store(hn::MulAdd(relative, opacity, hn::Load(d, last)), d, last);
      }
    }
  }

  const RunNodes& runs_;
  const RunLanes<D>& lanes_;
  std::size_t channels_;
  float* extinction_;  ///< [slot * channels + channel]
  float* window_;      ///< [channel][4]: opacity times weight at four nodes
  float* depth_;       ///< [channel]
};

/// exp(-tau), tau at least 0: interpolation may overshoot.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Fade(D d, V tau) {
  return Exp(d, hn::Neg(hn::Max(tau, hn::Zero(d))));
}

/// The weights of light at node k: those of the cubic Gregory rule where a run begins open.
template <class D>
HWY_INLINE hn::Vec<D> LightWeight(const RunLanes<D>& lanes, std::int32_t k) {
  const D d;
  constexpr float gregory[] = {8.0f / 24, 31.0f / 24, 20.0f / 24, 25.0f / 24};
  const auto weight = lanes.weight(k);
  if (k >= 4 || !lanes.any_open()) return weight;
  return hn::IfThenElse(lanes.open(), hn::Mul(weight, hn::Set(d, gregory[k])), weight);
}

/// All light slots and spectral nodes.
template <class D>
void IntegrateFinely(const RunNodes& runs, const RunSpectra& spectra, const RunIntegrals& out,
                     std::size_t from, float* memory) {
  const D d;
  const std::size_t n = hn::Lanes(d);
  const std::size_t nodes = spectra.nodes;
  const RunLanes<D> lanes(runs, from, 1);
  float* light = memory;  // [slot * nodes + j]
  std::fill_n(light, runs.light_slots * nodes * n, 0.0f);
  if (runs.dust_slots == 0) {
    for (std::int32_t k = 0; k < lanes.longest(); ++k) {
      const auto at = lanes.at(k);
      const auto weight = LightWeight<D>(lanes, k);
      for (std::size_t slot = 0; slot < runs.light_slots; ++slot) {
        float* sum = light + slot * nodes * n;
        hn::Store(hn::MulAdd(weight, hn::GatherIndex(d, runs.light[slot], at), hn::Load(d, sum)), d,
                  sum);
      }
    }
    for (std::size_t slot = 0; slot < runs.light_slots; ++slot) {
      const auto sum = hn::Load(d, light + slot * nodes * n);
      for (std::size_t j = 0; j < nodes; ++j) hn::Store(sum, d, light + (slot * nodes + j) * n);
    }
  } else {
    float* faded = light + runs.light_slots * nodes * n;  // [j]: weight times transmission
    DepthMarch<D> march(
        runs, lanes, nodes,
        [&](std::size_t slot, std::size_t j) HWY_ATTR {
          return hn::GatherIndex(d, spectra.extinction + (slot * nodes + j) * spectra.covers,
                                 lanes.cover());
        },
        faded + nodes * n);
    march.take(0);
    for (std::int32_t k = 1; k <= lanes.longest(); ++k) {
      march.take(k);
      march.advance(k);
      const auto at = lanes.at(k - 1);
      const auto weight = LightWeight<D>(lanes, k - 1);
      for (std::size_t j = 0; j < nodes; ++j) {
        hn::Store(hn::Mul(weight, Fade(d, march.depth(j))), d, faded + j * n);
      }
      for (std::size_t slot = 0; slot < runs.light_slots; ++slot) {
        const auto emission = hn::GatherIndex(d, runs.light[slot], at);
        for (std::size_t j = 0; j < nodes; ++j) {
          float* sum = light + (slot * nodes + j) * n;
          hn::Store(hn::MulAdd(emission, hn::Load(d, faded + j * n), hn::Load(d, sum)), d, sum);
        }
      }
    }
    for (std::size_t j = 0; j < nodes; ++j) {
      hn::StoreU(march.depth(j), d, out.depth + j * out.stride + from);
    }
  }
  for (std::size_t i = 0; i < runs.light_slots * nodes; ++i) {
    hn::StoreU(hn::Load(d, light + i * n), d, out.light + i * out.stride + from);
  }
  for (std::size_t j = 0; j < nodes && runs.dust_slots == 0; ++j) {
    hn::StoreU(hn::Zero(d), d, out.depth + j * out.stride + from);
  }
}

/// The steering planes' flux by every second node.
template <class D>
void IntegrateCoarsely(const RunNodes& runs, const RunSpectra& spectra, const RunIntegrals& out,
                       std::size_t from, float* memory) {
  const D d;
  const std::size_t n = hn::Lanes(d);
  const std::size_t planes = spectra.steering;
  const RunLanes<D> lanes(runs, from, 2);
  float* flux = memory;                                 // [s * slots + slot]
  float* light = flux + planes * runs.light_slots * n;  // [s]
  std::fill_n(light, planes * n, 0.0f);
  for (std::size_t i = 0; i < planes * runs.light_slots; ++i) {
    hn::Store(hn::GatherIndex(d, spectra.flux + i * spectra.covers, lanes.cover()), d,
              flux + i * n);
  }
  DepthMarch<D> march(
      runs, lanes, planes,
      [&](std::size_t slot, std::size_t s) HWY_ATTR {
        const std::size_t j = spectra.steering_node[s];
        return hn::GatherIndex(d, spectra.extinction + (slot * spectra.nodes + j) * spectra.covers,
                               lanes.cover());
      },
      light + 2 * planes * n);
  float* emission = light + planes * n;  // [s]
  march.take(0);
  for (std::int32_t k = 1; k <= lanes.longest(); ++k) {
    march.take(k);
    march.advance(k);
    const auto at = lanes.at(k - 1);
    const auto weight = LightWeight<D>(lanes, k - 1);
    std::fill_n(emission, planes * n, 0.0f);
    for (std::size_t slot = 0; slot < runs.light_slots; ++slot) {
      const auto value = hn::GatherIndex(d, runs.light[slot], at);
      for (std::size_t s = 0; s < planes; ++s) {
        const auto own = hn::Load(d, flux + (s * runs.light_slots + slot) * n);
        hn::Store(hn::MulAdd(own, value, hn::Load(d, emission + s * n)), d, emission + s * n);
      }
    }
    for (std::size_t s = 0; s < planes; ++s) {
      auto faded = weight;
      if (runs.dust_slots > 0) faded = hn::Mul(weight, Fade(d, march.depth(s)));
      hn::Store(hn::MulAdd(faded, hn::Load(d, emission + s * n), hn::Load(d, light + s * n)), d,
                light + s * n);
    }
  }
  for (std::size_t s = 0; s < planes; ++s) {
    hn::StoreU(hn::Load(d, light + s * n), d, out.coarse_light + s * out.stride + from);
    hn::StoreU(march.depth(s), d, out.coarse_depth + s * out.stride + from);
  }
}

void IntegrateRuns(const RunNodes& runs, const RunSpectra& spectra, const RunIntegrals& out,
                   std::vector<float>& memory) {
  using D = hn::ScalableTag<float>;
  const D d;
  const std::size_t fine = runs.light_slots * spectra.nodes + spectra.nodes +
                           DepthMarch<D>::size(runs.dust_slots, spectra.nodes);
  const std::size_t coarse = spectra.steering * (runs.light_slots + 2) +
                             DepthMarch<D>::size(runs.dust_slots, spectra.steering);
  const std::size_t align = HWY_MAX_BYTES / sizeof(float);
  memory.resize(std::max(fine, coarse) * hn::Lanes(d) + align);
  void* start = memory.data();
  std::size_t room = memory.size() * sizeof(float);
  auto* aligned = static_cast<float*>(std::align(HWY_MAX_BYTES, sizeof(float), start, room));
  for (std::size_t from = 0; from < runs.runs; from += hn::Lanes(d)) {
    IntegrateFinely<D>(runs, spectra, out, from, aligned);
    IntegrateCoarsely<D>(runs, spectra, out, from, aligned);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(IntegrateRuns);

void integrate_runs(const RunNodes& runs, const RunSpectra& spectra, const RunIntegrals& out) {
  if (runs.runs == 0) return;
  thread_local std::vector<float> memory;
  HWY_DYNAMIC_DISPATCH(IntegrateRuns)(runs, spectra, out, memory);
}

}  // namespace gamer
#endif
