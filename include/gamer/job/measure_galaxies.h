#pragma once

#include <memory>
#include <span>

#include "gamer/galaxy/calibration/calibration_memory.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/parallel/ranks.h"

namespace gamer {

/// Measures galaxies with all ranks. Every rank calls this function with equal galaxies and ranges
/// of footprints, one for each galaxy. Without ranges all footprints are measured.
///
/// Results that `memory` holds are not measured again; only a process without other ranks may give
/// a memory. On rank 0 results also come from calibration_cache(). The cache then takes the new
/// results of references, and of all galaxies if these are few.
void measure_galaxies(std::span<const std::shared_ptr<Galaxy>> galaxies,
                      std::span<const FootprintRange> footprints, const Ranks& ranks,
                      CalibrationMemory* memory = nullptr);

}  // namespace gamer
