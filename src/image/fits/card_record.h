#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/fits/card.h"

namespace gamer {

/// A card that FITS cannot hold, or a record that is not a card; the message names it.
class CardError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Widths of a record and of its keyword, columns.
inline constexpr std::size_t record_width = 80, keyword_width = 8;
/// The beginning of records with non-standard keys.
inline constexpr std::string_view hierarch = "HIERARCH ";

/// Encodes a text for FITS headers and character columns, which hold only printing ASCII and lose
/// trailing blanks. Other bytes, a last blank, and a '%' before two hexadecimal digits become %XX.
std::string percent_encode(std::string_view text);
/// The inverse; every %XX becomes its byte.
std::string percent_decode(std::string_view text);

/// The number with the fewest digits that read back to it. It has the point that FITS and YAML
/// require in floating-point numbers, and the capital E of FITS.
std::string fits_number(double value);

/// `text` without blanks at its end.
std::string_view trim_right(std::string_view text);

/// The records of a card, at most 80 columns each. A double has the fewest digits that read back to
/// it. Strings are percent-encoded and continued (CONTINUE) if too long; COMMENT and HISTORY are
/// cut into lines. Throws CardError.
std::vector<std::string> card_records(const Card& card);

/// Whether a record continues the string of the record before.
bool is_continuation(std::string_view record);

/// The key of a record, in capitals and without HIERARCH; "" for none.
std::string record_key(std::string_view record);

/// Whether a record describes the layout, compression or checksums of the data, not their meaning.
bool is_layout_record(const std::string& record);

/// Number of records in the card that begins the records.
std::size_t card_length(std::span<const std::string> records);

/// The card of these records, see card_length(). Its key keeps HIERARCH. Numbers beyond the range
/// of Card's types stay texts. Throws CardError.
Card parse_card(std::span<const std::string> records);

}  // namespace gamer
