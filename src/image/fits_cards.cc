#include "image/fits_cards.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "image/fits_number.h"

namespace gamer {
namespace {

constexpr std::string_view kHierarch = "HIERARCH ";
/// Columns that a card's keyword takes.
constexpr std::size_t kKeywordWidth = 8;
constexpr std::string_view kContinue = "CONTINUE  ";
/// First column of a text table: the number of the line that the other columns hold.
constexpr const char* kLineColumn = "LINE";
/// The number there where a row goes on with the line above.
constexpr int kContinuedLine = 0;
/// Longer lines are cut into pieces of so many bytes, so that columns stay narrow: CFITSIO takes
/// none wider than 28799.
constexpr std::size_t kLongestPiece = 200;

bool is_printing(char c) { return c >= ' ' && c <= '~'; }

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

std::string_view trim_right(std::string_view text) {
  const std::size_t last = text.find_last_not_of(' ');
  return text.substr(0, last == std::string_view::npos ? 0 : last + 1);
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

/// False where the text is not wholly a number of this type.
template <class Number>
bool parse_number(std::string text, Number& number) {
  std::replace(text.begin(), text.end(), 'D', 'E');
  const char* first = text.data() + (!text.empty() && text[0] == '+' ? 1 : 0);
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(first, last, number);
  return error == std::errc() && end == last;
}

/// Everything of a card before its value.
std::string card_prefix(FitsFile& file, const std::string& key) {
  if (key.find_first_of("=/'") != std::string::npos || percent_encode(key) != key) {
    file.fail(fmt::format("'{}' cannot name a FITS card", key));
  }
  if (key.starts_with(kHierarch)) return key + " = ";
  if (key.size() > kKeywordWidth) return fmt::format("{}{} = ", kHierarch, key);
  return fmt::format("{:<{}}= ", key, kKeywordWidth);
}

/// A string value in quotes, cut into pieces that fit the room of the first card and of each
/// further one; all but the last end in '&'.
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

/// The 80-column records of a card. CFITSIO's own functions for long names and long strings write
/// beyond their buffers where the string has many quotes or the name is too long (4.2).
std::vector<std::string> card_records(FitsFile& file, const Card& card,
                                      const std::string& comment) {
  constexpr std::size_t kWidth = FLEN_CARD - 1, kQuotes = 2;
  /// Where numbers of standard cards end.
  constexpr std::size_t kNumberWidth = 20;
  const std::string prefix = card_prefix(file, card.key);
  std::vector<std::string> values;
  if (const auto* text = std::get_if<std::string>(&card.value)) {
    // The first card must hold one (quoted) character and the '&'.
    constexpr std::size_t kLeastRoom = 3;
    if (prefix.size() + kQuotes + kLeastRoom > kWidth) {
      file.fail(fmt::format("card {}: the name is too long for a FITS header", card.key));
    }
    values = quoted_pieces(percent_encode(*text), kWidth - prefix.size() - kQuotes,
                           kWidth - kContinue.size() - kQuotes);
  } else {
    std::string value;
    if (const auto* flag = std::get_if<bool>(&card.value)) {
      value = *flag ? "T" : "F";
    } else if (const auto* integer = std::get_if<long long>(&card.value)) {
      value = fmt::format("{}", *integer);
    } else if (const auto* number = std::get_if<double>(&card.value)) {
      if (!std::isfinite(*number)) {
        file.fail(fmt::format("card {}: FITS headers cannot hold {}", card.key, *number));
      }
      value = fits_number(*number);
    }
    const bool standard = !prefix.starts_with(kHierarch);
    values = {standard ? fmt::format("{:>{}}", value, kNumberWidth) : value};
    if (prefix.size() + values[0].size() > kWidth) {
      file.fail(fmt::format("card {}: the name is too long for a FITS header", card.key));
    }
  }
  std::vector<std::string> records;
  for (const std::string& value : values) {
    records.push_back((records.empty() ? prefix : std::string(kContinue)) + value);
  }
  if (!comment.empty()) records.back() = (records.back() + " / " + comment).substr(0, kWidth);
  return records;
}

struct ParsedCard {
  std::string value, comment;
};

ParsedCard parse_card(FitsFile& file, const std::string& record) {
  char value[FLEN_VALUE] = {}, comment[FLEN_COMMENT] = {};
  int status = 0;
  fits_parse_value(const_cast<char*>(record.c_str()), value, comment, &status);
  if (status != 0) {
    fits_clear_errmsg();
    file.fail(fmt::format("cannot read the card '{}'", trim_right(record)));
  }
  return {value, comment};
}

std::string read_record(FitsFile& file, int number) {
  char record[FLEN_CARD] = {};
  file.call(fits_read_record, number, record);
  return record;
}

int record_count(FitsFile& file) {
  int count = 0;
  file.call(fits_get_hdrspace, &count, nullptr);
  return count;
}

/// One line of a text, encoded, in pieces of at most kLongestPiece bytes before encoding.
using Pieces = std::vector<std::string>;

/// The lines of one cell of a text table. The newline that ends a text stays with its last line, so
/// that the last line is never empty unless the text is.
std::vector<Pieces> cell_lines(std::string_view text) {
  std::vector<Pieces> lines;
  const auto add = [&lines](std::string_view line) {
    Pieces& pieces = lines.emplace_back();
    do {
      pieces.push_back(percent_encode(line.substr(0, kLongestPiece)));
      line.remove_prefix(std::min(line.size(), kLongestPiece));
    } while (!line.empty());
  };
  const std::size_t inner = text.empty() ? 0 : text.size() - 1;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) < inner; begin = end + 1) {
    add(text.substr(begin, end - begin));
  }
  add(text.substr(begin));
  return lines;
}

/// The inverse, from decoded lines; a shorter cell than its neighbours in the row has empty lines
/// at its end.
std::string join_lines(const std::vector<std::string>& lines) {
  std::size_t count = lines.size();
  while (count > 0 && lines[count - 1].empty()) --count;
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) text += '\n';
    text += lines[i];
  }
  return text;
}

std::string read_column_name(FitsFile& file, int column) {
  char name[FLEN_VALUE] = {};
  file.call(fits_read_key_str, fmt::format("TTYPE{}", column).c_str(), name, nullptr);
  return name;
}

/// The cells of one column, decoded.
std::vector<std::string> read_text_column(FitsFile& file, int column, LONGLONG count) {
  constexpr LONGLONG kBlock = 1024;
  std::vector<std::string> texts;
  for (LONGLONG first = 0; first < count; first += kBlock) {
    for (const std::string& text :
         read_text_cells(file, column, first + 1, std::min(kBlock, count - first))) {
      texts.push_back(percent_decode(text));
    }
  }
  return texts;
}

}  // namespace

std::string percent_encode(std::string_view text) {
  std::string encoded;
  encoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool last_blank = text[i] == ' ' && i + 1 == text.size();
    if (!is_printing(text[i]) || last_blank || is_escape(text, i)) {
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

void write_card(FitsFile& file, const Card& card) {
  const std::string comment = percent_encode(card.comment);
  if (std::holds_alternative<std::monostate>(card.value) && card.key == "COMMENT") {
    file.call(fits_write_comment, comment.c_str());
  } else if (std::holds_alternative<std::monostate>(card.value) && card.key == "HISTORY") {
    file.call(fits_write_history, comment.c_str());
  } else {
    for (const std::string& record : card_records(file, card, comment)) {
      file.call(fits_write_record, record.c_str());
    }
  }
}

void write_cards(FitsFile& file, const std::vector<Card>& cards) {
  for (const Card& card : cards) write_card(file, card);
  char record[FLEN_CARD] = {};
  int status = 0;
  fits_read_card(file.handle(), "CONTINUE", record, &status);
  fits_clear_errmsg();
  if (status == 0) {
    file.call(fits_update_key_str, "LONGSTRN", "OGIP 1.0", "long strings go on in CONTINUE cards");
  }
}

std::vector<Card> read_cards(FitsFile& file) {
  constexpr std::array kLayoutClasses = {TYP_STRUC_KEY, TYP_CMPRS_KEY, TYP_SCAL_KEY, TYP_NULL_KEY,
                                         TYP_DIM_KEY,   TYP_CKSUM_KEY, TYP_CONT_KEY};
  constexpr std::array<std::string_view, 4> kLayoutKeys = {"ZHECKSUM", "ZDATASUM", "ZQUANTIZ",
                                                           "LONGSTRN"};
  std::vector<Card> cards;
  const int count = record_count(file);
  for (int number = 1; number <= count; ++number) {
    std::string record = read_record(file, number);
    const int card_class = fits_get_keyclass(record.data());
    if (std::find(kLayoutClasses.begin(), kLayoutClasses.end(), card_class) !=
        kLayoutClasses.end()) {
      continue;
    }
    char name[FLEN_KEYWORD] = {};
    int length = 0, status = 0;
    fits_get_keyname(record.data(), name, &length, &status);
    fits_clear_errmsg();
    Card card;
    card.key = name;
    if (status != 0 || card.key.empty() ||
        std::find(kLayoutKeys.begin(), kLayoutKeys.end(), card.key) != kLayoutKeys.end()) {
      continue;
    }
    if (card.key == "COMMENT" || card.key == "HISTORY") {
      card.comment = percent_decode(
          trim_right(std::string_view(record).substr(std::min(record.size(), kKeywordWidth))));
      cards.push_back(std::move(card));
      continue;
    }
    if (record.starts_with(kHierarch)) card.key = std::string(kHierarch) + card.key;
    ParsedCard parsed = parse_card(file, record);
    char type = 'U';
    if (!parsed.value.empty()) {
      fits_get_keytype(parsed.value.c_str(), &type, &status);
      fits_clear_errmsg();
      if (status != 0) {
        file.fail(fmt::format("cannot read the card '{}'", trim_right(record)));
      }
    }
    switch (type) {
      case 'U':
        break;
      case 'L':
        card.value = parsed.value == "T";
        break;
      case 'I':
        if (long long integer = 0; parse_number(parsed.value, integer)) {
          card.value = integer;
          break;
        }
        [[fallthrough]];
      case 'F':
        // Numbers beyond our types stay as they are written.
        if (double real = 0; parse_number(parsed.value, real)) {
          card.value = real;
        } else {
          card.value = parsed.value;
        }
        break;
      case 'C': {
        std::string text = unquote(parsed.value);
        while (!text.empty() && text.back() == '&' && number < count) {
          std::string next = read_record(file, number + 1);
          if (!next.starts_with(kContinue)) break;
          // A continuation has no '=', which CFITSIO's parser looks for.
          next.replace(0, kContinue.size(), "CONTINU = ");
          const ParsedCard more = parse_card(file, next);
          text.pop_back();
          text += unquote(more.value);
          parsed.comment += more.comment;
          ++number;
        }
        card.value = percent_decode(trim_right(text));
        break;
      }
      default:
        card.value = parsed.value;
    }
    card.comment = percent_decode(trim_right(parsed.comment));
    cards.push_back(std::move(card));
  }
  return cards;
}

void write_checksum(FitsFile& file) {
  constexpr const char* kComment = "checksum of this HDU";
  file.call(fits_write_chksum);
  file.call(fits_modify_comment, "DATASUM", "checksum of the data");
  file.call(fits_modify_key_str, "CHECKSUM", "0000000000000000", kComment);
  unsigned long data_sum = 0, hdu_sum = 0;
  file.call(fits_get_chksum, &data_sum, &hdu_sum);
  constexpr int kComplement = 1;
  char text[FLEN_VALUE] = {};
  fits_encode_chksum(hdu_sum, kComplement, text);
  file.call(fits_modify_key_str, "CHECKSUM", text, kComment);
}

std::vector<std::string> read_text_cells(FitsFile& file, int column, LONGLONG first,
                                         LONGLONG count) {
  int type = 0;
  long repeat = 0, width = 0;
  file.call(fits_get_coltype, column, &type, &repeat, &width);
  const std::size_t size = static_cast<std::size_t>(width) + 1;
  std::vector<char> text(size * static_cast<std::size_t>(count));
  std::vector<char*> cells;
  for (LONGLONG i = 0; i < count; ++i) {
    cells.push_back(text.data() + size * static_cast<std::size_t>(i));
  }
  char null_value[] = "";
  file.call(fits_read_col_str, column, first, LONGLONG{1}, count, null_value, cells.data(),
            nullptr);
  std::vector<std::string> texts;
  for (const char* cell : cells) texts.emplace_back(trim_right(cell));
  return texts;
}

void write_text_table(FitsFile& file, const TextTable& table, const std::vector<Card>& common) {
  const std::size_t columns = table.columns.size();
  std::vector<int> numbers;
  std::vector<std::vector<std::string>> texts(columns);
  for (const auto& row : table.rows) {
    if (row.size() != columns) {
      throw std::invalid_argument(fmt::format("table {}: a row of {} cells for {} columns",
                                              table.name, row.size(), columns));
    }
    std::vector<std::vector<Pieces>> cells;
    std::size_t line_count = 0;
    for (const std::string& text : row) {
      cells.push_back(cell_lines(text));
      line_count = std::max(line_count, cells.back().size());
    }
    for (std::size_t line = 0; line < line_count; ++line) {
      std::size_t piece_count = 1;
      for (const auto& lines : cells) {
        if (line < lines.size()) piece_count = std::max(piece_count, lines[line].size());
      }
      for (std::size_t piece = 0; piece < piece_count; ++piece) {
        numbers.push_back(piece == 0 ? static_cast<int>(line) + 1 : kContinuedLine);
        for (std::size_t column = 0; column < columns; ++column) {
          const auto& lines = cells[column];
          const bool has_piece = line < lines.size() && piece < lines[line].size();
          texts[column].push_back(has_piece ? lines[line][piece] : std::string());
        }
      }
    }
  }

  std::vector<std::string> names = {kLineColumn}, forms = {"1J"};
  for (std::size_t column = 0; column < columns; ++column) {
    std::size_t width = 1;
    for (const std::string& text : texts[column]) width = std::max(width, text.size());
    names.push_back(table.columns[column]);
    forms.push_back(fmt::format("{}A", width));
  }
  std::vector<char*> name_pointers, form_pointers;
  for (std::string& name : names) name_pointers.push_back(name.data());
  for (std::string& form : forms) form_pointers.push_back(form.data());
  file.call(fits_create_tbl, BINARY_TBL, LONGLONG{0}, static_cast<int>(names.size()),
            name_pointers.data(), form_pointers.data(), nullptr, table.name.c_str());
  file.call(fits_modify_comment, "TTYPE1", "line of the texts; 1: new row, 0: goes on");
  std::vector<Card> cards = common;
  cards.insert(cards.end(), table.cards.begin(), table.cards.end());
  write_cards(file, cards);

  const auto count = static_cast<LONGLONG>(numbers.size());
  if (count == 0) return;
  file.call(fits_write_col_int, 1, LONGLONG{1}, LONGLONG{1}, count, numbers.data());
  for (std::size_t column = 0; column < columns; ++column) {
    std::vector<char*> pointers;
    for (std::string& text : texts[column]) pointers.push_back(text.data());
    file.call(fits_write_col_str, static_cast<int>(column) + 2, LONGLONG{1}, LONGLONG{1}, count,
              pointers.data());
  }
}

bool is_text_table(FitsFile& file) {
  int type = 0, columns = 0;
  file.call(fits_get_hdu_type, &type);
  if (type != BINARY_TBL) return false;
  file.call(fits_get_num_cols, &columns);
  for (int column = 1; column <= columns; ++column) {
    file.call(fits_get_coltype, column, &type, nullptr, nullptr);
    if (type != (column == 1 ? TLONG : TSTRING)) return false;
  }
  return columns > 0 && read_column_name(file, 1) == kLineColumn;
}

TextTable read_text_table(FitsFile& file) {
  TextTable table;
  int columns = 0;
  LONGLONG count = 0;
  file.call(fits_get_num_cols, &columns);
  file.call(fits_get_num_rowsll, &count);
  std::vector<int> numbers(static_cast<std::size_t>(count));
  if (count > 0) {
    file.call(fits_read_col_int, 1, LONGLONG{1}, LONGLONG{1}, count, 0, numbers.data(), nullptr);
    table.rows.resize(static_cast<std::size_t>(std::count(numbers.begin(), numbers.end(), 1)));
    if (numbers[0] != 1) file.fail("a table of texts that does not begin with line 1");
  }
  for (int column = 2; column <= columns; ++column) {
    table.columns.push_back(read_column_name(file, column));
    const std::vector<std::string> texts = read_text_column(file, column, count);
    auto row = table.rows.begin();
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < texts.size(); ++i) {
      if (numbers[i] == kContinuedLine) {
        lines.back() += texts[i];
      } else {
        lines.push_back(texts[i]);
      }
      if (i + 1 == texts.size() || numbers[i + 1] == 1) {
        (row++)->push_back(join_lines(lines));
        lines.clear();
      }
    }
  }

  for (Card& card : read_cards(file)) {
    if (card.key == "EXTNAME") {
      table.name = std::get<std::string>(card.value);
    } else if (!is_common_card(card.key)) {
      table.cards.push_back(std::move(card));
    }
  }
  return table;
}

bool is_common_card(std::string_view key) {
  return key == "DATE" || key == "ORIGIN" || key == "CREATOR";
}

}  // namespace gamer
