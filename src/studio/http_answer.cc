#include "studio/http_answer.h"

#include <fmt/format.h>

#include <algorithm>

#include "studio/output_folder.h"
#include "studio/page_files.h"

namespace gamer {
namespace {

constexpr unsigned bad_request = 400, forbidden = 403, not_found = 404, wrong_method = 405;

HttpAnswer refuse(unsigned status, std::string reason) {
  return {.status = status, .body = std::move(reason) + "\n"};
}

/// The type of a file's content, by its suffix.
std::string type_of(std::string_view name) {
  const std::string_view suffix = name.substr(std::min(name.rfind('.'), name.size()));
  constexpr std::pair<std::string_view, const char*> types[] = {
      {".html", "text/html; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".bmp", "image/bmp"},
      {".fits", "application/fits"}};
  for (const auto& [known, type] : types) {
    if (suffix == known) return type;
  }
  return "text/plain; charset=utf-8";
}

/// The answer to the right token: the cookie, and a page of this site that forwards to the Studio.
/// Browsers send no strict cookie with a request that another site began.
HttpAnswer welcome(const ServerSecrets& secrets) {
  return {.type = "text/html; charset=utf-8",
          .body =
              "<!doctype html><meta http-equiv=\"refresh\" "
              "content=\"0;url=/\"><title>gstudio</title>\n",
          .fields = {{"Set-Cookie", fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/",
                                                secrets.cookie_name, secrets.cookie)}}};
}

HttpAnswer page_file(std::string_view name) {
  for (const PageFile& file : page_files()) {
    if (file.name != name) continue;
    return {.type = type_of(name), .body = std::string(file.content)};
  }
  return refuse(not_found, "there is no such file");
}

HttpAnswer output_file(std::string_view name, const std::filesystem::path& folder) {
  const auto path = OutputFolder(folder).find(name);
  if (!path) return refuse(not_found, "there is no such file");
  return {.type = type_of(name),
          .file = *path,
          .fields = {{"Content-Disposition", fmt::format("attachment; filename=\"{}\"", name)}}};
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& safety_fields() {
  static const std::vector<std::pair<std::string, std::string>> fields = {
      {"Content-Security-Policy",
       "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
       "connect-src 'self'; media-src 'self' blob:; worker-src 'self'; manifest-src 'self'; "
       "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
      {"X-Content-Type-Options", "nosniff"},
      {"X-Frame-Options", "DENY"},
      {"Cache-Control", "no-store"},
      {"Referrer-Policy", "no-referrer"},
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Cross-Origin-Resource-Policy", "same-origin"}};
  return fields;
}

HttpAnswer answer_request(const HttpRequest& request, const ServerSecrets& secrets,
                          const std::filesystem::path& folder) {
  if (!request.host) return refuse(bad_request, "a request needs one Host");
  if (!is_own_host(*request.host)) {
    return refuse(forbidden, "this server is called 127.0.0.1 or localhost");
  }
  if (request.origin && !is_own_origin(*request.origin, *request.host)) {
    return refuse(forbidden, "another site's page may not use this server");
  }
  if (request.method != "GET" && request.method != "HEAD") {
    return refuse(wrong_method, "this server takes GET and HEAD");
  }
  const Target target = parse_target(request.target);
  if (target.path == "/" && target.token) {
    if (are_equal_secrets(*target.token, secrets.token)) return welcome(secrets);
    return refuse(forbidden, "this is not the token that gstudio printed at its start");
  }
  const auto cookie = cookie_value(request.cookie.value_or(""), secrets.cookie_name);
  if (!cookie || !are_equal_secrets(*cookie, secrets.cookie)) {
    return refuse(forbidden, "open the address that gstudio printed at its start");
  }
  if (target.path == "/ws") {
    if (!request.is_upgrade) return refuse(bad_request, "this is the place of the WebSocket");
    if (!request.origin) return refuse(forbidden, "a WebSocket needs an Origin");
    return {.is_upgrade = true};
  }
  constexpr std::string_view outputs = "/output/";
  if (target.path.starts_with(outputs)) {
    return output_file(target.path.substr(outputs.size()), folder);
  }
  if (target.path == "/") return page_file("index.html");
  return page_file(target.path.substr(std::min<std::size_t>(1, target.path.size())));
}

}  // namespace gamer
