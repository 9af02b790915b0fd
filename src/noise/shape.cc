#include "gamer/noise/shape.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/shape.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>

#include "core/math-inl.h"
#include "gamer/core/batch.h"

#ifndef GAMER_NOISE_SHAPE_KERNEL
#define GAMER_NOISE_SHAPE_KERNEL
namespace gamer {
namespace {

/// The constants of NoiseShape: v = shift + slope S, then the power.
struct ShapeInput {
  float slope;
  float shift;
  float floor;
  float exponent;
  float scale;
  int whole_exponent;  ///< |exponent| where it is a small whole number, else -1
  bool inverse;
  float inverse_contrast;
  float offset;
  /// Table [n][s][2] with the entries of s at the levels n and n + 1; null without expectations.
  const float* expected;
};

// The table holds s = (v - offset)/contrast in [-table_end, table_end] at steps_per_sigma.
constexpr int table_end = 6;
constexpr int steps_per_sigma = 32;
constexpr int table_size = 2 * table_end * steps_per_sigma + 1;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Raise(D d, V base, const ShapeInput& shape) {
  if (shape.whole_exponent < 0) return Pow(d, base, hn::Set(d, shape.exponent));
  V phi = hn::Set(d, 1.0f);
  for (int n = shape.whole_exponent; n > 0; n >>= 1) {
    if (n & 1) phi = hn::Mul(phi, base);
    base = hn::Mul(base, base);
  }
  return shape.exponent < 0 ? hn::Div(hn::Set(d, 1.0f), phi) : phi;
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Base(D d, V v, const ShapeInput& shape) {
  return shape.inverse ? hn::Max(hn::Abs(v), hn::Set(d, shape.floor)) : hn::Max(v, hn::Zero(d));
}

void ApplyShape(const ShapeInput& shape, std::size_t size, float* HWY_RESTRICT values) {
  const hn::ScalableTag<float> d;
  const auto slope = hn::Set(d, shape.slope);
  const auto shift = hn::Set(d, shape.shift);
  const auto scale = hn::Set(d, shape.scale);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto v = hn::MulAdd(hn::Load(d, values + i), slope, shift);
    hn::Store(hn::Mul(Raise(d, Base(d, v, shape), shape), scale), d, values + i);
  }
}

/// Values whose expectations are looked up together, at most `capacity`.
struct Lookups {
  static constexpr std::size_t capacity = 64;
  static_assert(capacity % batch_padding == 0);
  HWY_ALIGN std::int32_t at[capacity];  ///< place of a value's four neighbours in the table
  HWY_ALIGN float up[capacity];         ///< fraction between two levels
  HWY_ALIGN float right[capacity];      ///< fraction between two places of s
  HWY_ALIGN float corners[4 * capacity];
};

void ApplyExpected(const ShapeInput& shape, std::size_t size, const float* HWY_RESTRICT hidden,
                   float* HWY_RESTRICT values) {
  if (shape.expected == nullptr) return ApplyShape(shape, size, values);
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto one = hn::Set(d, 1.0f);
  const auto zero = hn::Zero(d);
  const auto scale = hn::Set(d, shape.scale);
  const auto v_of = [&](std::size_t i) HWY_ATTR {
    return hn::MulAdd(hn::Load(d, values + i), hn::Set(d, shape.slope), hn::Set(d, shape.shift));
  };
  const auto h_of = [&](std::size_t i)
                        HWY_ATTR { return hn::Min(hn::Max(hn::Load(d, hidden + i), zero), one); };
  Lookups look;
  for (std::size_t begin = 0; begin < size; begin += Lookups::capacity) {
    const std::size_t end = std::min(begin + Lookups::capacity, size);
    for (std::size_t i = begin; i < end; i += lanes) {
      const auto level =
          hn::Mul(hn::Sqrt(h_of(i)), hn::Set(d, static_cast<float>(NoiseShape::levels - 1)));
      const auto row = hn::Min(hn::Floor(level), hn::Set(d, NoiseShape::levels - 2.0f));
      const auto s =
          hn::Mul(hn::Sub(v_of(i), hn::Set(d, shape.offset)), hn::Set(d, shape.inverse_contrast));
      auto x = hn::MulAdd(s, hn::Set(d, static_cast<float>(steps_per_sigma)),
                          hn::Set(d, static_cast<float>(table_end * steps_per_sigma)));
      x = hn::Min(hn::Max(x, zero), hn::Set(d, static_cast<float>(table_size - 1)));
      const auto column = hn::Min(hn::Floor(x), hn::Set(d, static_cast<float>(table_size - 2)));
      const auto place = hn::Add(hn::Mul(hn::ConvertTo(di, row), hn::Set(di, table_size)),
                                 hn::ConvertTo(di, column));
      hn::Store(hn::ShiftLeft<1>(place), di, look.at + (i - begin));
      hn::Store(hn::Sub(level, row), d, look.up + (i - begin));
      hn::Store(hn::Sub(x, column), d, look.right + (i - begin));
    }
    // One load takes four numbers; a gather loads each by itself.
    const std::size_t filled = (end - begin + lanes - 1) / lanes * lanes;
    for (std::size_t k = 0; k < filled; ++k) {
      std::memcpy(look.corners + 4 * k, shape.expected + look.at[k], 4 * sizeof(float));
    }
    for (std::size_t i = begin; i < end; i += lanes) {
      const auto some = hn::Gt(h_of(i), zero);
      auto phi = zero;
      if (!hn::AllFalse(d, some)) {
        auto low = zero, high = zero, low_right = zero, high_right = zero;
        hn::LoadInterleaved4(d, look.corners + 4 * (i - begin), low, high, low_right, high_right);
        const auto right = hn::Load(d, look.right + (i - begin));
        low = hn::MulAdd(right, hn::Sub(low_right, low), low);
        high = hn::MulAdd(right, hn::Sub(high_right, high), high);
        const auto entry = hn::MulAdd(hn::Load(d, look.up + (i - begin)), hn::Sub(high, low), low);
        phi = shape.inverse ? Exp2(d, entry) : Raise(d, entry, shape);
      }
      if (!hn::AllTrue(d, some)) {
        phi = hn::IfThenElse(some, phi, Raise(d, Base(d, v_of(i), shape), shape));
      }
      hn::Store(hn::Mul(phi, scale), d, values + i);
    }
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(ApplyShape);
HWY_EXPORT(ApplyExpected);

namespace {

// Whole powers up to here are multiplied out; beyond, e^(alpha ln v) is as fast.
constexpr double largest_whole_exponent = 20.0;

// log2 of the largest number in single precision, with a margin.
constexpr double largest_log2 = 127.9;

/// The exponent, negative where Theta is inverse.
double power_of(const NoiseShape::Parameters& p) { return p.inverse ? -p.exponent : p.exponent; }

double base_of(const NoiseShape::Parameters& p, double v) {
  return p.inverse ? std::max(std::abs(v), p.floor) : std::max(v, 0.0);
}

/// ShapeInput::expected, for each level of h and each s. An entry is a function of E[Phi] that is
/// smoother in s than E[Phi] itself. For the linear Theta the function is E[Phi]^(1/alpha), which
/// is nearly linear. For the inverse Theta it is log2 E[Phi], as E[Phi] is above 0.
std::vector<float> make_table(const NoiseShape::Parameters& p) {
  const double power = power_of(p);
  std::vector<float> result(static_cast<std::size_t>(2 * (NoiseShape::levels - 1) * table_size));
  // Phi for s from -2 table_end to 2 table_end, so that a normal deviate from any entry stays
  // inside.
  constexpr int margin = table_end * steps_per_sigma;
  std::vector<double> phi(static_cast<std::size_t>(table_size + 2 * margin));
  const auto v_at = [&](int x) {
    return p.offset + p.contrast * (static_cast<double>(x) / steps_per_sigma - table_end);
  };
  for (int x = -margin; x < table_size + margin; ++x) {
    phi[static_cast<std::size_t>(x + margin)] = std::pow(base_of(p, v_at(x)), power);
  }
  for (int level = 0; level < NoiseShape::levels; ++level) {
    // The normal density on the table's steps, at least one per sigma.
    const double sigma = static_cast<double>(steps_per_sigma) * level / (NoiseShape::levels - 1);
    const int reach = std::min(static_cast<int>(std::ceil(table_end * sigma)), margin);
    std::vector<double> density;
    double norm = 0;
    for (int k = -reach; k <= reach; ++k) {
      density.push_back(sigma > 0 ? std::exp(-0.5 * k * k / (sigma * sigma)) : 1.0);
      norm += density.back();
    }
    std::array<double, table_size> sums{};
    for (int k = -reach; k <= reach; ++k) {
      const double share = density[static_cast<std::size_t>(k + reach)];
      const double* shifted = phi.data() + k + margin;
      for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += share * shifted[x];
    }
    for (int x = 0; x < table_size; ++x) {
      const double expected = sums[static_cast<std::size_t>(x)] / norm;
      const double entry = p.inverse    ? std::min(std::log2(expected), largest_log2)
                           : power != 0 ? std::pow(expected, 1 / power)
                                        : 1.0;
      const auto place = static_cast<std::size_t>(2 * (level * table_size + x));
      if (level + 1 < NoiseShape::levels) result[place] = static_cast<float>(entry);
      if (level > 0) result[place - 2 * table_size + 1] = static_cast<float>(entry);
    }
  }
  return result;
}

/// Galaxies of one type share their tables, whatever their seeds.
std::shared_ptr<const std::vector<float>> find_table(const NoiseShape::Parameters& parameters) {
  static std::mutex mutex;
  static std::map<NoiseShape::Parameters, std::shared_ptr<const std::vector<float>>> known;
  const std::lock_guard lock(mutex);
  auto& table = known[parameters];
  if (table == nullptr) table = std::make_shared<const std::vector<float>>(make_table(parameters));
  return table;
}

ShapeInput make_input(const NoiseShape::Parameters& p, const NoiseShape::Standard& standard,
                      double scale) {
  const double exponent = power_of(p);
  const bool whole =
      std::abs(exponent) <= largest_whole_exponent && exponent == std::trunc(exponent);
  ShapeInput shape{};
  shape.slope = static_cast<float>(p.contrast * standard.slope);
  shape.shift = static_cast<float>(p.offset + p.contrast * standard.shift);
  shape.floor = static_cast<float>(p.floor);
  shape.exponent = static_cast<float>(exponent);
  shape.scale = static_cast<float>(scale);
  shape.whole_exponent = whole ? static_cast<int>(std::abs(exponent)) : -1;
  shape.inverse = p.inverse;
  shape.inverse_contrast = static_cast<float>(1 / p.contrast);
  shape.offset = static_cast<float>(p.offset);
  return shape;
}

}  // namespace

NoiseShape::NoiseShape(const Parameters& parameters)
    : parameters_(parameters), table_(parameters.expected ? nullptr : find_table(parameters)) {}

void NoiseShape::apply(const Standard& standard, double scale, std::size_t size,
                       float* values) const {
  HWY_DYNAMIC_DISPATCH(ApplyShape)(make_input(parameters_, standard, scale), size, values);
}

void NoiseShape::apply_expected(const Standard& standard, double scale, std::size_t size,
                                const float* hidden, float* values) const {
  ShapeInput shape = make_input(parameters_, standard, scale);
  shape.expected = table_ != nullptr ? table_->data() : nullptr;
  HWY_DYNAMIC_DISPATCH(ApplyExpected)(shape, size, hidden, values);
}

}  // namespace gamer
#endif
