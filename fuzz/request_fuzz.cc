// Fuzzes requests to the studio: target, Host, Origin and Cookie with a NUL between them. Without
// the secrets a request gets nothing.

#include <cstdint>
#include <string_view>

#include "expectations.h"
#include "studio/http_answer.h"

namespace {

std::string_view take(std::string_view& text) {
  const std::size_t end = text.find('\0');
  const std::string_view part = text.substr(0, end);
  text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  return part;
}

void read(std::string_view text) {
  gamer::HttpRequest request;
  request.method = "GET";
  request.target = take(text);
  request.host = take(text);
  if (const std::string_view origin = take(text); !origin.empty()) request.origin = origin;
  request.cookie = take(text);
  request.is_upgrade = !text.empty();
  const gamer::ServerSecrets secrets{"12345678901234567890123456789012", "cookie", "gstudio-1"};
  const gamer::HttpAnswer answer = gamer::answer_request(request, secrets, "/nonexistent");
  const bool knows = text.find(secrets.token) != text.npos ||
                     request.target.find(secrets.token) != text.npos ||
                     request.cookie->find("gstudio-1=cookie") != text.npos;
  expect(knows || (answer.status >= 400 && !answer.is_upgrade && answer.fields.empty()),
         "strangers are refused");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  expect_errors_only([&] { read({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
