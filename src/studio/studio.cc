#include "gamer/studio/studio.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>
#include <thread>

#include "studio/server.h"
#include "studio/studio_core.h"

extern char** environ;

namespace gamer {
namespace {

/// Opens a browser where there is a display; nothing happens where there is no xdg-open.
void open_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open", argument = address;
  char* const words[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  if (posix_spawnp(&child, program.c_str(), nullptr, nullptr, words, environ) != 0) return;
  std::thread([child] { waitpid(child, nullptr, 0); }).detach();
}

}  // namespace

void run_studio(const StudioOptions& options, const std::function<void(const std::string&)>& say) {
  StudioCore core(options);
  Server server(core, options.port);
  say(server.address());
  if (options.opens_browser) open_browser(server.address());
  server.run();
}

}  // namespace gamer
