#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace gamer {

/// The rows of a catalogue that cannot be read. Reading continues after an error, so that one
/// message names all wrong rows.
class RowErrors {
 public:
  /// `label` is the catalogue's, with which its errors begin.
  explicit RowErrors(std::string label) : label_(std::move(label)) {}

  /// Calls read(), and returns whether the row, counted from 0, could be read. Errors that do not
  /// begin with the catalogue's label are thrown on.
  bool is_read(std::size_t row, const std::function<void()>& read);
  /// Throws InputError with the first error and the other rows that have errors, if there are any.
  void refuse() const;

 private:
  std::string label_, first_;
  std::vector<std::size_t> others_;  ///< the first of the other rows with errors, from 1
  std::size_t number_ = 0;
};

}  // namespace gamer
