#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gamer {

/// Instruction sets that the kernels are compiled for and this machine has, one bit each, best
/// first; the last is the scalar one.
std::vector<std::int64_t> simd_targets();

/// Name of a target: "AVX3", "AVX2", "SSE4", "SCALAR"...
std::string simd_target_name(std::int64_t target);

/// Mask of all targets of this machine. Ranks compare their masks to agree on a common target.
std::int64_t supported_simd_targets();

/// Restricts the kernels to the best target within `mask`; 0 lifts the restriction. No kernel may
/// run during this call.
void use_simd_targets(std::int64_t mask);

/// The target in use.
std::int64_t current_simd_target();

}  // namespace gamer
