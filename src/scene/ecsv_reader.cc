#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <utility>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "scene/catalogue_readers.h"

namespace gamer {
namespace {

using Separator = TextRows::Separator;

constexpr std::string_view marker = "%ECSV";
constexpr std::string_view known_version = "1.0";

// A longer head can only be a mistake. The limit bounds the time that YAML takes.
constexpr std::size_t largest_head = std::size_t{1} << 20;

/// The text after "%ECSV" in a first line; empty for other lines.
std::string_view version_of(std::string_view line) {
  line = trimmed(line, blank_characters);
  if (!line.starts_with('#')) return {};
  line = trimmed(line.substr(1), blank_characters);
  return line.starts_with(marker) ? trimmed(line.substr(marker.size()), blank_characters)
                                  : std::string_view();
}

/// The YAML text after the '#' of the head's lines, and the place of its characters in the file.
class Head {
 public:
  explicit Head(const std::string& label) : label_(label) {}

  /// Takes a line of the head; returns false for a line that is not part of the head.
  bool add(const TextLine& line) {
    if (!line.text.starts_with('#')) return false;
    if (lines_.empty()) first_line_ = line.number;
    const std::size_t margin = line.text.starts_with("# ") ? 2 : 1;
    lines_.push_back(static_cast<int>(margin));
    if (yaml_.size() + line.text.size() > largest_head) {
      throw input_error({label_, line.number, 1}, "the head is larger than {} bytes", largest_head);
    }
    yaml_ += line.text.substr(margin);
    yaml_ += '\n';
    return true;
  }

  SourceLocation where(const YAML::Mark& mark) const {
    if (lines_.empty() || mark.line < 0) return {label_, first_line_, 0};
    const auto line = std::min(static_cast<std::size_t>(mark.line), lines_.size() - 1);
    return {label_, first_line_ + static_cast<int>(line), lines_[line] + mark.column + 1};
  }

  const std::string& yaml() const { return yaml_; }

 private:
  std::string label_;
  std::string yaml_;
  int first_line_ = 1;
  std::vector<int> lines_;  ///< [line]: characters before the YAML
};

struct HeadColumn {
  std::string name;
  std::string unit;
  Catalogue::Kind kind;
};

struct HeadContents {
  std::vector<HeadColumn> columns;
  Separator separator = Separator::quoted_blanks;
};

/// The text of a key of `map`; empty where there is none.
std::string scalar_text(const YAML::Node& map, const char* key, const Head& head) {
  const YAML::Node node = map[key];
  if (!node.IsDefined() || node.IsNull()) return {};
  if (!node.IsScalar()) throw input_error(head.where(node.Mark()), "'{}' must be a text", key);
  return node.Scalar();
}

Catalogue::Kind kind_of_datatype(std::string_view datatype) {
  if (datatype == "string") return Catalogue::Kind::text;
  if (datatype.starts_with("float")) return Catalogue::Kind::real;
  if (datatype.starts_with("int") || datatype.starts_with("uint")) return Catalogue::Kind::integer;
  return Catalogue::Kind::unknown;
}

HeadContents read_head(const Head& head, const YAML::Node& root) {
  if (!root.IsMap()) {
    throw InputError(head.where(root.Mark()), "the head must be a YAML map with a 'datatype'");
  }
  HeadContents contents;
  const std::string delimiter = scalar_text(root, "delimiter", head);
  if (delimiter == ",") {
    contents.separator = Separator::quoted_commas;
  } else if (!delimiter.empty() && delimiter != " ") {
    throw input_error(head.where(root["delimiter"].Mark()),
                      "the delimiter {} is neither a space nor a comma", in_quotes(delimiter));
  }
  const YAML::Node columns = root["datatype"];
  if (!columns.IsDefined()) {
    throw InputError(head.where(root.Mark()), "the head has no 'datatype', the list of columns");
  }
  if (!columns.IsSequence() || columns.size() == 0) {
    throw InputError(head.where(columns.Mark()), "'datatype' must be a list of columns");
  }
  if (columns.size() > most_columns) {
    throw input_error(head.where(columns.Mark()), "there are more than {} columns", most_columns);
  }
  for (const YAML::Node& column : columns) {
    if (!column.IsMap()) {
      throw InputError(head.where(column.Mark()), "a column must be a map like {name: ra}");
    }
    contents.columns.push_back({scalar_text(column, "name", head),
                                scalar_text(column, "unit", head),
                                kind_of_datatype(scalar_text(column, "datatype", head))});
    if (contents.columns.back().name.empty()) {
      throw InputError(head.where(column.Mark()), "the column has no name");
    }
  }
  return contents;
}

HeadContents read_head(const Head& head) {
  try {
    return read_head(head, YAML::Load(head.yaml()));
  } catch (const YAML::DeepRecursion& error) {
    throw InputError(head.where(error.mark), "the head is nested too deeply");
  } catch (const YAML::Exception& error) {
    throw input_error(head.where(error.mark), "the head is not YAML: {}", error.msg);
  }
}

/// Checks the row of names against the head and takes the units from the head.
void complete_columns(std::vector<Catalogue::Column>& columns,
                      const std::vector<HeadColumn>& head) {
  for (std::size_t c = 0; c < std::min(columns.size(), head.size()); ++c) {
    if (columns[c].name != head[c].name) {
      throw input_error(columns[c].where, "this name is {}, but column {} of the head is {}",
                        in_quotes(columns[c].name), c + 1, in_quotes(head[c].name));
    }
    columns[c].unit = head[c].unit;
    columns[c].kind = head[c].kind;
  }
  if (columns.size() != head.size()) {
    throw input_error(columns.back().where,
                      "the row of names has {} value{} for the {} columns of the head",
                      columns.size(), columns.size() == 1 ? "" : "s", head.size());
  }
}

}  // namespace

bool opens_ecsv(std::string_view line) { return !version_of(line).empty(); }

TextCatalogue read_ecsv(std::string_view text, const std::string& label) {
  LineReader lines(text);
  TextLine line;
  const bool has_line = lines.next(line);
  const std::string_view version = has_line ? version_of(line.text) : std::string_view();
  if (version.empty()) {
    throw input_error({label, 1, 1}, "an ECSV file begins with '# {} {}'", marker, known_version);
  }
  if (!version.starts_with("1.") && !version.starts_with("0.")) {
    throw input_error({label, 1, 1}, "ECSV of version {} is not known; {} is", in_quotes(version),
                      known_version);
  }
  Head head(label);
  bool more = lines.next(line);
  while (more && head.add(line)) more = lines.next(line);
  const HeadContents contents = read_head(head);

  std::vector<Catalogue::Column> columns;
  for (; columns.empty() && more; more = columns.empty() && lines.next(line)) {
    columns = named_columns(line, contents.separator, label);
  }
  if (columns.empty()) {
    throw InputError({label, 0, 0}, "there is no row with the names of the columns below the head");
  }
  complete_columns(columns, contents.columns);
  RowCollector rows(text, label, contents.separator, std::move(columns));
  while (lines.next(line)) rows.add(line);
  return std::move(rows).finish();
}

}  // namespace gamer
