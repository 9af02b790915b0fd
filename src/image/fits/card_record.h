#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/fits/card.h"

namespace gamer {

/// A card that FITS cannot hold, or a record that is no card; the message names it.
class CardError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What non-standard keys begin with.
inline constexpr std::string_view hierarch = "HIERARCH ";

/// FITS headers and character columns hold printing ASCII only, and lose blanks at the end. Every
/// other byte, a last blank, and a '%' that two hexadecimal digits follow, becomes %XX.
std::string percent_encode(std::string_view text);
/// The inverse; every %XX becomes its byte.
std::string percent_decode(std::string_view text);

/// `text` without blanks at its end.
std::string_view trim_right(std::string_view text);

/// The records of a card, at most 80 columns each. A double is written with the fewest digits that
/// read back as the same number; strings are percent-encoded and, where too long, continued
/// (CONTINUE); COMMENT and HISTORY are cut into lines. Throws CardError.
std::vector<std::string> card_records(const Card& card);

/// Whether a record continues the string of the record before.
bool is_continuation(std::string_view record);

/// The name of a record, in capitals and without HIERARCH; "" where it has none.
std::string record_key(std::string_view record);

/// Whether a record describes the data's layout, compression or checksums, and not what they are.
bool is_layout_record(const std::string& record);

/// How many of the records, the first of which begins a card, belong to it.
std::size_t card_length(std::span<const std::string> records);

/// The card of these records, see card_length(). Its key keeps HIERARCH. Numbers beyond our types
/// stay as they are written. Throws CardError.
Card parse_card(std::span<const std::string> records);

}  // namespace gamer
