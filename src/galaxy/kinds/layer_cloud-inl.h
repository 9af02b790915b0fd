// The points of a layer's cloud over vectors. Included once per SIMD target.

#if defined(GAMER_GALAXY_LAYER_CLOUD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_GALAXY_LAYER_CLOUD_INL_H_
#undef GAMER_GALAXY_LAYER_CLOUD_INL_H_
#else
#define GAMER_GALAXY_LAYER_CLOUD_INL_H_
#endif

#include <numbers>

#include "core/math-inl.h"
#include "galaxy/kinds/layer_cloud.h"
#include "galaxy/kinds/taper-inl.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/sample_batch.h"
#include "gamer/noise/cloud.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Draws the points of the cloud from index `first` on: m (in batch.r), psi (in batch.azimuth), v,
/// and the weight m dm/(1 - v^2). dm is the distance of the neighbouring nodes.
void DrawCloud(const CloudInput& in, std::size_t first, SampleBatch& batch, BatchArray& share,
               BatchArray& weight) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  constexpr float half_turn = std::numbers::pi_v<float>;
  const auto half = hn::Set(d, 0.5f);
  const auto one = hn::Set(d, 1.0f);
  const auto vertical = hn::Set(d, in.vertical);
  const auto azimuthal = hn::Set(d, in.azimuthal);
  // Within its cell a point is shifted by multiples of irrational numbers.
  const auto shifted = [&](auto cell, auto one_cell, std::size_t one_step, auto other_cell,
                           std::size_t other_step) HWY_ATTR {
    const auto step = [](std::size_t k) {
      return static_cast<std::uint32_t>(R3Sequence::steps[k] >> 32);
    };
    const auto bits = [&](auto value)
                          HWY_ATTR { return hn::BitCast(du, hn::ConvertTo(di, value)); };
    const auto word = hn::Add(hn::Mul(bits(one_cell), hn::Set(du, step(one_step))),
                              hn::Mul(bits(other_cell), hn::Set(du, step(other_step))));
    const auto shift = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(word)));
    return hn::MulAdd(shift, hn::Set(d, 0x1p-24f), cell);
  };
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto index = hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(first + i)));
    const auto column = hn::Floor(hn::Div(hn::Add(index, half), vertical));
    const auto c = hn::NegMulAdd(column, vertical, index);
    const auto a = hn::Floor(hn::Div(hn::Add(column, half), azimuthal));
    const auto b = hn::NegMulAdd(a, azimuthal, column);
    const auto u_radial = shifted(a, b, 0, c, 1);
    const auto u_angle = shifted(b, c, 2, a, 0);
    const auto u_height = shifted(c, a, 1, b, 2);
    const auto node = hn::Mul(u_radial, hn::Set(d, cloud_nodes / in.radial));
    const auto k = hn::Min(hn::Floor(node), hn::Set(d, cloud_nodes - 1.0f));
    const auto at = hn::Max(hn::ConvertTo(di, k), hn::Zero(di));
    const auto inner = hn::GatherIndex(d, in.node_radius, at);
    const auto width = hn::Sub(hn::GatherIndex(d, in.node_radius + 1, at), inner);
    const auto r = hn::MulAdd(hn::Sub(node, k), width, inner);
    auto v = hn::Sub(hn::Div(hn::Add(u_height, u_height), vertical), one);
    v = hn::Min(hn::Max(v, hn::Set(d, -largest_share)), hn::Set(d, largest_share));
    hn::Store(r, d, batch.r.data() + i);
    hn::Store(hn::Mul(hn::Sub(hn::Div(u_angle, azimuthal), half), hn::Set(d, 2 * half_turn)), d,
              batch.azimuth.data() + i);
    hn::Store(v, d, share.data() + i);
    hn::Store(hn::Div(hn::Mul(r, width), hn::NegMulAdd(v, v, one)), d, weight.data() + i);
  }
}

/// Places points at z = z0 e^(flare r) atanh(v), with x and y turned back by the twirl.
void PlaceCloud(const SampleBatch& batch, const BatchArray& v, const CloudInput& in,
                WeightedBatch& points, BatchArray& taper) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < batch.size; i += hn::Lanes(d)) {
    const auto share = hn::Load(d, v.data() + i);
    const auto ratio = hn::Div(hn::Add(one, share), hn::Sub(one, share));
    auto z = hn::Mul(Log(d, ratio), hn::Set(d, 0.5f * in.z0));
    const auto r = hn::Load(d, batch.r.data() + i);
    if (in.flare > 0) z = hn::Mul(z, Exp(d, hn::Mul(r, hn::Set(d, in.flare))));
    auto sine = hn::Zero(d);
    auto cosine = hn::Zero(d);
    SinCos(d,
           hn::NegMulAdd(hn::Load(d, batch.winding.data() + i), hn::Set(d, in.twirl),
                         hn::Load(d, batch.azimuth.data() + i)),
           sine, cosine);
    hn::Store(hn::Mul(r, cosine), d, points.x.data() + i);
    hn::Store(hn::Mul(r, sine), d, points.y.data() + i);
    hn::Store(z, d, points.z.data() + i);
    hn::Store(Taper(d, hn::Sqrt(hn::MulAdd(r, r, hn::Mul(z, z)))), d, taper.data() + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
