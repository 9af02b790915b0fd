#include "gamer/core/random_variate.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "gamer/core/random.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/random_variate.cc"
#include "hwy/foreach_target.h"

#include "core/double_math-inl.h"
#include "hwy/highway.h"

#ifndef GAMER_CORE_RANDOM_VARIATE_ONCE_
#define GAMER_CORE_RANDOM_VARIATE_ONCE_

namespace gamer {
namespace {

/// Variates made at a time; their scratch arrays stay in the first-level cache.
constexpr std::size_t block_size = 512;
/// The widest vectors in use: 2048 bits.
constexpr std::size_t most_lanes = 32;

constexpr double least_rejection_mean = 10;
constexpr double largest_mean = 1e100;
/// P(N >= 64) < 1e-29 for means below least_rejection_mean; no uniform number is so near to 1.
constexpr std::size_t most_inverted = 64;

struct Reciprocals {
  constexpr Reciprocals() {
    for (std::size_t k = 1; k <= most_inverted; ++k) values[k] = 1 / static_cast<double>(k);
  }
  double values[most_inverted + 1] = {};
};
constexpr Reciprocals reciprocals;

/// Stirling's error, ln k! - ln(sqrt(2 pi k) k^k e^-k), where the series is too short.
constexpr std::size_t stirling_table = 16;
constexpr double stirling_errors[stirling_table] = {0,  // k = 0 has its own formula
                                                    0.0810614667953272582196702,
                                                    0.0413406959554092940938221,
                                                    0.0276779256849983391487893,
                                                    0.0207906721037650931115228,
                                                    0.0166446911898211921631949,
                                                    0.0138761288230707479987457,
                                                    0.0118967099458917700950557,
                                                    0.0104112652619720964974786,
                                                    0.0092554621827127329177286,
                                                    0.0083305634333628712564693,
                                                    0.0075736754879518407949720,
                                                    0.0069428401072095298656642,
                                                    0.0064089941880042070684396,
                                                    0.0059513701127588477356244,
                                                    0.0055547335519628013710387};

/// Indices of a block's variates that are not done.
struct Places {
  HWY_ALIGN_MAX std::uint64_t values[block_size + most_lanes];
  std::size_t count = 0;
};

}  // namespace
}  // namespace gamer

#endif  // GAMER_CORE_RANDOM_VARIATE_ONCE_

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {
namespace {

using DD = hn::CappedTag<double, most_lanes>;
using DU = hn::RebindToUnsigned<DD>;
using VD = hn::Vec<DD>;
using VU = hn::Vec<DU>;
using MD = hn::Mask<DD>;

HWY_INLINE VU Mix64(VU z) {
  const DU du;
  z = hn::Xor(z, hn::ShiftRight<30>(z)) * hn::Set(du, std::uint64_t{0xbf58476d1ce4e5b9u});
  z = hn::Xor(z, hn::ShiftRight<27>(z)) * hn::Set(du, std::uint64_t{0x94d049bb133111ebu});
  return hn::Xor(z, hn::ShiftRight<31>(z));
}

HWY_INLINE VU NextWord(VU word) { return Mix64(hn::Add(word, hn::Set(DU(), golden_gamma))); }

/// States of splitmix64 for consecutive numbers, one vector at a time.
class Counter {
 public:
  Counter(std::uint64_t key, std::uint64_t first)
      : state_(hn::Iota(DU(), std::uint64_t{0}) * hn::Set(DU(), golden_gamma)),
        step_(hn::Set(DU(), golden_gamma * hn::Lanes(DU()))) {
    state_ = hn::Add(state_, hn::Set(DU(), key + (first + 1) * golden_gamma));
  }
  HWY_INLINE VU Next() {
    const VU word = Mix64(state_);
    state_ = hn::Add(state_, step_);
    return word;
  }

 private:
  VU state_;
  VU step_;
};

/// The upper 52 bits as a number in [1, 2).
HWY_INLINE VD OneToTwo(VU word) {
  constexpr std::uint64_t bits_of_one = 0x3ff0000000000000u;
  return hn::BitCast(DD(), hn::Or(hn::ShiftRight<12>(word), hn::Set(DU(), bits_of_one)));
}

/// Uniform in ]-1/2, 1/2[, on a grid that is symmetric about 0.
HWY_INLINE VD Centred(VU word) {
  return hn::Add(hn::Sub(OneToTwo(word), hn::Set(DD(), 1.5)), hn::Set(DD(), 0x1p-53));
}

/// One attempt of PTRS.
struct Attempt {
  VD count;
  VD us;        ///< 1/2 - |U|
  VD v_low;     ///< V before its lower bits, a multiple of v_step
  VD a, b;      ///< coefficients of the transformation
  MD squeezed;  ///< accepted without the probability
};

/// U uses the upper 40 bits of the word, V begins with the lower 24.
constexpr double v_step = 0x1p-24;

HWY_INLINE Attempt Try(VD mean, VU word) {
  constexpr std::uint64_t upper_bits = ~std::uint64_t{0xffffff};
  const DD d;
  const VD half = hn::Set(d, 0.5);
  const VD u = hn::Add(hn::Sub(OneToTwo(hn::And(word, hn::Set(DU(), upper_bits))), hn::Set(d, 1.5)),
                       hn::Set(d, 0x1p-41));
  Attempt t;
  t.v_low = hn::Sub(OneToTwo(hn::ShiftLeft<40>(word)), hn::Set(d, 1.0));
  t.us = hn::Sub(half, hn::Abs(u));
  t.b = hn::Add(hn::Set(d, 0.931), hn::Mul(hn::Set(d, 2.53), hn::Sqrt(mean)));
  t.a = hn::Add(hn::Set(d, -0.059), hn::Mul(hn::Set(d, 0.02483), t.b));
  // 1/us and 1/(b - 2) from one division.
  const VD b2 = hn::Sub(t.b, hn::Set(d, 2.0));
  const VD both = hn::Div(hn::Set(d, 1.0), hn::Mul(t.us, b2));
  const VD slope = hn::Add(hn::Mul(hn::Add(t.a, t.a), hn::Mul(both, b2)), t.b);
  t.count = hn::Floor(hn::Add(hn::Add(hn::Mul(slope, u), mean), hn::Set(d, 0.43)));
  const VD v_r = hn::Sub(hn::Set(d, 0.9277), hn::Mul(hn::Set(d, 3.6224), hn::Mul(both, t.us)));
  t.squeezed =
      hn::And(hn::Ge(t.us, hn::Set(d, 0.07)), hn::Le(hn::Add(t.v_low, hn::Set(d, v_step)), v_r));
  return t;
}

/// ln(P(k) sqrt(2 pi k)) of the Poisson distribution for k >= 1, absolute error below 1e-12 where
/// it is above -40: -(Stirling's error) - (k ln(k / mean) + mean - k).
HWY_INLINE VD LogProbability(VD k, VD mean) {
  // Coefficients of atanh(v)/v - 1 in v^2; good to 1e-16 below series_end.
  constexpr double atanh_terms[] = {1.0 / 3,  1.0 / 5,  1.0 / 7, 1.0 / 9,
                                    1.0 / 11, 1.0 / 13, 1.0 / 15};
  constexpr double series_end = 0.1;
  constexpr double stirling_terms[] = {1.0 / 12, -1.0 / 360, 1.0 / 1260, -1.0 / 1680};
  const DD d;
  const hn::RebindToSigned<DD> di;
  const VD difference = hn::Sub(k, mean);
  // 1/k and 1/(k + mean) from one division.
  const VD sum = hn::Add(k, mean);
  const VD both = hn::Div(hn::Set(d, 1.0), hn::Mul(k, sum));
  const VD v = hn::Mul(difference, hn::Mul(both, k));
  const VD v2 = hn::Mul(v, v);
  // k ln(k/mean) + mean - k = 2 k atanh(v) - difference = difference v + 2 k (atanh(v) - v).
  VD deviance =
      hn::Add(hn::Mul(difference, v),
              hn::Mul(hn::Mul(hn::Add(k, k), v), hn::Mul(v2, Polynomial(d, v2, atanh_terms))));
  const MD far = hn::Gt(hn::Abs(v), hn::Set(d, series_end));
  if (!hn::AllFalse(d, far)) {
    const VD direct = hn::Sub(hn::Mul(k, LogDouble(d, hn::Div(k, mean))), difference);
    deviance = hn::IfThenElse(far, direct, deviance);
  }
  const VD inverse = hn::Mul(both, sum);
  VD stirling = hn::Mul(inverse, Polynomial(d, hn::Mul(inverse, inverse), stirling_terms));
  const VD end = hn::Set(d, static_cast<double>(stirling_table - 1));
  const MD few = hn::Le(k, end);
  if (!hn::AllFalse(d, few)) {
    const VD index = hn::Min(k, end);
    stirling = hn::IfThenElse(few, hn::GatherIndex(d, stirling_errors, hn::ConvertTo(di, index)),
                              stirling);
  }
  return hn::Neg(hn::Add(stirling, deviance));
}

/// Whether PTRS accepts the count: V / (alpha (a / us^2 + b)) <= P(count), where 1 / alpha = 1.1239
/// + 1.1328 / (b - 3.4).
HWY_INLINE MD Accepted(const Attempt& t, VD mean, VU word) {
  constexpr double two_pi = 6.283185307179586;
  const DD d;
  const VD one = hn::Set(d, 1.0);
  const VD rest = hn::Add(hn::Sub(OneToTwo(NextWord(hn::Not(word))), one), hn::Set(d, 0x1p-53));
  const VD v = hn::Add(t.v_low, hn::Mul(rest, hn::Set(d, v_step)));
  const VD b3 = hn::Sub(t.b, hn::Set(d, 3.4));
  const VD us2 = hn::Mul(t.us, t.us);
  const VD above = hn::Mul(hn::Add(hn::Mul(hn::Set(d, 1.1239), b3), hn::Set(d, 1.1328)), us2);
  const VD below = hn::Mul(b3, hn::Add(t.a, hn::Mul(t.b, us2)));
  const VD share = hn::Mul(v, hn::Div(above, below));
  const VD k = hn::Max(t.count, one);
  const VD root = hn::Sqrt(hn::Mul(hn::Set(d, two_pi), k));
  const VD log_probability = LogProbability(k, mean);
  const MD none = hn::Eq(t.count, hn::Zero(d));
  const VD left = LogDouble(d, hn::Mul(share, hn::IfThenElse(none, one, root)));
  const VD right = hn::IfThenElse(none, hn::Neg(mean), log_probability);
  return hn::And(hn::Ge(t.count, hn::Zero(d)), hn::Le(left, right));
}

/// The count whose interval of the distribution function contains the word's uniform number.
HWY_INLINE VD Invert(VD mean, VU word) {
  const DD d;
  const VD one = hn::Set(d, 1.0);
  VD rest = hn::Add(hn::Sub(OneToTwo(word), one), hn::Set(d, 0x1p-53));
  VD probability = ExpDouble(d, hn::Neg(mean));
  VD count = hn::Zero(d);
  for (std::size_t k = 1; k <= most_inverted; ++k) {
    rest = hn::Sub(rest, probability);
    const MD beyond = hn::Ge(rest, hn::Zero(d));
    if (hn::AllFalse(d, beyond)) break;
    count = hn::Add(count, hn::IfThenElseZero(beyond, one));
    probability = hn::Mul(probability, hn::Mul(mean, hn::Set(d, reciprocals.values[k])));
  }
  return count;
}

/// Appends the indices of the lanes in `which`, without branches, which could not be predicted.
HWY_INLINE void Append(MD which, VU names, Places& places) {
  const DU du;
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  places.count +=
      hn::CompressStore(names, hn::RebindMask(du, which), du, places.values + places.count);
#else
  // CompressStore uses a table, which GCC copies to the stack in each call.
  HWY_ALIGN_MAX std::uint64_t lanes[most_lanes];
  hn::Store(names, du, lanes);
  std::uint8_t bytes[sizeof(std::uint64_t)] = {};
  hn::StoreMaskBits(DD(), which, bytes);
  std::uint64_t bits = 0;
  std::memcpy(&bits, bytes, sizeof(bits));
  for (std::size_t lane = 0; lane < hn::Lanes(du); ++lane, bits >>= 1) {
    places.values[places.count] = lanes[lane];
    places.count += bits & 1;
  }
#endif
}

/// Draws the pending counts of a block until all are accepted. `words` holds the word of each.
void FinishRejected(const double* means, std::uint64_t* HWY_RESTRICT words, Places* pending,
                    Places* rejected, double* counts) {
  const DD d;
  const DU du;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN_MAX double left_means[block_size + most_lanes];
  HWY_ALIGN_MAX std::uint64_t left_words[block_size + most_lanes];
  HWY_ALIGN_MAX double results[block_size + most_lanes];
  while (pending->count > 0) {
    const std::size_t left = pending->count;
    for (std::size_t i = 0; i < left; ++i) {
      left_means[i] = means[pending->values[i]];
      left_words[i] = words[pending->values[i]];
    }
    // The rest of the last vector is filled with values whose results are ignored.
    std::fill_n(left_means + left, lanes, least_rejection_mean);
    std::fill_n(left_words + left, lanes, std::uint64_t{0});
    rejected->count = 0;
    for (std::size_t i = 0; i < left; i += lanes) {
      const VD mean = hn::Load(d, left_means + i);
      const VU word = hn::Load(du, left_words + i);
      const Attempt t = Try(mean, word);
      const MD taken = hn::Or(t.squeezed, Accepted(t, mean, word));
      hn::Store(t.count, d, results + i);
      hn::Store(NextWord(word), du, left_words + i);
      const MD valid = hn::FirstN(d, left - i);
      Append(hn::AndNot(taken, valid), hn::Load(du, pending->values + i), *rejected);
    }
    // Rejected counts are copied too; the next attempt replaces them.
    for (std::size_t i = 0; i < left; ++i) {
      counts[pending->values[i]] = results[i];
      words[pending->values[i]] = left_words[i];
    }
    std::swap(pending, rejected);
  }
}

/// Both arrays have room for whole vectors.
void PoissonBlock(std::uint64_t key, std::uint64_t first, std::size_t size, const double* means,
                  double* counts) {
  const DD d;
  const DU du;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN_MAX std::uint64_t words[block_size + most_lanes];
  Places lists[2];
  Places* pending = &lists[0];
  Places* rejected = &lists[1];
  Counter counter(key, first);
  VU names = hn::Iota(du, std::uint64_t{0});
  for (std::size_t i = 0; i < size; i += lanes) {
    const VU word = counter.Next();
    const VD mean = hn::Load(d, means + i);
    const MD small = hn::Lt(mean, hn::Set(d, least_rejection_mean));
    const MD large = hn::And(hn::Ge(mean, hn::Set(d, least_rejection_mean)),
                             hn::Le(mean, hn::Set(d, largest_mean)));
    VD result = mean;
    if (!hn::AllFalse(d, large)) {
      const Attempt t = Try(hn::IfThenElse(large, mean, hn::Set(d, least_rejection_mean)), word);
      result = hn::IfThenElse(large, t.count, result);
      hn::Store(word, du, words + i);
      Append(hn::AndNot(t.squeezed, large), names, *pending);
    }
    if (!hn::AllFalse(d, small)) {
      const VD safe = hn::IfThenElseZero(small, hn::Max(mean, hn::Zero(d)));
      result = hn::IfThenElse(small, Invert(safe, word), result);
    }
    hn::Store(result, d, counts + i);
    names = hn::Add(names, hn::Set(du, static_cast<std::uint64_t>(lanes)));
  }
  FinishRejected(means, words, pending, rejected, counts);
}

/// AS 241's rational functions: in the middle of 0.180625 - q^2, in the tails of sqrt(-ln p) - 1.6
/// and sqrt(-ln p) - 5.
constexpr double middle_end = 0.425;
constexpr double middle_centre = 0.180625;
constexpr double middle_above[] = {3.3871328727963666080e0,  1.3314166789178437745e+2,
                                   1.9715909503065514427e+3, 1.3731693765509461125e+4,
                                   4.5921953931549871457e+4, 6.7265770927008700853e+4,
                                   3.3430575583588128105e+4, 2.5090809287301226727e+3};
constexpr double middle_below[] = {1.0,
                                   4.2313330701600911252e+1,
                                   6.8718700749205790830e+2,
                                   5.3941960214247511077e+3,
                                   2.1213794301586595867e+4,
                                   3.9307895800092710610e+4,
                                   2.8729085735721942674e+4,
                                   5.2264952788528545610e+3};
constexpr double tail_centre = 1.6;
constexpr double tail_above[] = {1.42343711074968357734e0,  4.63033784615654529590e0,
                                 5.76949722146069140550e0,  3.64784832476320460504e0,
                                 1.27045825245236838258e0,  2.41780725177450611770e-1,
                                 2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr double tail_below[] = {1.0,
                                 2.05319162663775882187e0,
                                 1.67638483018380384940e0,
                                 6.89767334985100004550e-1,
                                 1.48103976427480074590e-1,
                                 1.51986665636164571966e-2,
                                 5.47593808499534494600e-4,
                                 1.05075007164441684324e-9};
constexpr double far_centre = 5;
constexpr double far_above[] = {6.65790464350110377720e0,  5.46378491116411436990e0,
                                1.78482653991729133580e0,  2.96560571828504891230e-1,
                                2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr double far_below[] = {1.0,
                                5.99832206555887937690e-1,
                                1.36929880922735805310e-1,
                                1.48753612908506148525e-2,
                                7.86869131145613259100e-4,
                                1.84631831751005468180e-5,
                                1.42151175831644588870e-7,
                                2.04426310338993978564e-15};

HWY_INLINE VD Tail(VD q) {
  const DD d;
  const VD p = hn::Sub(hn::Set(d, 0.5), hn::Abs(q));
  const VD r = hn::Sqrt(hn::Neg(LogDouble(d, p)));
  const VD near = hn::Sub(r, hn::Set(d, tail_centre));
  VD z = hn::Div(Polynomial(d, near, tail_above), Polynomial(d, near, tail_below));
  const MD is_far = hn::Gt(r, hn::Set(d, far_centre));
  if (!hn::AllFalse(d, is_far)) {
    const VD far = hn::Sub(r, hn::Set(d, far_centre));
    z = hn::IfThenElse(is_far,
                       hn::Div(Polynomial(d, far, far_above), Polynomial(d, far, far_below)), z);
  }
  return hn::CopySign(z, q);
}

/// Writes whole vectors.
void NormalBlock(std::uint64_t key, std::uint64_t first, std::size_t size, double* out) {
  const DD d;
  const DU du;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN_MAX double uniform[block_size + most_lanes];
  HWY_ALIGN_MAX double tails[block_size + most_lanes];
  Places places;
  Counter counter(key, first);
  VU names = hn::Iota(du, std::uint64_t{0});
  for (std::size_t i = 0; i < size; i += lanes) {
    const VD q = Centred(counter.Next());
    const VD r = hn::Sub(hn::Set(d, middle_centre), hn::Mul(q, q));
    const VD z = hn::Div(Polynomial(d, r, middle_above), Polynomial(d, r, middle_below));
    hn::Store(hn::Mul(q, z), d, out + i);
    hn::Store(q, d, uniform + i);
    Append(hn::Gt(hn::Abs(q), hn::Set(d, middle_end)), names, places);
    names = hn::Add(names, hn::Set(du, static_cast<std::uint64_t>(lanes)));
  }
  for (std::size_t i = 0; i < places.count; ++i) tails[i] = uniform[places.values[i]];
  std::fill_n(tails + places.count, lanes, 0.0);
  for (std::size_t i = 0; i < places.count; i += lanes) {
    hn::Store(Tail(hn::Load(d, tails + i)), d, tails + i);
  }
  for (std::size_t i = 0; i < places.count; ++i) out[places.values[i]] = tails[i];
}

}  // namespace

void PoissonVariates(std::uint64_t key, std::uint64_t first, const double* means, double* out,
                     std::size_t size) {
  HWY_ALIGN_MAX double block[block_size + most_lanes];
  HWY_ALIGN_MAX double counts[block_size + most_lanes];
  for (std::size_t done = 0; done < size; done += block_size) {
    const std::size_t count = std::min(block_size, size - done);
    std::copy_n(means + done, count, block);
    // Fills the rest of the last vector.
    std::fill_n(block + count, most_lanes, 0.0);
    PoissonBlock(key, first + done, count, block, counts);
    std::copy_n(counts, count, out + done);
  }
}

void NormalVariates(std::uint64_t key, std::uint64_t first, double* out, std::size_t size) {
  HWY_ALIGN_MAX double block[block_size + most_lanes];
  for (std::size_t done = 0; done < size; done += block_size) {
    const std::size_t count = std::min(block_size, size - done);
    NormalBlock(key, first + done, count, block);
    std::copy_n(block, count, out + done);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(PoissonVariates);
HWY_EXPORT(NormalVariates);

void poisson_variates(std::uint64_t key, std::uint64_t first, std::span<const double> means,
                      std::span<double> out) {
  if (means.size() != out.size()) throw std::invalid_argument("Poisson variates: sizes differ");
  HWY_DYNAMIC_DISPATCH(PoissonVariates)(key, first, means.data(), out.data(), out.size());
}

void normal_variates(std::uint64_t key, std::uint64_t first, std::span<double> out) {
  HWY_DYNAMIC_DISPATCH(NormalVariates)(key, first, out.data(), out.size());
}

}  // namespace gamer
#endif
