#pragma once

#include <cmath>
#include <cstdint>
#include <span>

namespace gamer {

/// Random numbers of given distributions. Number i of a stream is a function of the stream's key
/// and i alone, so that any thread may make any part. The number is made from w = mix64(key + (i +
/// 1) golden_gamma), output i of splitmix64 in the state `key`. Where one word is not enough,
/// mix64(w + golden_gamma) follows, and so on. Bits are equal on every SIMD target. Keys come from
/// hash_words().

/// Poisson variates with means[i], number first + i of the stream; `means` and `out` may be one
/// array. A negative mean counts as 0; NaN and means above 1e100 are copied to `out`. Throws
/// std::invalid_argument if the sizes of the arrays differ.
///
/// The distribution is exact but for the rounding of doubles. Means below 10 use inversion, where a
/// probability errs by at most 2^-52. Larger means use transformed rejection (PTRS: Hoermann 1993,
/// Insurance: Mathematics and Economics 12, 39) with the probabilities of Loader 2000 ("Fast and
/// accurate computation of binomial probabilities").
void poisson_variates(std::uint64_t key, std::uint64_t first, std::span<const double> means,
                      std::span<double> out);

/// Normal variates of mean 0 and sigma 1, number first + i of the stream. They are the inverse of
/// the normal distribution (Wichura 1988, AS 241, relative error 1e-15) at uniform numbers of 52
/// bits. No absolute value exceeds 8.2.
void normal_variates(std::uint64_t key, std::uint64_t first, std::span<double> out);

/// The x in [0, 1] below which the share u of the density e^(a x) lies.
inline double exponential_quantile(double a, double u) {
  return std::abs(a) < 1e-9 ? u : std::log1p(u * std::expm1(a)) / a;
}

}  // namespace gamer
