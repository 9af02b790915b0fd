#include "image/fits/card_record.h"

#include <fitsio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/text.h"
#include "gamer/core/capitals.h"

namespace gamer {
namespace {

constexpr std::string_view continue_card = "CONTINUE  ";

int hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

bool is_escape(std::string_view text, std::size_t i) {
  return i + 2 < text.size() && text[i] == '%' && hexadecimal_digit(text[i + 1]) >= 0 &&
         hexadecimal_digit(text[i + 2]) >= 0;
}

/// The text between the quotes of a card's string value.
std::string unquote(std::string_view value) {
  std::string text;
  if (!value.empty() && value.front() == '\'') value.remove_prefix(1);
  if (!value.empty() && value.back() == '\'') value.remove_suffix(1);
  for (std::size_t i = 0; i < value.size(); ++i) {
    text += value[i];
    if (value[i] == '\'' && i + 1 < value.size() && value[i + 1] == '\'') ++i;
  }
  return text;
}

/// False unless the whole text is a number of this type.
template <class Number>
std::optional<Number> parse_number(std::string text) {
  std::ranges::replace(text, 'D', 'E');
  return number_of<Number>(without_plus(text));
}

/// The part of a card before its value.
std::string card_prefix(const std::string& key) {
  if (key.find_first_of("=/'") != std::string::npos || percent_encode(key) != key) {
    throw CardError(fmt::format("'{}' cannot name a FITS card", key));
  }
  if (key.starts_with(hierarch)) return key + " = ";
  if (key.size() > keyword_width) return fmt::format("{}{} = ", hierarch, key);
  return fmt::format("{:<{}}= ", key, keyword_width);
}

/// A string value in quotes, cut into pieces for the first card and for further ones. All pieces
/// but the last end in '&'.
std::vector<std::string> quoted_pieces(std::string_view text, std::size_t first_room,
                                       std::size_t next_room) {
  std::vector<std::string> pieces;
  std::string piece;
  std::size_t room = first_room;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view character = text[i] == '\'' ? "''" : text.substr(i, 1);
    const bool last = i + 1 == text.size();
    if (piece.size() + character.size() + (last ? 0 : 1) > room) {
      pieces.push_back(fmt::format("'{}&'", piece));
      piece.clear();
      room = next_room;
    }
    piece += character;
  }
  pieces.push_back(fmt::format("'{}'", piece));
  return pieces;
}

/// Records of a COMMENT or HISTORY card.
std::vector<std::string> line_records(const Card& card) {
  constexpr std::size_t line = record_width - keyword_width;
  const std::string text = percent_encode(card.comment);
  std::vector<std::string> records;
  for (std::size_t first = 0; first == 0 || first < text.size(); first += line) {
    records.push_back(fmt::format("{:<{}}{}", card.key, keyword_width, text.substr(first, line)));
  }
  return records;
}

struct ParsedCard {
  std::string value, comment;
};

ParsedCard parse_record(const std::string& record) {
  char value[FLEN_VALUE] = {}, comment[FLEN_COMMENT] = {};
  int status = 0;
  fits_parse_value(const_cast<char*>(record.c_str()), value, comment, &status);
  if (status != 0) {
    fits_clear_errmsg();
    throw CardError(fmt::format("cannot read the card '{}'", trim_right(record)));
  }
  return {value, comment};
}

bool is_line(std::string_view key) { return key == "COMMENT" || key == "HISTORY"; }

}  // namespace

std::string fits_number(double value) {
  std::string text = fmt::format("{}", value);
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos) {
    text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  }
  std::ranges::replace(text, 'e', 'E');
  return text;
}

std::string_view trim_right(std::string_view text) {
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

std::string percent_encode(std::string_view text) {
  std::string encoded;
  encoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool last_blank = text[i] == ' ' && i + 1 == text.size();
    if (text[i] < ' ' || text[i] > '~' || last_blank || is_escape(text, i)) {
      encoded += fmt::format("%{:02X}", static_cast<unsigned char>(text[i]));
    } else {
      encoded += text[i];
    }
  }
  return encoded;
}

std::string percent_decode(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_escape(text, i)) {
      decoded +=
          static_cast<char>(hexadecimal_digit(text[i + 1]) * 16 + hexadecimal_digit(text[i + 2]));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

// Records are made here, since CFITSIO's functions (4.2) for long names and strings overflow their
// buffers. They do so where a string has many quotes or a name is too long.
std::vector<std::string> card_records(const Card& card) {
  if (std::holds_alternative<std::monostate>(card.value) && is_line(card.key)) {
    return line_records(card);
  }
  const std::string comment = percent_encode(card.comment);
  constexpr std::size_t two_quotes = 2;
  /// Column where numbers of standard cards end.
  constexpr std::size_t number_width = 20;
  const std::string prefix = card_prefix(card.key);
  std::vector<std::string> values;
  if (const auto* text = std::get_if<std::string>(&card.value)) {
    // The first card must have room for one (quoted) character and the '&'.
    constexpr std::size_t least_room = 3;
    if (prefix.size() + two_quotes + least_room > record_width) {
      throw CardError(fmt::format("card {}: the name is too long for a FITS header", card.key));
    }
    values = quoted_pieces(percent_encode(*text), record_width - prefix.size() - two_quotes,
                           record_width - continue_card.size() - two_quotes);
  } else {
    std::string value;
    if (const auto* flag = std::get_if<bool>(&card.value)) {
      value = *flag ? "T" : "F";
    } else if (const auto* integer = std::get_if<long long>(&card.value)) {
      value = fmt::format("{}", *integer);
    } else if (const auto* number = std::get_if<double>(&card.value)) {
      if (!std::isfinite(*number)) {
        throw CardError(fmt::format("card {}: FITS headers cannot hold {}", card.key, *number));
      }
      value = fits_number(*number);
    }
    const bool standard = !prefix.starts_with(hierarch);
    values = {standard ? fmt::format("{:>{}}", value, number_width) : value};
    if (prefix.size() + values[0].size() > record_width) {
      throw CardError(fmt::format("card {}: the name is too long for a FITS header", card.key));
    }
  }
  std::vector<std::string> records;
  for (const std::string& value : values) {
    records.push_back((records.empty() ? prefix : std::string(continue_card)) + value);
  }
  if (!comment.empty()) records.back() = (records.back() + " / " + comment).substr(0, record_width);
  return records;
}

bool is_continuation(std::string_view record) { return record.starts_with(continue_card); }

std::string record_key(std::string_view record) {
  char name[FLEN_KEYWORD] = {};
  int length = 0, status = 0;
  std::string copy(record.substr(0, record_width));
  fits_get_keyname(copy.data(), name, &length, &status);
  if (status != 0) {
    fits_clear_errmsg();
    return {};
  }
  return in_capitals(name);
}

std::size_t card_length(std::span<const std::string> records) {
  std::size_t length = 1;
  while (length < records.size() && is_continuation(records[length])) ++length;
  return length;
}

bool is_layout_record(const std::string& record) {
  constexpr std::array layout_classes = {TYP_STRUC_KEY, TYP_CMPRS_KEY, TYP_SCAL_KEY,
                                         TYP_NULL_KEY,  TYP_DIM_KEY,   TYP_CKSUM_KEY};
  constexpr std::array<std::string_view, 4> layout_keys = {"ZHECKSUM", "ZDATASUM", "ZQUANTIZ",
                                                           "LONGSTRN"};
  std::string copy = record;
  const int card_class = fits_get_keyclass(copy.data());
  return std::ranges::find(layout_classes, card_class) != layout_classes.end() ||
         std::ranges::find(layout_keys, record_key(record)) != layout_keys.end();
}

Card parse_card(std::span<const std::string> records) {
  const std::string& record = records.front();
  Card card;
  card.key = record_key(record);
  if (is_line(card.key)) {
    card.comment = percent_decode(
        trim_right(std::string_view(record).substr(std::min(record.size(), keyword_width))));
    return card;
  }
  if (record.starts_with(hierarch)) card.key.insert(0, hierarch);
  ParsedCard parsed = parse_record(record);
  char type = 'U';
  if (!parsed.value.empty()) {
    int status = 0;
    fits_get_keytype(parsed.value.c_str(), &type, &status);
    if (status != 0) {
      fits_clear_errmsg();
      throw CardError(fmt::format("cannot read the card '{}'", trim_right(record)));
    }
  }
  switch (type) {
    case 'U': break;
    case 'L': card.value = parsed.value == "T"; break;
    case 'I':
      if (const auto integer = parse_number<long long>(parsed.value)) {
        card.value = *integer;
        break;
      }
      [[fallthrough]];
    case 'F':
      if (const auto real = parse_number<double>(parsed.value)) {
        card.value = *real;
      } else {
        card.value = parsed.value;
      }
      break;
    case 'C': {
      std::string text = unquote(parsed.value);
      for (std::size_t i = 1; i < records.size() && !text.empty() && text.back() == '&'; ++i) {
        std::string next = records[i];
        // CFITSIO's parser looks for '=', which continuations lack.
        next.replace(0, continue_card.size(), "CONTINU = ");
        const ParsedCard more = parse_record(next);
        text.pop_back();
        text += unquote(more.value);
        parsed.comment += more.comment;
      }
      card.value = percent_decode(trim_right(text));
      break;
    }
    default: card.value = parsed.value;
  }
  card.comment = percent_decode(trim_right(parsed.comment));
  return card;
}

}  // namespace gamer
