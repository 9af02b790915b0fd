#pragma once

#include <gtest/gtest.h>

#include "gamer/core/simd.h"

namespace gamer {

/// Runs `action` under every instruction set of this machine, the scalar one included.
template <typename Action>
void for_each_simd_target(Action&& action) {
  for (const std::int64_t target : simd_targets()) {
    SCOPED_TRACE(simd_target_name(target));
    use_simd_targets(target);
    action();
    use_simd_targets(0);
  }
}

}  // namespace gamer
