#include "gamer/studio/studio.h"

#include <malloc.h>

#include "gamer/job/calibration_cache.h"
#include "studio/browser.h"
#include "studio/server.h"
#include "studio/studio_core.h"

namespace gamer {
namespace {

/// Uses one heap, and places large blocks outside it. Otherwise the small measurements of galaxies,
/// which stay, would spread over the heaps of all threads, whose pages could not be given back.
void keep_heap_compact() {
#ifdef __GLIBC__
  constexpr int large_block = 256 << 10;
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, large_block);
#endif
}

}  // namespace

void run_studio(const StudioOptions& options, const std::function<void(const std::string&)>& say) {
  keep_heap_compact();
  use_calibration_cache(CalibrationCache::of_user());
  Server server(options);
  StudioCore core(options);
  say(server.address());
  if (options.opens_browser) open_browser(server.address());
  server.run(core);
}

}  // namespace gamer
