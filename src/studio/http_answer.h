#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "studio/access.h"

namespace gamer {

/// The fields of a request that the server reads. Missing and repeated fields have no value.
struct HttpRequest {
  std::string_view method;
  std::string_view target;
  std::optional<std::string_view> host, origin, cookie;
  bool is_upgrade = false;  ///< to a WebSocket
};

struct HttpAnswer {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body = {};
  std::filesystem::path file = {};  ///< instead of a body
  std::vector<std::pair<std::string, std::string>> fields = {};
  bool is_upgrade = false;  ///< the WebSocket may begin
};

/// Answers a request for a file of the page or of the outputs, if the sender may see it. `folder`
/// is that of the outputs.
HttpAnswer answer_request(const HttpRequest& request, const ServerSecrets& secrets,
                          const std::filesystem::path& folder);

/// The header fields of every answer.
const std::vector<std::pair<std::string, std::string>>& safety_fields();

}  // namespace gamer
