#include "studio/browser.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "image/removed_on_signal.h"
#include "studio/child_process.h"

namespace gamer {
namespace {

constexpr auto time_to_open = std::chrono::seconds(60);

/// Makes a page that forwards the browser to the address. Returns its path, or "" where it cannot
/// be made.
std::string make_leading_page(const std::string& address) {
  const std::string suffix = ".html";
  std::error_code error;
  std::string path =
      (std::filesystem::temp_directory_path(error) / ("gstudio-XXXXXX" + suffix)).string();
  const int file = mkstemps(path.data(), static_cast<int>(suffix.size()));
  if (file < 0) return "";
  const std::string page = fmt::format(
      "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url={}\"><title>gstudio</title>\n",
      address);
  const bool is_written =
      write(file, page.data(), page.size()) == static_cast<ssize_t>(page.size());
  close(file);
  return is_written ? path : "";
}

}  // namespace

void open_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string path = make_leading_page(address);
  if (path.empty()) return;
  std::thread([page = std::move(path)] {
    const RemovedOnSignal removed(page);
    try {
      run_child(
          {"xdg-open", page}, [](pid_t) {}, [](const std::string&) {});
      std::this_thread::sleep_for(time_to_open);
    } catch (const std::exception&) {
      // The address is printed, too.
    }
    std::error_code error;
    std::filesystem::remove(page, error);
  }).detach();
}

}  // namespace gamer
