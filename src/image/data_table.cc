#include "gamer/image/data_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/no_value.h"
#include "gamer/core/near.h"
#include "image/fits/card_record.h"
#include "image/fits/fits_cards.h"
#include "image/fits/fits_file.h"

namespace gamer {
namespace {

bool is_table(FitsFile& file) {
  int type = 0;
  file.call(fits_get_hdu_type, &type);
  return type != IMAGE_HDU && !file.has_compressed_image();
}

/// Whether the current HDU has pixels in two axes or more.
bool is_image(FitsFile& file) {
  if (is_table(file)) return false;
  int axes = 0;
  file.call(fits_get_img_dim, &axes);
  return axes >= 2;
}

/// Moves to the first HDU for which `wanted` is true; false where there is none.
template <class Wanted>
bool move_to_first(FitsFile& file, Wanted wanted) {
  const int count = file.hdu_count();
  for (int hdu = 1; hdu <= count; ++hdu) {
    file.move_to(hdu);
    if (wanted(file)) return true;
  }
  return false;
}

// ---- Reading -----------------------------------------------------------------------------------

/// Reads one column, block by block.
class ColumnReader {
 public:
  /// Nothing where the column holds arrays, bits or complex numbers.
  static std::optional<ColumnReader> make(FitsFile& file, int number) {
    int hdu_type = 0, type = 0, scaled_type = 0;
    LONGLONG repeat = 0, width = 0;
    file.call(fits_get_hdu_type, &hdu_type);
    file.call(fits_get_coltypell, number, &type, &repeat, &width);
    file.call(fits_get_eqcoltype, number, &scaled_type, nullptr, nullptr);
    const bool binary = hdu_type == BINARY_TBL;
    if (binary && repeat != (type == TSTRING ? width : 1)) return std::nullopt;
    ColumnReader reader;
    reader.number_ = number;
    switch (scaled_type) {
      case TSTRING:
        if (width == 0) return std::nullopt;
        reader.kind_ = Kind::text;
        break;
      case TLOGICAL: reader.kind_ = Kind::logical; break;
      case TBYTE:
      case TSBYTE:
      case TSHORT:
      case TUSHORT:
      case TINT:
      case TUINT:
      case TLONG:
      case TULONG:
      case TLONGLONG:
      case TULONGLONG: reader.kind_ = Kind::integer; break;
      case TFLOAT:
      case TDOUBLE: reader.kind_ = Kind::real; break;
      default: return std::nullopt;
    }
    // In binary tables a missing floating-point number is NaN already. If CFITSIO looked for nulls,
    // it would also replace infinities and subnormal numbers.
    reader.null_value_ = binary && (type == TFLOAT || type == TDOUBLE) ? 0 : no_value;
    return reader;
  }

  void read(FitsFile& file, LONGLONG first, LONGLONG count) {
    // CFITSIO (4.2) writes to it when it finds a null.
    int any_null = 0;
    switch (kind_) {
      case Kind::real:
        reals_.resize(reals_.size() + static_cast<std::size_t>(count));
        file.call(fits_read_col_dbl, number_, first, LONGLONG{1}, count, null_value_,
                  reals_.data() + (reals_.size() - static_cast<std::size_t>(count)), &any_null);
        break;
      case Kind::integer: {
        std::vector<LONGLONG> block(static_cast<std::size_t>(count));
        std::vector<char> is_null(block.size());
        file.call(fits_read_colnull, TLONGLONG, number_, first, LONGLONG{1}, count,
                  static_cast<void*>(block.data()), is_null.data(), &any_null);
        for (std::size_t i = 0; i < block.size(); ++i) add_integer(block[i], is_null[i] != 0);
        break;
      }
      case Kind::logical: {
        constexpr char undefined = 2;
        std::vector<char> block(static_cast<std::size_t>(count));
        file.call(fits_read_col_log, number_, first, LONGLONG{1}, count, undefined, block.data(),
                  &any_null);
        for (const char flag : block) add_integer(flag, flag == undefined);
        break;
      }
      case Kind::text:
        for (std::string& text : read_text_cells(file, number_, first, count)) {
          texts_.push_back(std::move(text));
        }
    }
  }

  /// `decode`: the texts are percent-encoded.
  DataColumn finish(FitsFile& file, bool decode) {
    DataColumn column;
    column.name = file.text(fmt::format("TTYPE{}", number_));
    if (column.name.empty()) column.name = fmt::format("col{}", number_);
    column.unit = file.text(fmt::format("TUNIT{}", number_));
    column.description = file.text(fmt::format("TCOMM{}", number_));
    if (decode) {
      for (std::string* text : {&column.name, &column.unit, &column.description}) {
        *text = percent_decode(*text);
      }
      for (std::string& text : texts_) text = percent_decode(text);
    }
    if (!nulls_.empty()) {
      reals_.assign(integers_.begin(), integers_.end());
      for (const std::size_t row : nulls_) reals_[row] = no_value;
      kind_ = Kind::real;
    }
    if (kind_ == Kind::real) {
      column.values = std::move(reals_);
    } else if (kind_ == Kind::text) {
      column.values = std::move(texts_);
    } else {
      column.values = std::move(integers_);
    }
    return column;
  }

 private:
  enum class Kind { real, integer, logical, text };

  void add_integer(LONGLONG value, bool is_null) {
    if (is_null) nulls_.push_back(integers_.size());
    integers_.push_back(value);
  }

  Kind kind_ = Kind::real;
  int number_ = 0;
  double null_value_ = no_value;
  std::vector<double> reals_;
  std::vector<std::int64_t> integers_;
  std::vector<std::size_t> nulls_;  ///< rows
  std::vector<std::string> texts_;
};

/// Cards that describe a column.
bool is_column_card(std::string_view key) {
  for (const std::string_view name : {"TUNIT", "TCOMM", "TDISP"}) {
    if (key.starts_with(name) && key.size() > name.size() &&
        key.find_first_not_of("0123456789", name.size()) == std::string_view::npos) {
      return true;
    }
  }
  return false;
}

// ---- Writing -----------------------------------------------------------------------------------

std::string column_form(const DataColumn& column) {
  if (std::holds_alternative<std::vector<double>>(column.values)) return "1D";
  if (std::holds_alternative<std::vector<std::int64_t>>(column.values)) return "1K";
  std::size_t width = 1;
  for (const std::string& text : std::get<std::vector<std::string>>(column.values)) {
    width = std::max(width, percent_encode(text).size());
  }
  return fmt::format("{}A", width);
}

void write_column(FitsFile& file, int number, const DataColumn& column) {
  constexpr LONGLONG first_code = 1;
  if (const auto* reals = std::get_if<std::vector<double>>(&column.values)) {
    file.call(fits_write_col_dbl, number, first_code, first_code,
              static_cast<LONGLONG>(reals->size()), const_cast<double*>(reals->data()));
  } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
    std::vector<LONGLONG> values(integers->begin(), integers->end());
    file.call(fits_write_col_lnglng, number, first_code, first_code,
              static_cast<LONGLONG>(values.size()), values.data());
  } else {
    std::vector<std::string> texts = std::get<std::vector<std::string>>(column.values);
    for (std::string& text : texts) text = percent_encode(text);
    file.call(fits_write_col_str, number, first_code, first_code,
              static_cast<LONGLONG>(texts.size()), pointers_to(texts).data());
  }
}

}  // namespace

std::size_t DataTable::rows() const {
  if (columns.empty()) return 0;
  return std::visit([](const auto& values) { return values.size(); }, columns.front().values);
}

void DataTable::check_lengths() const {
  for (const DataColumn& column : columns) {
    if (std::visit([](const auto& values) { return values.size(); }, column.values) != rows()) {
      throw std::invalid_argument(fmt::format("table {}: columns differ in length", name));
    }
  }
}

DataTable read_data_table(const std::filesystem::path& path, const std::string& hdu) {
  FitsFile file = FitsFile::open(path, path.string());
  if (!hdu.empty()) {
    file.move_to_named(hdu);
    if (!is_table(file)) file.fail(fmt::format("HDU {} is an image, not a table", in_quotes(hdu)));
  } else if (!move_to_first(file, is_table)) {
    file.fail("no table in it");
  }

  DataTable table;
  const bool own = file.text("CREATOR").starts_with("gamer ");
  read_table_cards(file, table.name, table.cards);
  std::erase_if(table.cards, [](const Card& card) { return is_column_card(card.key); });

  int columns = 0;
  LONGLONG rows = 0;
  long block = 0;
  file.call(fits_get_num_cols, &columns);
  file.call(fits_get_num_rowsll, &rows);
  // Checked before memory is allocated for the data.
  file.check_data(0);
  std::vector<ColumnReader> readers;
  for (int column = 1; column <= columns; ++column) {
    if (auto reader = ColumnReader::make(file, column)) readers.push_back(std::move(*reader));
  }
  file.call(fits_get_rowsize, &block);
  block = std::max(block, 1L);
  for (LONGLONG first = 1; first <= rows && !readers.empty(); first += block) {
    const LONGLONG count = std::min<LONGLONG>(block, rows - first + 1);
    for (ColumnReader& reader : readers) reader.read(file, first, count);
  }
  for (ColumnReader& reader : readers) table.columns.push_back(reader.finish(file, own));
  return table;
}

void write_data_table(FitsFile& file, const DataTable& table, const std::vector<Card>& common) {
  table.check_lengths();
  std::vector<std::string> names, forms, units;
  for (const DataColumn& column : table.columns) {
    names.push_back(percent_encode(column.name));
    forms.push_back(column_form(column));
    units.push_back(percent_encode(column.unit));
  }
  file.call(fits_create_tbl, BINARY_TBL, static_cast<LONGLONG>(table.rows()),
            static_cast<int>(names.size()), pointers_to(names).data(), pointers_to(forms).data(),
            pointers_to(units).data(), table.name.c_str());
  std::vector<Card> cards = common;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const std::string& description = table.columns[i].description;
    if (!description.empty()) cards.push_back({fmt::format("TCOMM{}", i + 1), description, ""});
  }
  cards.insert(cards.end(), table.cards.begin(), table.cards.end());
  write_cards(file, cards);
  if (table.rows() == 0) return;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    write_column(file, static_cast<int>(i) + 1, table.columns[i]);
  }
}

std::filesystem::path header_file(const std::filesystem::path& path) {
  const std::string text = path.string();
  std::error_code error;
  if (!text.ends_with(']') || std::filesystem::exists(path, error)) return path;
  return text.substr(0, text.rfind('['));
}

std::string header_text(const std::filesystem::path& path) {
  const std::filesystem::path name = header_file(path);
  std::string hdu = path.string().substr(name.string().size());
  // `hdu` has the form "[SCI]".
  if (!hdu.empty()) hdu = hdu.substr(1, hdu.size() - 2);
  FitsFile file = FitsFile::open(name, name.string());
  if (!hdu.empty()) {
    file.move_to_named(hdu);
    if (!is_image(file)) {
      file.fail(fmt::format("HDU {} holds no image of two axes", in_quotes(hdu)));
    }
  } else if (!move_to_first(file, is_image)) {
    file.fail("no image of two axes in it");
  }

  constexpr int with_comments = 0;
  char* records = nullptr;
  int count = 0, status = 0;
  // For a compressed image this function gives the image's header.
  fits_convert_hdr2str(file.handle(), with_comments, nullptr, 0, &records, &count, &status);
  std::string header;
  if (status == 0) {
    const std::string_view all = records;
    for (std::size_t first = 0; first < all.size(); first += record_width) {
      header += fmt::format("{}\n", all.substr(first, record_width));
    }
  }
  int free_status = 0;
  if (records != nullptr) fits_free_memory(records, &free_status);
  if (status != 0) {
    fits_clear_errmsg();
    file.fail("its header cannot be read");
  }
  return header;
}

}  // namespace gamer
