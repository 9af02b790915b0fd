#include "studio/access.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>

#include "core/message.h"

namespace gamer {
namespace {

constexpr std::size_t most_port_digits = 5;

/// Returns the part of the text before the separator, and removes both from the text.
std::string_view take_until(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view taken = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return taken;
}

constexpr std::size_t token_digits = 32;
constexpr std::size_t secrets_bytes = 2 * (token_digits + 1);

bool is_token(std::string_view text) {
  return text.size() == token_digits && std::ranges::all_of(text, [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

/// An open file, which the destructor closes.
class OpenFile {
 public:
  explicit OpenFile(int number) : number_(number) {}
  ~OpenFile() {
    if (number_ >= 0) close(number_);
  }
  OpenFile& operator=(OpenFile&&) = delete;
  int number() const { return number_; }
  bool is_open() const { return number_ >= 0; }

 private:
  int number_;
};

ServerSecrets read_secrets(const std::filesystem::path& path) {
  const OpenFile file(open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file.is_open() || fstat(file.number(), &status) != 0 || !S_ISREG(status.st_mode)) {
    throw input_error("'{}' is no file that can be read", path.string());
  }
  if (status.st_uid != geteuid() || (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw input_error("'{}': others may read it; chmod 600 it", path.string());
  }
  std::array<char, secrets_bytes + 1> bytes{};
  const ssize_t count = read(file.number(), bytes.data(), bytes.size());
  const std::string_view text(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  const std::string_view token = text.substr(0, std::min(token_digits, text.size()));
  const std::string_view cookie =
      text.size() == secrets_bytes ? text.substr(token_digits + 1, token_digits) : "";
  if (!is_token(token) || !is_token(cookie)) {
    throw input_error("'{}' holds no secrets of gstudio", path.string());
  }
  return {std::string(token), std::string(cookie), {}};
}

}  // namespace

ServerSecrets make_secrets(const std::filesystem::path& path) {
  const ServerSecrets secrets{make_token(), make_token(), {}};
  if (path.empty()) return secrets;
  const OpenFile file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (!file.is_open() && errno == EEXIST) return read_secrets(path);
  const std::string text = secrets.token + "\n" + secrets.cookie + "\n";
  if (!file.is_open() ||
      write(file.number(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw run_error("'{}' cannot be written", path.string());
  }
  return secrets;
}

std::string make_token() {
  std::array<unsigned char, 16> bytes{};
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const auto count = getrandom(bytes.data() + filled, bytes.size() - filled, 0);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw RunError("gstudio: the system gives no random numbers");
    filled += static_cast<std::size_t>(count);
  }
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

bool are_equal_secrets(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  // A volatile sum keeps the compiler from leaving the loop early.
  volatile unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference = static_cast<unsigned char>(
        difference | (static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i])));
  }
  return difference == 0;
}

bool is_own_host(std::string_view host) {
  const std::string_view name = host.substr(0, host.find(':'));
  if (name != "127.0.0.1" && name != "localhost") return false;
  if (name.size() == host.size()) return true;
  const std::string_view port = host.substr(name.size() + 1);
  return !port.empty() && port.size() <= most_port_digits &&
         std::ranges::all_of(port, [](char c) { return c >= '0' && c <= '9'; });
}

bool is_own_origin(std::string_view origin, std::string_view host) {
  constexpr std::string_view scheme = "http://";
  return origin.starts_with(scheme) && origin.substr(scheme.size()) == host;
}

std::optional<std::string_view> cookie_value(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    std::string_view cookie = take_until(header, ';');
    while (cookie.starts_with(' ')) cookie.remove_prefix(1);
    if (take_until(cookie, '=') == name) return cookie;
  }
  return std::nullopt;
}

Target parse_target(std::string_view target) {
  Target result;
  result.path = take_until(target, '?');
  while (!target.empty()) {
    std::string_view part = take_until(target, '&');
    if (take_until(part, '=') == "token") result.token = part;
  }
  return result;
}

}  // namespace gamer
