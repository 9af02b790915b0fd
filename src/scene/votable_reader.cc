#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "scene/catalogue_readers.h"

namespace gamer {
namespace {

// A VOTable is XML (IVOA Recommendation VOTable 1.4). A TABLE has a FIELD for each column and, in
// DATA/TABLEDATA, a TR for each row with a TD for each cell.

constexpr std::size_t piece_bytes = std::size_t{1} << 20;  // given to Expat at a time

bool equal_in_any_case(std::string_view a, std::string_view b) { return lower(a) == lower(b); }

/// The name of an element without its namespace.
std::string_view local_name(const char* name) {
  const std::string_view text = name;
  return text.substr(text.rfind(':') + 1);
}

/// The value of an attribute; empty where there is none.
std::string attribute(const char** attributes, std::string_view name) {
  for (; *attributes != nullptr; attributes += 2) {
    if (name == attributes[0]) return attributes[1];
  }
  return {};
}

/// A column while its cells are read.
struct Field {
  enum class Kind { real, integer, logical, text, left_out };
  Catalogue::Column column;
  Kind kind = Kind::text;
  std::string null;  ///< the text of a missing value
  std::vector<double> reals;
  std::vector<std::int64_t> integers;
  std::vector<std::size_t> nulls;  ///< rows of `integers` without a value
  std::vector<std::string> texts;
};

Field::Kind field_kind(const std::string& datatype, const std::string& array_size) {
  if (datatype == "char" || datatype == "unicodeChar") return Field::Kind::text;
  if (!array_size.empty() && array_size != "1") return Field::Kind::left_out;
  if (datatype == "float" || datatype == "double") return Field::Kind::real;
  if (datatype == "boolean") return Field::Kind::logical;
  if (datatype == "floatComplex" || datatype == "doubleComplex") return Field::Kind::left_out;
  constexpr std::string_view integers[] = {"bit", "unsignedByte", "short", "int", "long"};
  return std::ranges::find(integers, datatype) != std::end(integers) ? Field::Kind::integer
                                                                     : Field::Kind::text;
}

/// Adds a cell; false where it is no value of the column's kind.
bool append_cell(Field& field, std::string_view text) {
  const bool is_null = text.empty() || (!field.null.empty() && text == field.null);
  switch (field.kind) {
    case Field::Kind::left_out: return true;
    case Field::Kind::text: field.texts.emplace_back(is_null ? "-" : text); return true;
    case Field::Kind::real: {
      const auto value = is_null ? no_value : number_of<double>(without_plus(text));
      field.reals.push_back(value.value_or(no_value));
      return value.has_value();
    }
    case Field::Kind::integer: {
      const auto value = is_null ? std::int64_t{0} : number_of<std::int64_t>(without_plus(text));
      if (is_null) field.nulls.push_back(field.integers.size());
      field.integers.push_back(value.value_or(0));
      return value.has_value();
    }
    case Field::Kind::logical: {
      const bool is_true =
          equal_in_any_case(text, "true") || equal_in_any_case(text, "t") || text == "1";
      const bool is_false =
          equal_in_any_case(text, "false") || equal_in_any_case(text, "f") || text == "0";
      if (!is_true && !is_false) field.nulls.push_back(field.integers.size());
      field.integers.push_back(is_true ? 1 : 0);
      return is_true || is_false || is_null || text == "?";
    }
  }
  return false;
}

/// The column with its cells. Integers without a value make it one of numbers with NaN.
Catalogue::Column finish(Field& field) {
  Catalogue::Column column = std::move(field.column);
  if (field.kind == Field::Kind::text) {
    column.kind = Catalogue::Kind::text;
    column.cells = std::move(field.texts);
  } else if (field.kind == Field::Kind::real) {
    column.cells = std::move(field.reals);
  } else if (field.nulls.empty()) {
    column.cells = std::move(field.integers);
  } else {
    std::vector<double> reals(field.integers.begin(), field.integers.end());
    for (const std::size_t row : field.nulls) reals[row] = no_value;
    column.cells = std::move(reals);
  }
  return column;
}

/// Reads one table of a text.
class VotableReader {
 public:
  VotableReader(std::string_view text, const std::string& label, const std::string& table)
      : text_(text),
        label_(label),
        asked_(table),
        parser_(XML_ParserCreate(nullptr), &XML_ParserFree) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(
        parser_.get(),
        [](void* self, const char* name, const char** attributes) {
          guard(self, [&](VotableReader& r) { r.begin(local_name(name), attributes); });
        },
        [](void* self, const char* name) {
          guard(self, [&](VotableReader& r) { r.end(local_name(name)); });
        });
    XML_SetCharacterDataHandler(parser_.get(), [](void* self, const char* letters, int length) {
      guard(self, [&](VotableReader& r) {
        if (r.in_cell_) r.cell_.append(letters, static_cast<std::size_t>(length));
      });
    });
  }

  TextCatalogue read();

 private:
  enum class State { outside, in_table, in_data, in_row, behind };

  /// Exceptions must not pass through Expat, which is C: read() throws them again.
  template <class Call>
  static void guard(void* self, const Call& call) {
    auto& reader = *static_cast<VotableReader*>(self);
    if (reader.error_) return;
    try {
      call(reader);
    } catch (...) {
      reader.error_ = std::current_exception();
      XML_StopParser(reader.parser_.get(), XML_FALSE);
    }
  }

  SourceLocation here() const {
    return {label_, static_cast<int>(XML_GetCurrentLineNumber(parser_.get())),
            static_cast<int>(XML_GetCurrentColumnNumber(parser_.get())) + 1};
  }
  [[noreturn]] void fail(const std::string& message) const { throw InputError(here(), message); }

  void begin(std::string_view name, const char** attributes);
  void end(std::string_view name);
  bool is_asked(const char** attributes) const;
  void begin_field(const char** attributes);
  void end_row();
  void end_cell();

  std::string_view text_;
  std::string label_;
  std::string asked_;
  std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser_;
  std::exception_ptr error_;
  State state_ = State::outside;
  std::size_t tables_ = 0;  ///< begun so far
  bool in_field_ = false;
  bool in_cell_ = false;
  std::size_t cells_ = 0;  ///< of the row
  std::string cell_;
  std::vector<Field> fields_;
  std::vector<std::int32_t> lines_;
};

bool VotableReader::is_asked(const char** attributes) const {
  if (asked_.empty()) return true;
  return equal_in_any_case(attribute(attributes, "name"), asked_) ||
         equal_in_any_case(attribute(attributes, "ID"), asked_) ||
         fmt::format("{}", tables_) == asked_;
}

void VotableReader::begin_field(const char** attributes) {
  if (fields_.size() == most_columns) {
    fail(fmt::format("there are more than {} columns", most_columns));
  }
  Field field;
  std::string name = attribute(attributes, "name");
  if (name.empty()) name = attribute(attributes, "ID");
  if (name.empty()) fail("the FIELD has no name");
  field.kind = field_kind(attribute(attributes, "datatype"), attribute(attributes, "arraysize"));
  field.column = {std::move(name), attribute(attributes, "unit"), here(), {}, {}};
  fields_.push_back(std::move(field));
  in_field_ = true;
}

void VotableReader::begin(std::string_view name, const char** attributes) {
  if (name == "TABLE") {
    ++tables_;
    if (state_ == State::outside && is_asked(attributes)) state_ = State::in_table;
    return;
  }
  if (state_ == State::outside || state_ == State::behind) return;
  if (state_ == State::in_table && name == "FIELD") begin_field(attributes);
  if (in_field_ && name == "VALUES") fields_.back().null = attribute(attributes, "null");
  if (name == "BINARY" || name == "BINARY2" || name == "FITS") {
    fail(
        fmt::format("the rows of this table are {}; only those of TABLEDATA can be read: save it "
                    "with format=\"tabledata\"",
                    name));
  }
  if (state_ == State::in_table && name == "TABLEDATA") {
    state_ = State::in_data;
  } else if (state_ == State::in_data && name == "TR") {
    state_ = State::in_row;
    cells_ = 0;
    lines_.push_back(static_cast<std::int32_t>(XML_GetCurrentLineNumber(parser_.get())));
  } else if (state_ == State::in_row && name == "TD") {
    if (cells_ == fields_.size()) {
      fail(fmt::format("the row has more values than the {} columns", fields_.size()));
    }
    in_cell_ = true;
    cell_.clear();
  }
}

void VotableReader::end_cell() {
  in_cell_ = false;
  Field& field = fields_[cells_++];
  const std::string_view text = trimmed(cell_, blank_characters);
  if (append_cell(field, text)) return;
  fail(fmt::format("column '{}': {} is not {}", field.column.name, in_quotes(text),
                   field.kind == Field::Kind::real      ? "a number"
                   : field.kind == Field::Kind::integer ? "an integer"
                                                        : "true or false"));
}

void VotableReader::end_row() {
  if (cells_ != fields_.size()) {
    fail(fmt::format("the row has {} value{} for {} columns", cells_, cells_ == 1 ? "" : "s",
                     fields_.size()));
  }
  state_ = State::in_data;
}

void VotableReader::end(std::string_view name) {
  if (name == "FIELD") in_field_ = false;
  if (in_cell_ && name == "TD") end_cell();
  if (state_ == State::in_row && name == "TR") end_row();
  if (state_ == State::in_data && name == "TABLEDATA") state_ = State::in_table;
  if (state_ == State::in_table && name == "TABLE") state_ = State::behind;
}

TextCatalogue VotableReader::read() {
  for (std::size_t begin = 0; begin <= text_.size(); begin += piece_bytes) {
    const std::string_view piece = text_.substr(begin, piece_bytes);
    const bool is_last = begin + piece.size() == text_.size();
    const XML_Status status =
        XML_Parse(parser_.get(), piece.data(), static_cast<int>(piece.size()), is_last ? 1 : 0);
    if (error_) std::rethrow_exception(error_);
    if (status != XML_STATUS_OK) {
      fail(fmt::format("this is not XML: {}", XML_ErrorString(XML_GetErrorCode(parser_.get()))));
    }
    if (is_last) break;
  }
  if (state_ != State::behind) {
    throw InputError({label_, 0, 0},
                     asked_.empty() ? "there is no TABLE of a VOTable in it"
                                    : fmt::format("there is no TABLE {} in it", in_quotes(asked_)));
  }
  TextCatalogue table;
  table.places.text = text_;
  table.places.lines = std::move(lines_);
  for (Field& field : fields_) {
    if (field.kind != Field::Kind::left_out) table.columns.push_back(finish(field));
  }
  return table;
}

}  // namespace

bool opens_xml(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  return trimmed(text.substr(0, 4096), blank_characters).starts_with('<');
}

TextCatalogue read_votable(std::string_view text, const std::string& label,
                           const std::string& table) {
  return VotableReader(text, label, table).read();
}

}  // namespace gamer
