#include "gamer/studio/studio.h"

#include "studio/browser.h"
#include "studio/server.h"
#include "studio/studio_core.h"

namespace gamer {

void run_studio(const StudioOptions& options, const std::function<void(const std::string&)>& say) {
  Server server(options);
  StudioCore core(options);
  say(server.address());
  if (options.opens_browser) open_browser(server.address());
  server.run(core);
}

}  // namespace gamer
