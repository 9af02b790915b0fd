#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gamer {

/// The instruction sets that the kernels are compiled for and this machine has, best first; the
/// last is the scalar one. One bit each.
std::vector<std::int64_t> simd_targets();

/// "AVX3", "AVX2", "SSE4", "SCALAR"...
std::string simd_target_name(std::int64_t target);

/// All targets of this machine as one mask: what ranks compare to agree on a common one.
std::int64_t supported_simd_targets();

/// Restricts the kernels to the best target within `mask`; 0 lifts the restriction. Not while
/// kernels run.
void use_simd_targets(std::int64_t mask);

/// The target in use.
std::int64_t current_simd_target();

}  // namespace gamer
