#include "studio/page.h"

#include "studio/message.h"

namespace gamer {

void Page::reply(const nlohmann::json& message) { send(json_text(message), false); }

nlohmann::json error_message(std::optional<std::int64_t> id, const std::string& message) {
  nlohmann::json error = {{"op", "error"}, {"id", nullptr}, {"message", message}};
  if (id) error["id"] = *id;
  return error;
}

void Page::fail(std::optional<std::int64_t> id, const std::string& message) {
  reply(error_message(id, message));
}

}  // namespace gamer
