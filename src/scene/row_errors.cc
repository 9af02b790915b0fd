#include "scene/row_errors.h"

#include <fmt/ranges.h>

#include <string_view>

#include "core/message.h"

namespace gamer {
namespace {

constexpr std::size_t most_rows = 5;

}  // namespace

bool RowErrors::is_read(std::size_t row, const std::function<void()>& read) {
  try {
    read();
    return true;
  } catch (const InputError& error) {
    // An error in a galaxy's file concerns all its rows.
    if (!std::string_view(error.what()).starts_with(label_)) throw;
    if (number_++ == 0) {
      first_ = error.what();
    } else if (others_.size() < most_rows) {
      others_.push_back(row + 1);
    }
    return false;
  }
}

void RowErrors::refuse() const {
  if (number_ == 0) return;
  if (others_.empty()) throw InputError(first_);
  const std::size_t more = number_ - 1 - others_.size();
  throw input_error("{}; wrong too {} row{} {}{}", first_, others_.size() == 1 ? "is" : "are",
                    others_.size() == 1 ? "" : "s", fmt::join(others_, ", "),
                    more > 0 ? fmt::format(" and {} more", more) : "");
}

}  // namespace gamer
