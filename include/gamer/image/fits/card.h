#pragma once

#include <string>
#include <variant>

namespace gamer {

/// One header card. A card without value (monostate) is a COMMENT or HISTORY card, as `key` says.
struct Card {
  std::string key;  ///< a standard keyword, or "HIERARCH GAMER ..." words
  std::variant<std::monostate, bool, long long, double, std::string> value;
  std::string comment;
};

}  // namespace gamer
