#pragma once

#include <cstddef>

namespace gamer {

/// Multiplications and additions of single precision in one call of work_at_peak().
std::size_t peak_operations();

/// Multiply-adds that wait neither for memory nor for each other, with the vectors of the SIMD
/// target in use. No core does more per second. The result only keeps compilers from removing the
/// work.
float work_at_peak();

}  // namespace gamer
