#include "gamer/core/error.h"

namespace gamer {

std::string SourceLocation::text() const {
  std::string result = file;
  if (line > 0) (result += ":") += std::to_string(line);
  if (line > 0 && column > 0) (result += ":") += std::to_string(column);
  return result;
}

InputError::InputError(const SourceLocation& where, const std::string& message)
    : std::runtime_error(where.file.empty() ? message : where.text() + ": " + message) {}

}  // namespace gamer
