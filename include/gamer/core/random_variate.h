#pragma once

#include <cstdint>
#include <span>

namespace gamer {

/// Random numbers of given distributions. Number i of a stream is a function of the stream's key
/// and i alone, so that any thread may make any part of it: it grows from
/// w = mix64(key + (i + 1) golden_gamma), splitmix64's output i from the state `key`, and where one
/// word does not do from mix64(w + golden_gamma) and so on. Bits are the same on every SIMD target.
/// Keys come from hash_words().

/// Poisson variates of the means[i], number first + i of the stream; `means` and `out` may be the
/// same array. A negative mean counts as 0; NaN and means above 1e100 come back as they are.
///
/// Exact in distribution but for the rounding of doubles: below 10 by inversion, where a
/// probability errs by 2^-52 at most; from 10 on by transformed rejection (PTRS: Hoermann 1993,
/// Insurance: Mathematics and Economics 12, 39) with the probabilities of Loader 2000 ("Fast and
/// accurate computation of binomial probabilities").
void poisson_variates(std::uint64_t key, std::uint64_t first, std::span<const double> means,
                      std::span<double> out);

/// Normal variates of mean 0 and sigma 1, number first + i of the stream: the inverse of the
/// normal distribution (Wichura 1988, AS 241, relative error 1e-15) at uniform numbers of 52 bits;
/// none is beyond 8.2.
void normal_variates(std::uint64_t key, std::uint64_t first, std::span<double> out);

}  // namespace gamer
