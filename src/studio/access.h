#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace gamer {

// Checks of who may talk to the server. All functions accept any bytes that a stranger may send.

/// 128 random bits of the operating system as 32 hexadecimal digits. Throws RunError.
std::string make_token();

struct ServerSecrets {
  std::string token;   ///< secret in the server's address
  std::string cookie;  ///< secret that a browser gets in exchange for the token
  /// Name of the cookie. Browsers give a host's cookies to all its ports, so that servers need
  /// names of their own.
  std::string cookie_name;
};

/// Secrets with a new cookie and token. If `file` is given, the secrets are those that it holds; a
/// missing file is made. Throws RunError, and InputError for a file that others may read or that
/// holds something else.
ServerSecrets make_secrets(const std::filesystem::path& file);

/// Whether two texts are equal, in a time that depends on their lengths alone.
bool are_equal_secrets(std::string_view a, std::string_view b);

/// Whether the value of a Host header names this machine: 127.0.0.1 or localhost. Any port is
/// right, since a tunnel has a port of its own. Another name may belong to a stranger's domain that
/// leads here (DNS rebinding).
bool is_own_host(std::string_view host);

/// Whether the value of an Origin header is that of a page served by this host.
bool is_own_origin(std::string_view origin, std::string_view host);

/// The value of a cookie in a Cookie header; nothing without this cookie.
std::optional<std::string_view> cookie_value(std::string_view header, std::string_view name);

/// The path of a request's target, and the value of `token` in its query.
struct Target {
  std::string_view path;
  std::optional<std::string_view> token;
};
Target parse_target(std::string_view target);

}  // namespace gamer
