#include "galaxy/associations/association_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/associations/association_kernel.cc"
#include "hwy/foreach_target.h"

#include "core/math-inl.h"
#include "gamer/noise/footprint.h"
#include "noise/lattice.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// The share that footprints resolve of features of this frequency.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SeenShare(D d, V footprint, float frequency) {
  constexpr auto slope = static_cast<float>(1 / (fade_end - fade_begin));
  V u = hn::NegMulAdd(footprint, hn::Set(d, frequency * slope),
                      hn::Set(d, static_cast<float>(fade_end) * slope));
  u = hn::Min(hn::Max(u, hn::Zero(d)), hn::Set(d, 1.0f));
  return hn::Mul(hn::Mul(u, u), hn::NegMulAdd(hn::Set(d, 2.0f), u, hn::Set(d, 3.0f)));
}

void FillSurfaceDensity(const Points& points, const SurfaceDensity& density,
                        float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto last = static_cast<float>(density.points - 1);
  const auto half = hn::Set(d, 0.5f * last);
  const auto most = hn::Set(d, last - 1);
  const auto row = hn::Set(di, density.points);
  const float* const at = density.values.data();
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto place = [&](const float* coordinate) HWY_ATTR {
      const auto u = hn::MulAdd(hn::Load(d, coordinate + i), half, half);
      return hn::Min(hn::Max(u, hn::Zero(d)), hn::Set(d, last));
    };
    const auto x = place(points.x), y = place(points.y);
    const auto column = hn::Min(hn::Floor(x), most), line = hn::Min(hn::Floor(y), most);
    const auto index = hn::Add(hn::Mul(hn::ConvertTo(di, line), row), hn::ConvertTo(di, column));
    const auto fx = hn::Sub(x, column), fy = hn::Sub(y, line);
    const auto mixed = [&](auto from) HWY_ATTR {
      const auto left = hn::GatherIndex(d, at, from);
      const auto right = hn::GatherIndex(d, at + 1, from);
      return hn::MulAdd(fx, hn::Sub(right, left), left);
    };
    const auto low = mixed(index), high = mixed(hn::Add(index, row));
    hn::Store(hn::MulAdd(fy, hn::Sub(high, low), low), d, out + i);
  }
}

void MultiplyOctave(std::size_t size, const float* HWY_RESTRICT noise, float contrast,
                    float frequency, const float* footprints, const float* before, float* out) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto factor = hn::MulAdd(hn::Load(d, noise + i), hn::Set(d, contrast), one);
    factor = hn::Min(hn::Max(factor, hn::Zero(d)), hn::Set(d, 2.0f));
    if (footprints != nullptr) {
      const auto seen = SeenShare(d, hn::Load(d, footprints + i), frequency);
      factor = hn::MulAdd(seen, hn::Sub(factor, one), one);
    }
    hn::Store(hn::Mul(factor, hn::Load(d, before + i)), d, out + i);
  }
}

/// mix32() of lattice.h over vectors.
template <class DU, class VU = hn::Vec<DU>>
HWY_INLINE VU Mix32(DU du, VU word) {
  word = hn::Mul(hn::Xor(word, hn::ShiftRight<16>(word)), hn::Set(du, 0x7FEB352Du));
  word = hn::Mul(hn::Xor(word, hn::ShiftRight<15>(word)), hn::Set(du, 0x846CA68Bu));
  return hn::Xor(word, hn::ShiftRight<16>(word));
}

void AddClumps(const Points& points, const ClumpLevel& level, const float* HWY_RESTRICT density,
               const float* HWY_RESTRICT complexes, const float* footprints,
               float* HWY_RESTRICT sum) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  const auto one = hn::Set(d, 1.0f);
  const auto half = hn::Set(d, 0.5f);
  constexpr std::uint32_t low_bits = 0xFFFF;
  const auto unit = [&](auto word) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, word)), hn::Set(d, 0x1p-16f));
  };
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    auto seen = one;
    if (footprints != nullptr) {
      seen = SeenShare(d, hn::Load(d, footprints + i), level.frequency);
      if (hn::AllFalse(d, hn::Gt(seen, hn::Zero(d)))) continue;
    }
    auto occupancy = hn::Mul(hn::Mul(hn::Load(d, density + i), hn::Set(d, level.occupancy)),
                             hn::Load(d, complexes + i));
    occupancy = hn::Min(hn::Max(occupancy, hn::Set(d, least_occupancy)),
                        hn::Set(d, most_occupancy));
    const auto inverse = hn::Div(one, occupancy);
    const auto slope = hn::Mul(inverse, hn::Set(d, -0.5f / fade_range));
    const auto start = hn::Set(d, 0.5f * (1 + fade_range) / fade_range);
    const auto px = hn::Load(d, points.x + i), py = hn::Load(d, points.y + i);
    const auto pz = hn::Load(d, points.z + i);
    const auto x = hn::MulAdd(px, hn::Set(d, level.cosine),
                              hn::MulAdd(py, hn::Set(d, level.sine), hn::Set(d, level.offset_x)));
    const auto y = hn::MulAdd(py, hn::Set(d, level.cosine),
                              hn::NegMulAdd(px, hn::Set(d, level.sine),
                                            hn::Set(d, level.offset_y)));
    const auto first_x = hn::Floor(hn::Sub(x, half)), first_y = hn::Floor(hn::Sub(y, half));
    const auto from_x = hn::Sub(x, first_x), from_y = hn::Sub(y, first_y);
    const auto across = hn::Mul(hn::BitCast(du, hn::ConvertTo(di, first_x)),
                                hn::Set(du, lattice_px));
    const auto along = hn::Add(hn::Mul(hn::BitCast(du, hn::ConvertTo(di, first_y)),
                                       hn::Set(du, lattice_py)),
                               hn::Set(du, level.seed));
    auto light = hn::Zero(d);
    for (std::uint32_t corner = 0; corner < 4; ++corner) {
      const std::uint32_t a = corner & 1, b = corner >> 1;
      const auto word = Mix32(
          du, hn::Xor(hn::Add(across, hn::Set(du, a * lattice_px)),
                      Mix32(du, hn::Add(along, hn::Set(du, b * lattice_py)))));
      const auto again = Mix32(du, hn::Add(word, hn::Set(du, cell_step)));
      const auto dx = hn::Sub(hn::Sub(from_x, hn::Set(d, static_cast<float>(a))),
                              unit(hn::And(word, hn::Set(du, low_bits))));
      const auto dy = hn::Sub(hn::Sub(from_y, hn::Set(d, static_cast<float>(b))),
                              unit(hn::ShiftRight<16>(word)));
      const auto number = unit(hn::And(again, hn::Set(du, low_bits)));
      auto weight = hn::MulAdd(number, slope, start);
      weight = hn::Min(hn::Max(weight, hn::Zero(d)), one);
      const auto index = hn::BitCast(di, hn::ShiftRight<32 - clump_bits>(again));
      const auto dz = hn::Sub(pz, hn::GatherIndex(d, level.height.data(), index));
      const auto plane = hn::Mul(hn::MulAdd(dx, dx, hn::Mul(dy, dy)),
                                 hn::Set(d, level.cell * level.cell));
      const auto square = hn::Mul(hn::MulAdd(dz, dz, plane),
                                  hn::GatherIndex(d, level.inverse_square.data(), index));
      const auto rest = hn::Max(hn::Sub(one, square), hn::Zero(d));
      const auto cube = hn::Mul(hn::Mul(rest, rest), rest);
      const auto ninth = hn::Mul(hn::Mul(cube, cube), cube);
      const auto profile = hn::Mul(cube, hn::MulAdd(ninth, hn::Set(d, core_height), one));
      light = hn::MulAdd(hn::Mul(weight, hn::GatherIndex(d, level.amplitude.data(), index)),
                         profile, light);
    }
    const auto excess = hn::MulSub(light, inverse, one);
    hn::Store(hn::MulAdd(hn::Mul(seen, hn::Set(d, level.share)), excess, hn::Load(d, sum + i)), d,
              sum + i);
  }
}

void FillLight(std::size_t size, const float* HWY_RESTRICT sum, const float* HWY_RESTRICT factor,
               float scale, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto light = hn::Max(hn::Add(hn::Load(d, sum + i), hn::Set(d, 1.0f)), hn::Zero(d));
    hn::Store(hn::Mul(hn::Mul(light, hn::Load(d, factor + i)), hn::Set(d, scale)), d, out + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(FillSurfaceDensity);
void fill_surface_density(const Points& points, const SurfaceDensity& density, float* out) {
  HWY_DYNAMIC_DISPATCH(FillSurfaceDensity)(points, density, out);
}

HWY_EXPORT(MultiplyOctave);
void multiply_octave(std::size_t size, const float* noise, float contrast, float frequency,
                     const float* footprints, const float* before, float* out) {
  HWY_DYNAMIC_DISPATCH(MultiplyOctave)(size, noise, contrast, frequency, footprints, before, out);
}

HWY_EXPORT(AddClumps);
void add_clumps(const Points& points, const ClumpLevel& level, const float* density,
                const float* complexes, const float* footprints, float* sum) {
  HWY_DYNAMIC_DISPATCH(AddClumps)(points, level, density, complexes, footprints, sum);
}

HWY_EXPORT(FillLight);
void fill_light(std::size_t size, const float* sum, const float* factor, float scale, float* out) {
  HWY_DYNAMIC_DISPATCH(FillLight)(size, sum, factor, scale, out);
}

}  // namespace gamer
#endif
