#pragma once

/// The library's front door. A program reads or builds a scene, renders it into memory, and writes
/// files, with these headers alone.

#include "gamer/core/cancellation.h"  // IWYU pragma: export
#include "gamer/core/error.h"         // IWYU pragma: export
#include "gamer/core/version.h"       // IWYU pragma: export
#include "gamer/image/data_table.h"   // IWYU pragma: export
#include "gamer/image/image.h"        // IWYU pragma: export
#include "gamer/image/picture.h"      // IWYU pragma: export
#include "gamer/job/job.h"            // IWYU pragma: export
#include "gamer/job/session.h"        // IWYU pragma: export
#include "gamer/parallel/executor.h"  // IWYU pragma: export
