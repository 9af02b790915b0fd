#include "image/fits/fits_cards.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "gamer/core/version.h"
#include "gamer/image/fits/fits.h"
#include "image/fits/card_record.h"

namespace gamer {
namespace {

/// First column of a text table: number of the line in the other columns.
constexpr const char* line_column = "LINE";
/// Value of column LINE in rows that continue a line.
constexpr int continued_line = 0;
/// Lines are cut into pieces of at most this many bytes, which keeps columns narrow. CFITSIO allows
/// no column wider than 28799.
constexpr std::size_t longest_piece = 200;

/// The successive lines of one cell of a text table. A newline at the end of a text stays with its
/// last line, so only an empty text has an empty last line.
class CellLines {
 public:
  explicit CellLines(std::string_view text) : rest_(text) {}

  /// The next line; nothing at the end.
  std::optional<std::string_view> next() {
    if (is_done_) return std::nullopt;
    const std::size_t inner = rest_.empty() ? 0 : rest_.size() - 1;
    const std::size_t end = rest_.find('\n');
    is_done_ = end >= inner;
    if (is_done_) return rest_;
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return line;
  }

 private:
  std::string_view rest_;
  bool is_done_ = false;
};

/// Calls take(number, pieces) for each line of the table in the file. `number` goes to line_column;
/// `pieces` has at most longest_piece bytes per column, not encoded.
template <class Take>
void for_each_line(const TextTable& table, const Take& take) {
  const std::size_t columns = table.columns.size();
  std::vector<std::optional<std::string_view>> lines(columns);
  std::vector<std::string_view> pieces(columns);
  table.for_each_row([&](std::span<const std::string_view> row) {
    if (row.size() != columns) {
      throw std::invalid_argument(fmt::format("table {}: a row of {} cells for {} columns",
                                              table.name, row.size(), columns));
    }
    std::vector<CellLines> cells(row.begin(), row.end());
    for (int number = 1;; ++number) {
      std::size_t longest = 0;
      bool is_there = false;
      for (std::size_t column = 0; column < columns; ++column) {
        lines[column] = cells[column].next();
        is_there = is_there || lines[column];
        longest = std::max(longest, lines[column].value_or("").size());
      }
      if (!is_there) break;
      for (std::size_t begin = 0; begin == 0 || begin < longest; begin += longest_piece) {
        for (std::size_t column = 0; column < columns; ++column) {
          const std::string_view line = lines[column].value_or("");
          pieces[column] = line.substr(std::min(begin, line.size()), longest_piece);
        }
        take(begin == 0 ? number : continued_line, pieces);
      }
    }
  });
}

/// Joins decoded lines to a cell. A cell with fewer lines than its row has empty lines at its end.
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
  constexpr LONGLONG block_size = 1024;
  std::vector<std::string> texts;
  for (LONGLONG first = 0; first < count; first += block_size) {
    for (const std::string& text :
         read_text_cells(file, column, first + 1, std::min(block_size, count - first))) {
      texts.push_back(percent_decode(text));
    }
  }
  return texts;
}

constexpr const char* no_checksum = "0000000000000000";
constexpr const char* checksum_comment = "checksum of this HDU";
constexpr const char* data_sum_comment = "checksum of the data";

/// A ones' complement sum, reduced to 32 bits.
std::uint64_t folded(std::uint64_t sum) {
  constexpr std::uint64_t word_size = 0xFFFFFFFF;
  while (sum > word_size) sum = (sum & word_size) + (sum >> 32);
  return sum;
}

/// The checksum of the current header as stored: its records, END and blanks.
std::uint64_t header_sum(FitsFile& file) {
  constexpr std::size_t record_size = FLEN_CARD - 1, word_size = 4;
  LONGLONG begin = 0, data = 0, end = 0;
  file.call(fits_get_hduaddrll, &begin, &data, &end);
  std::string text;
  for (std::string record : read_records(file)) {
    record.resize(record_size, ' ');
    text += record;
  }
  text += "END";
  text.resize(static_cast<std::size_t>(data - begin), ' ');
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < text.size(); i += word_size) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < word_size; ++k) {
      word = word << 8 | static_cast<unsigned char>(text[i + k]);
    }
    sum += word;
  }
  return folded(sum);
}

}  // namespace

std::vector<Card> common_cards(const std::vector<Card>& given) {
  std::vector<Card> cards = {{"DATE", fits_date(), "time of writing (UTC)"},
                             {"ORIGIN", std::string("gamer"), ""},
                             {"CREATOR", fmt::format("gamer {}", version()), "program, version"}};
  for (Card& card : cards) {
    const auto found =
        std::ranges::find_if(given, [&](const Card& other) { return other.key == card.key; });
    if (found != given.end()) card = *found;
  }
  return cards;
}

std::vector<Card> without_common_cards(const std::vector<Card>& cards) {
  std::vector<Card> rest;
  std::ranges::copy_if(cards, std::back_inserter(rest),
                       [](const Card& card) { return !is_common_card(card.key); });
  return rest;
}

void append_plane_cards(std::vector<Card>& cards, const ImageHeader& header, int first, int count) {
  const bool has_wavelengths = !header.wavelengths.empty();
  for (int i = 0; has_wavelengths && i < count; ++i) {
    cards.push_back({fmt::format("WAVELEN{}", i + 1), header.wavelengths[first + i],
                     fmt::format("[Angstrom] of plane {}", i + 1)});
  }
  for (int i = 0; i < count && !header.plane_cards.empty(); ++i) {
    for (Card card : header.plane_cards[first + i]) {
      const bool is_text_line = std::holds_alternative<std::monostate>(card.value);
      if (count > 1 && !is_text_line) card.key += fmt::format("{}", i + 1);
      cards.push_back(std::move(card));
    }
  }
}

void write_card(FitsFile& file, const Card& card) {
  try {
    for (const std::string& record : card_records(card)) {
      file.call(fits_write_record, record.c_str());
    }
  } catch (const CardError& error) {
    file.fail(error.what());
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

std::vector<std::string> read_records(FitsFile& file) {
  std::vector<std::string> records;
  int count = 0;
  file.call(fits_get_hdrspace, &count, nullptr);
  for (int number = 1; number <= count; ++number) {
    char record[FLEN_CARD] = {};
    file.call(fits_read_record, number, record);
    records.emplace_back(record);
  }
  return records;
}

std::vector<Card> read_cards(FitsFile& file) {
  const std::vector<std::string> records = read_records(file);
  const std::span<const std::string> all = records;
  std::vector<Card> cards;
  try {
    for (std::size_t i = 0; i < all.size();) {
      const std::size_t length = card_length(all.subspan(i));
      if (!is_layout_record(all[i]) && !record_key(all[i]).empty() && !is_continuation(all[i])) {
        cards.push_back(parse_card(all.subspan(i, length)));
      }
      i += length;
    }
  } catch (const CardError& error) {
    file.fail(error.what());
  }
  return cards;
}

void reserve_checksum(FitsFile& file) {
  file.call(fits_update_key_str, "CHECKSUM", no_checksum, checksum_comment);
  file.call(fits_update_key_str, "DATASUM", "0", data_sum_comment);
}

void write_checksum(FitsFile& file, std::optional<std::uint32_t> data_sum) {
  if (!data_sum) {
    unsigned long sum = 0, unused = 0;
    file.call(fits_get_chksum, &sum, &unused);
    data_sum = static_cast<std::uint32_t>(sum);
  }
  file.call(fits_update_key_str, "CHECKSUM", no_checksum, checksum_comment);
  file.call(fits_update_key_str, "DATASUM", fmt::format("{}", *data_sum).c_str(), data_sum_comment);
  // This brings the header into its final form.
  file.call(fits_flush_buffer, 0);
  const std::uint64_t sum = folded(header_sum(file) + *data_sum);
  constexpr int complement_mask = 1;
  char text[FLEN_VALUE] = {};
  fits_encode_chksum(static_cast<unsigned long>(sum), complement_mask, text);
  file.call(fits_modify_key_str, "CHECKSUM", text, checksum_comment);
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

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  return pointers;
}

void write_text_table(FitsFile& file, const TextTable& table, const std::vector<Card>& common) {
  const std::size_t columns = table.columns.size();
  // The first pass finds the widths, the second writes the texts, which may not fit in memory.
  std::vector<std::size_t> widths(columns, 1);
  for_each_line(table, [&](int, std::span<const std::string_view> pieces) {
    for (std::size_t column = 0; column < columns; ++column) {
      widths[column] = std::max(widths[column], percent_encode(pieces[column]).size());
    }
  });

  std::vector<std::string> names = {line_column}, forms = {"1J"};
  for (std::size_t column = 0; column < columns; ++column) {
    names.push_back(table.columns[column]);
    forms.push_back(fmt::format("{}A", widths[column]));
  }
  file.call(fits_create_tbl, BINARY_TBL, LONGLONG{0}, static_cast<int>(names.size()),
            pointers_to(names).data(), pointers_to(forms).data(), nullptr, table.name.c_str());
  file.call(fits_modify_comment, "TTYPE1", "line of the texts; 1: new row, 0: goes on");
  std::vector<Card> cards = common;
  cards.insert(cards.end(), table.cards.begin(), table.cards.end());
  write_cards(file, cards);

  constexpr std::size_t block_size = 1024;
  LONGLONG written = 0;
  std::vector<int> numbers;
  std::vector<std::vector<std::string>> texts(columns);
  const auto write_block = [&] {
    const auto count = static_cast<LONGLONG>(numbers.size());
    if (count == 0) return;
    file.call(fits_write_col_int, 1, written + 1, LONGLONG{1}, count, numbers.data());
    for (std::size_t column = 0; column < columns; ++column) {
      file.call(fits_write_col_str, static_cast<int>(column) + 2, written + 1, LONGLONG{1}, count,
                pointers_to(texts[column]).data());
      texts[column].clear();
    }
    numbers.clear();
    written += count;
  };
  for_each_line(table, [&](int number, std::span<const std::string_view> pieces) {
    numbers.push_back(number);
    for (std::size_t column = 0; column < columns; ++column) {
      texts[column].push_back(percent_encode(pieces[column]));
    }
    if (numbers.size() == block_size) write_block();
  });
  write_block();
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
  return columns > 0 && read_column_name(file, 1) == line_column;
}

TextTable read_text_table(FitsFile& file) {
  TextTable table;
  int columns = 0;
  LONGLONG count = 0;
  file.call(fits_get_num_cols, &columns);
  file.call(fits_get_num_rowsll, &count);
  // Checked before memory is allocated for the data.
  file.check_data(0);
  std::vector<int> numbers(static_cast<std::size_t>(count));
  if (count > 0) {
    file.call(fits_read_col_int, 1, LONGLONG{1}, LONGLONG{1}, count, 0, numbers.data(), nullptr);
    table.rows.resize(static_cast<std::size_t>(std::ranges::count(numbers, 1)));
    if (numbers[0] != 1) file.fail("a table of texts that does not begin with line 1");
  }
  for (int column = 2; column <= columns; ++column) {
    table.columns.push_back(read_column_name(file, column));
    const std::vector<std::string> texts = read_text_column(file, column, count);
    auto row = table.rows.begin();
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < texts.size(); ++i) {
      if (numbers[i] == continued_line) {
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
  read_table_cards(file, table.name, table.cards);
  return table;
}

void read_table_cards(FitsFile& file, std::string& name, std::vector<Card>& cards) {
  for (Card& card : read_cards(file)) {
    if (card.key == "EXTNAME") {
      if (const auto* text = std::get_if<std::string>(&card.value)) name = *text;
    } else if (!is_common_card(card.key)) {
      cards.push_back(std::move(card));
    }
  }
}

bool is_common_card(std::string_view key) {
  return key == "DATE" || key == "ORIGIN" || key == "CREATOR";
}

}  // namespace gamer
