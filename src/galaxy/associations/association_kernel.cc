#include "galaxy/associations/association_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/associations/association_kernel.cc"
#include "hwy/foreach_target.h"

#include "core/math-inl.h"
#include "gamer/noise/footprint.h"
#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// The share of features of this frequency that footprints resolve.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SeenShare(D d, V footprint, float frequency) {
  constexpr auto slope = static_cast<float>(1 / (fade_end - fade_begin));
  return Smoothstep(d, hn::NegMulAdd(footprint, hn::Set(d, frequency * slope),
                                     hn::Set(d, static_cast<float>(fade_end) * slope)));
}

/// The density at (x, y), interpolated.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V DensityAt(D d, const SurfaceDensity& density, V x, V y) {
  const hn::RebindToSigned<D> di;
  const auto last = static_cast<float>(density.points - 1);
  const V half = hn::Set(d, 0.5f * last);
  const auto place = [&](V coordinate) HWY_ATTR {
    const V u = hn::MulAdd(coordinate, half, half);
    return hn::Min(hn::Max(u, hn::Zero(d)), hn::Set(d, last));
  };
  const V u = place(x), v = place(y), most = hn::Set(d, last - 1);
  const V column = hn::Min(hn::Floor(u), most), row = hn::Min(hn::Floor(v), most);
  const auto index = hn::Add(hn::Mul(hn::ConvertTo(di, row), hn::Set(di, density.points)),
                             hn::ConvertTo(di, column));
  const float* const values = density.values.data();
  const auto mixed = [&](const float* from) HWY_ATTR {
    const V left = hn::GatherIndex(d, from, index), right = hn::GatherIndex(d, from + 1, index);
    return hn::MulAdd(hn::Sub(u, column), hn::Sub(right, left), left);
  };
  const V low = mixed(values), high = mixed(values + density.points);
  return hn::MulAdd(hn::Sub(v, row), hn::Sub(high, low), low);
}

void MultiplyOctave(std::size_t size, const float* HWY_RESTRICT noise, float contrast,
                    float frequency, const float* footprints, const float* before, float* out) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f), most = hn::Set(d, 1.5f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto s = hn::Mul(hn::Load(d, noise + i), hn::Set(d, contrast));
    s = hn::Min(hn::Max(s, hn::Neg(most)), most);
    const auto bent =
        hn::NegMulAdd(hn::Mul(s, s), hn::Set(d, octave_depth * 4 / 27), hn::Set(d, octave_depth));
    auto factor = hn::MulAdd(s, bent, one);
    if (footprints != nullptr) {
      const auto seen = SeenShare(d, hn::Load(d, footprints + i), frequency);
      factor = hn::MulAdd(seen, hn::Sub(factor, one), one);
    }
    hn::Store(hn::Mul(factor, hn::Load(d, before + i)), d, out + i);
  }
}

/// A point, its place in a lattice, and the part of the octaves that decides which clumps exist
/// there.
template <class V>
struct LatticePlace {
  V px, py, pz;  ///< of the point
  V x, y;        ///< in the lattice, cells
  V crowding;    ///< the part of the octaves
};

/// A wave of period 1 between -1 and 1, of two parabolas.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Wave(D d, V x) {
  const V f = hn::Sub(x, hn::Round(x));
  return hn::Mul(f, hn::NegMulAdd(hn::Abs(f), hn::Set(d, 16.0f), hn::Set(d, 8.0f)));
}

/// The light of these model clumps at places in radii of the clumps.
template <class D, class V = hn::Vec<D>, class I, class U>
HWY_INLINE V BentProfile(D d, const ClumpTier& tier, V x, V y, V z, I model, U shape) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const auto part = [&](auto bytes) HWY_ATTR {
    const auto byte = hn::And(bytes, hn::Set(du, 0xFFu));
    return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, byte)), hn::Set(d, 0x1p-8f));
  };
  const V p0 = part(shape), p1 = part(hn::ShiftRight<8>(shape)),
          p2 = part(hn::ShiftRight<16>(shape)), p3 = part(hn::ShiftRight<24>(shape));
  const V turn = hn::Mul(z, hn::Set(d, bend_turn));
  const auto bend = [&](const Bend& by, V along, V phase, V from) HWY_ATTR {
    const V wave = Wave(d, hn::MulAdd(along, hn::Set(d, by.cycles), phase));
    return hn::MulAdd(wave, hn::Set(d, by.height * tier.bends), from);
  };
  x = bend(wide_bend, y, hn::Add(p0, turn), x);
  y = bend(wide_bend, x, hn::Sub(p1, turn), y);
  x = bend(narrow_bend, y, p2, x);
  y = bend(narrow_bend, x, p3, y);
  const V z2 = hn::Mul(z, z);
  const V in_plane = hn::NegMulAdd(x, x, hn::NegMulAdd(y, y, one));
  const auto cube = [&](V rest) HWY_ATTR {
    rest = hn::Max(rest, zero);
    return hn::Mul(hn::Mul(rest, rest), rest);
  };
  const V two = hn::Set(d, 2.0f);
  const auto signed_part = [&](V p, float most) HWY_ATTR {
    return hn::Mul(hn::MulSub(p, two, one), hn::Set(d, most));
  };
  const V tilt = hn::MulAdd(signed_part(p1, largest_tilt), x,
                            hn::MulAdd(signed_part(p3, largest_tilt), y, one));
  const V hole = hn::NegMulAdd(hn::Mul(in_plane, in_plane),
                               hn::GatherIndex(d, tier.cavity.data(), model), one);
  const V halo = hn::Mul(hn::Mul(cube(hn::Sub(in_plane, z2)), tilt), hole);
  const V core_x = signed_part(p0, core_offset), core_y = signed_part(p2, core_offset);
  constexpr float inverse_square = 1 / (core_radius * core_radius);
  const auto core = [&](V at_x, V at_y) HWY_ATTR {
    const V dx = hn::Sub(x, at_x), dy = hn::Sub(y, at_y);
    const V square = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, z2));
    return cube(hn::NegMulAdd(square, hn::Set(d, inverse_square), one));
  };
  const V cores =
      hn::MulAdd(core(hn::Neg(core_y), core_x), hn::Set(d, second_core), core(core_x, core_y));
  return hn::MulAdd(cores, hn::GatherIndex(d, tier.cores.data(), model),
                    hn::Mul(halo, hn::GatherIndex(d, tier.halo.data(), model)));
}

/// The light of the clumps in the four cells next to a place, relative to its mean.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ClumpLight(D d, const ClumpTier& tier, const SurfaceDensity& density,
                        const LatticePlace<V>& at) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  constexpr std::uint32_t low_bits = 0xFFFF;
  constexpr float widest = 0.5f * 1.0001f;  // with a margin for rounding
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  const auto unit = [&](auto word) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, word)), hn::Set(d, 0x1p-16f));
  };
  const auto index_of = [&](V x) HWY_ATTR { return hn::BitCast(du, hn::ConvertTo(di, x)); };
  const V crowding =
      hn::Mul(hn::Max(at.crowding, hn::Set(d, least_complexes)), hn::Set(d, tier.occupancy));
  const V start = hn::Set(d, 0.5f * (1 + fade_range) / fade_range);
  const V x = hn::Floor(hn::Sub(at.x, half)), y = hn::Floor(hn::Sub(at.y, half));
  const auto row = hn::Mul(index_of(x), hn::Set(du, lattice_px));
  const auto along = hn::Add(hn::Mul(index_of(y), hn::Set(du, lattice_py)), hn::Set(du, tier.seed));
  // Factors that turn offsets in the lattice back to galaxy radii.
  const float turn_x = tier.cosine * tier.cell * tier.cell;
  const float turn_y = tier.sine * tier.cell * tier.cell;
  const auto reach = static_cast<float>(1 / clump_reach(double{tier.bends}));
  V light = zero;
  for (std::uint32_t corner = 0; corner < 4; ++corner) {
    const std::uint32_t i = corner & 1, j = corner >> 1;
    const auto word = Mix32(du, hn::Xor(hn::Add(row, hn::Set(du, i * lattice_px)),
                                        Mix32(du, hn::Add(along, hn::Set(du, j * lattice_py)))));
    const auto again = Mix32(du, hn::Add(word, hn::Set(du, cell_step)));
    const V dx = hn::Sub(hn::Sub(hn::Sub(at.x, x), hn::Set(d, static_cast<float>(i))),
                         unit(hn::And(word, hn::Set(du, low_bits))));
    const V dy = hn::Sub(hn::Sub(hn::Sub(at.y, y), hn::Set(d, static_cast<float>(j))),
                         unit(hn::ShiftRight<16>(word)));
    // No clump is wider than a cell.
    const V across = hn::Max(hn::Abs(dx), hn::Abs(dy));
    if (hn::AllFalse(d, hn::Lt(across, hn::Set(d, widest)))) continue;
    const V to_x = hn::MulSub(dx, hn::Set(d, turn_x), hn::Mul(dy, hn::Set(d, turn_y)));
    const V to_y = hn::MulAdd(dx, hn::Set(d, turn_y), hn::Mul(dy, hn::Set(d, turn_x)));
    const V around = DensityAt(d, density, hn::Sub(at.px, to_x), hn::Sub(at.py, to_y));
    const V inverse = hn::Div(one, hn::Min(hn::Mul(around, crowding), hn::Set(d, most_occupancy)));
    const V slope = hn::Mul(inverse, hn::Set(d, -0.5f / fade_range));
    const V weight =
        Clamp01(d, hn::MulAdd(unit(hn::And(again, hn::Set(du, low_bits))), slope, start));
    if (hn::AllFalse(d, hn::Gt(weight, zero))) continue;  // most cells are empty
    const auto model = hn::BitCast(di, hn::ShiftRight<32 - clump_bits>(again));
    const V inverse_radius = hn::GatherIndex(d, tier.inverse_radius.data(), model);
    const V dz =
        hn::Mul(hn::Sub(at.pz, hn::GatherIndex(d, tier.height.data(), model)), inverse_radius);
    const V scale = hn::Mul(inverse_radius, hn::Set(d, tier.cell));
    // Points above, below or beside the clump get no light from it.
    const V farthest = hn::Max(hn::Abs(dz), hn::Mul(hn::Mul(across, scale), hn::Set(d, reach)));
    if (hn::AllFalse(d, hn::Lt(farthest, one))) continue;
    const V profile = BentProfile(d, tier, hn::Mul(dx, scale), hn::Mul(dy, scale), dz, model,
                                  Mix32(du, hn::Add(again, hn::Set(du, cell_step))));
    light = hn::MulAdd(hn::Mul(weight, inverse), profile, light);
  }
  return light;
}

void AddClumps(const Points& points, const ClumpTier& tier, const SurfaceDensity& density,
               const float* HWY_RESTRICT complexes, const float* footprints,
               float* HWY_RESTRICT sum) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  const auto cosine = hn::Set(d, tier.cosine), sine = hn::Set(d, tier.sine);
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    auto seen = one;
    if (footprints != nullptr) {
      seen = SeenShare(d, hn::Load(d, footprints + i), tier.frequency);
      if (hn::AllFalse(d, hn::Gt(seen, hn::Zero(d)))) continue;
    }
    LatticePlace<hn::Vec<decltype(d)>> at;
    at.px = hn::Load(d, points.x + i);
    at.py = hn::Load(d, points.y + i);
    at.pz = hn::Load(d, points.z + i);
    at.x = hn::MulAdd(at.px, cosine, hn::MulAdd(at.py, sine, hn::Set(d, tier.offset_x)));
    at.y = hn::MulAdd(at.py, cosine, hn::NegMulAdd(at.px, sine, hn::Set(d, tier.offset_y)));
    at.crowding = hn::Load(d, complexes + i);
    const auto excess = hn::Sub(ClumpLight(d, tier, density, at), one);
    hn::Store(hn::MulAdd(hn::Mul(seen, hn::Set(d, tier.share)), excess, hn::Load(d, sum + i)), d,
              sum + i);
  }
}

void FillLight(std::size_t size, const float* HWY_RESTRICT sum, const float* HWY_RESTRICT factor,
               float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto light = hn::Max(hn::Add(hn::Load(d, sum + i), hn::Set(d, 1.0f)), hn::Zero(d));
    hn::Store(hn::Mul(light, hn::Load(d, factor + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(MultiplyOctave);
void multiply_octave(std::size_t size, const float* noise, float contrast, float frequency,
                     const float* footprints, const float* before, float* out) {
  HWY_DYNAMIC_DISPATCH(MultiplyOctave)(size, noise, contrast, frequency, footprints, before, out);
}

HWY_EXPORT(AddClumps);
void add_clumps(const Points& points, const ClumpTier& tier, const SurfaceDensity& density,
                const float* complexes, const float* footprints, float* sum) {
  HWY_DYNAMIC_DISPATCH(AddClumps)(points, tier, density, complexes, footprints, sum);
}

HWY_EXPORT(FillLight);
void fill_light(std::size_t size, const float* sum, const float* factor, float* out) {
  HWY_DYNAMIC_DISPATCH(FillLight)(size, sum, factor, out);
}

}  // namespace gamer
#endif
