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

/// A point in a lattice, and what decides which clumps are there.
template <class V>
struct LatticePlace {
  V x, y;     ///< cells
  V z;        ///< galaxy radii
  V inverse;  ///< of the probability that a cell holds a clump
};

/// The light of the clumps in the four cells next to a place.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ClumpLight(D d, const ClumpLevel& level, const LatticePlace<V>& at) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  constexpr std::uint32_t low_bits = 0xFFFF;
  constexpr float widest = 0.25f * 1.0001f;  // square, with a margin for rounding
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  const auto unit = [&](auto word) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, word)), hn::Set(d, 0x1p-16f));
  };
  const auto index_of = [&](V x) HWY_ATTR { return hn::BitCast(du, hn::ConvertTo(di, x)); };
  const V slope = hn::Mul(at.inverse, hn::Set(d, -0.5f / fade_range));
  const V start = hn::Set(d, 0.5f * (1 + fade_range) / fade_range);
  const V x = hn::Floor(hn::Sub(at.x, half)), y = hn::Floor(hn::Sub(at.y, half));
  const auto across = hn::Mul(index_of(x), hn::Set(du, lattice_px));
  const auto along =
      hn::Add(hn::Mul(index_of(y), hn::Set(du, lattice_py)), hn::Set(du, level.seed));
  V light = zero;
  for (std::uint32_t corner = 0; corner < 4; ++corner) {
    const std::uint32_t i = corner & 1, j = corner >> 1;
    const auto word = Mix32(du, hn::Xor(hn::Add(across, hn::Set(du, i * lattice_px)),
                                        Mix32(du, hn::Add(along, hn::Set(du, j * lattice_py)))));
    const auto again = Mix32(du, hn::Add(word, hn::Set(du, cell_step)));
    const V dx = hn::Sub(hn::Sub(hn::Sub(at.x, x), hn::Set(d, static_cast<float>(i))),
                         unit(hn::And(word, hn::Set(du, low_bits))));
    const V dy = hn::Sub(hn::Sub(hn::Sub(at.y, y), hn::Set(d, static_cast<float>(j))),
                         unit(hn::ShiftRight<16>(word)));
    const V across2 = hn::MulAdd(dx, dx, hn::Mul(dy, dy));
    V weight = hn::MulAdd(unit(hn::And(again, hn::Set(du, low_bits))), slope, start);
    weight = hn::Min(hn::Max(weight, zero), one);
    // No clump is wider than a cell, and most cells are empty.
    const auto counts = hn::And(hn::Lt(across2, hn::Set(d, widest)), hn::Gt(weight, zero));
    if (hn::AllFalse(d, counts)) continue;
    const auto kind = hn::BitCast(di, hn::ShiftRight<32 - clump_bits>(again));
    const V dz = hn::Sub(at.z, hn::GatherIndex(d, level.height.data(), kind));
    const V square =
        hn::Mul(hn::MulAdd(dz, dz, hn::Mul(across2, hn::Set(d, level.cell * level.cell))),
                hn::GatherIndex(d, level.inverse_square.data(), kind));
    const V rest = hn::Max(hn::Sub(one, square), zero);
    const V cube = hn::Mul(hn::Mul(rest, rest), rest);
    const V ninth = hn::Mul(hn::Mul(cube, cube), cube);
    const V profile = hn::Mul(cube, hn::MulAdd(ninth, hn::Set(d, core_height), one));
    const V height = hn::GatherIndex(d, level.amplitude.data(), kind);
    light = hn::MulAdd(hn::Mul(weight, height), profile, light);
  }
  return light;
}

void AddClumps(const Points& points, const ClumpLevel& level, const float* HWY_RESTRICT density,
               const float* HWY_RESTRICT complexes, const float* footprints,
               float* HWY_RESTRICT sum) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  const auto cosine = hn::Set(d, level.cosine), sine = hn::Set(d, level.sine);
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    auto seen = one;
    if (footprints != nullptr) {
      seen = SeenShare(d, hn::Load(d, footprints + i), level.frequency);
      if (hn::AllFalse(d, hn::Gt(seen, hn::Zero(d)))) continue;
    }
    const auto crowding = hn::Max(hn::Load(d, complexes + i), hn::Set(d, least_complexes));
    const auto occupancy =
        hn::Mul(hn::Mul(hn::Load(d, density + i), hn::Set(d, level.occupancy)), crowding);
    const auto inverse = hn::Div(one, hn::Min(occupancy, hn::Set(d, most_occupancy)));
    const auto x = hn::Load(d, points.x + i), y = hn::Load(d, points.y + i);
    const auto right = hn::MulAdd(y, sine, hn::Set(d, level.offset_x));
    const auto up = hn::NegMulAdd(x, sine, hn::Set(d, level.offset_y));
    const auto light = ClumpLight(
        d, level,
        LatticePlace<hn::Vec<decltype(d)>>{hn::MulAdd(x, cosine, right), hn::MulAdd(y, cosine, up),
                                           hn::Load(d, points.z + i), inverse});
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
