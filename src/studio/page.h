#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace gamer {

/// An error message about the message `id`, or about a message without a number.
nlohmann::json error_message(std::optional<std::int64_t> id, const std::string& message);

/// A page that is connected. Any thread may call its functions; messages to a page that has gone
/// are lost.
class Page {
 public:
  virtual ~Page() = default;
  virtual void send(std::string message, bool is_binary) = 0;
  /// Forgets frames that wait to be sent; they belong to views that are no longer wanted.
  virtual void drop_frames() {}

  void reply(const nlohmann::json& message);
  void fail(std::optional<std::int64_t> id, const std::string& message);
};

}  // namespace gamer
