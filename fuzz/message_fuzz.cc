// Fuzzes messages of the studio's page with any text, and applies the edits that they ask for.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "expectations.h"
#include "gamer/core/config.h"
#include "studio/galaxy_text.h"
#include "studio/message.h"

namespace {

void read(std::string_view text) {
  const gamer::Message message = gamer::parse_message(text);
  if (const auto* scene = std::get_if<gamer::EditSceneRequest>(&message.request)) {
    const std::string edited = gamer::edit_scene(scene->text, scene->edits, "x.lst");
    gamer::edit_scene(edited, {}, "x.lst");
    return;
  }
  const auto* request = std::get_if<gamer::EditRequest>(&message.request);
  if (request == nullptr) return;
  const std::string edited = gamer::edit_text(request->text, request->edits, "x.toml");
  gamer::parse_toml(edited, "x.toml");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  expect_errors_only([&] { read({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
