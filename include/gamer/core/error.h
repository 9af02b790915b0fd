#pragma once

#include <stdexcept>
#include <string>

namespace gamer {

/// A place in a text that a user wrote. Lines and columns count from 1; 0 means unknown.
struct SourceLocation {
  std::string file;
  int line = 0;
  int column = 0;

  /// "file:line:column", without the parts that are unknown.
  std::string text() const;
};

/// Wrong input or usage, which the user can correct. Programs end with exit code 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
  /// The message becomes "file:line:column: message".
  InputError(const SourceLocation& where, const std::string& message);
};

/// A failure while running (disk full, a lost rank). Programs end with exit code 1.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace gamer
