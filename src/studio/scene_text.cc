#include "studio/scene_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "gamer/core/error.h"
#include "gamer/core/near.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/scene_columns.h"

namespace gamer {
namespace {

constexpr std::size_t most_scene_bytes = std::size_t{4} << 20;
constexpr std::size_t most_word_bytes = 1000;
const std::string no_word = "-";

using Words = std::vector<std::string>;

bool separates_words(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// A line with words: the names of the columns, or a row.
struct Line {
  struct Word {
    std::size_t begin = 0, end = 0;
  };
  std::size_t begin = 0, end = 0;  ///< with the line's end
  std::vector<Word> words;
};

/// The lines that hold words outside of comments.
std::vector<Line> lines_of(const std::string& text) {
  std::vector<Line> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    Line line{begin, std::min(text.find('\n', begin), text.size() - 1) + 1, {}};
    std::size_t at = begin;
    while (at < line.end) {
      while (at < line.end && separates_words(text[at])) ++at;
      if (at == line.end || text[at] == '#') break;
      const std::size_t word = at;
      while (at < line.end && !separates_words(text[at])) ++at;
      line.words.push_back({word, at});
    }
    begin = line.end;
    if (!line.words.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

/// A text and its words, which edits change together.
class EditedScene {
 public:
  EditedScene(std::string text, std::string label)
      : text_(std::move(text)),
        label_(std::move(label)),
        line_end_(text_.find("\r\n") != std::string::npos ? "\r\n" : "\n") {
    read();
    table_ = words();
  }

  void operator()(const SetCellEdit& edit) {
    check_row(edit.row);
    check_word(edit.word);
    auto column = std::ranges::find(table_.front(), edit.column) - table_.front().begin();
    if (column == std::ssize(table_.front())) {
      if (edit.word == no_word) return;
      add_column(edit.column);
    }
    const auto place = static_cast<std::size_t>(column);
    const auto line = static_cast<std::size_t>(edit.row) + 1;
    table_[line][place] = edit.word;
    put(line, place, edit.word);
  }

  void operator()(const AddRowEdit& edit) {
    (*this)(CloneRowEdit{edit.row});
    const int row = edit.row + 1;
    // Values that belong to the copied row's galaxy alone are left out of the new row.
    const Words names = table_.front();
    for (const std::string& name : names) {
      const bool is_own = name == "sed" || name == "id" || name == "overrides" ||
                          name.find('.') != std::string::npos;
      if (is_own) (*this)(SetCellEdit{row, name, no_word});
    }
    (*this)(SetCellEdit{row, "galaxy", edit.galaxy});
  }

  void operator()(const CloneRowEdit& edit) {
    check_row(edit.row);
    const auto line = static_cast<std::size_t>(edit.row) + 1;
    const Line& text_line = lines_[line];
    std::string copy = text_.substr(text_line.begin, text_line.end - text_line.begin);
    if (!copy.ends_with('\n')) copy.insert(0, line_end_);
    text_.insert(text_line.end, copy);
    table_.insert(table_.begin() + edit.row + 2, Words(table_[line]));
    read();
  }

  void operator()(const DeleteRowEdit& edit) {
    check_row(edit.row);
    if (table_.size() < 3) throw error("a scene needs at least one row");
    const Line& text_line = lines_[static_cast<std::size_t>(edit.row) + 1];
    text_.erase(text_line.begin, text_line.end - text_line.begin);
    table_.erase(table_.begin() + edit.row + 1);
    read();
  }

  /// Throws InputError where the words of the text differ from table_.
  void check() const {
    if (words() != table_) throw form_error();
  }

  std::string take() { return std::move(text_); }

 private:
  InputError error(const std::string& message) const { return {{label_, 0, 0}, message}; }
  InputError form_error() const {
    return error(
        "only a list with the names of its columns above its rows can be changed here; "
        "change this scene in an editor");
  }

  void read() {
    lines_ = lines_of(text_);
    const bool has_rows = lines_.size() > 1;
    const bool is_table = has_rows && std::ranges::all_of(lines_, [&](const Line& line) {
                            return line.words.size() == lines_.front().words.size();
                          });
    if (!is_table) throw form_error();
  }

  /// The names of the columns, then the words of each row, as the program reads them.
  std::vector<Words> words() const {
    const Catalogue catalogue = Catalogue::parse(text_, label_, CatalogueFormat::automatic);
    if (catalogue.format() != CatalogueFormat::list || !catalogue.has_galaxies() ||
        catalogue.rows() + 1 != lines_.size()) {
      throw form_error();
    }
    std::vector<Words> table(catalogue.rows() + 1);
    for (const Catalogue::Column& column : catalogue.columns()) {
      const auto* cells = std::get_if<std::vector<std::string_view>>(&column.cells);
      if (cells == nullptr) throw form_error();
      table.front().push_back(column.name);
      for (std::size_t row = 0; row < cells->size(); ++row) {
        table[row + 1].emplace_back((*cells)[row]);
      }
    }
    return table;
  }

  void check_row(int row) const {
    if (row >= 0 && row + 1 < static_cast<int>(table_.size())) return;
    throw error(fmt::format("there is no row {}; the scene has {}", row, table_.size() - 1));
  }

  void check_word(const std::string& word) const {
    const bool is_word = !word.empty() && word.size() <= most_word_bytes && word.front() != '#' &&
                         std::ranges::none_of(word, [](char c) {
                           const auto code = static_cast<unsigned char>(c);
                           return code <= ' ' || code == 0x7f || c == '"';
                         });
    if (!is_word) throw error(fmt::format("{} is no word of a list", in_quotes(word)));
  }

  /// A declared column, or a galaxy's parameter such as "arms.count", without a value in any row.
  void add_column(const std::string& name) {
    check_word(name);
    const bool is_declared = std::ranges::any_of(
        scene_columns(), [&](const Parameter& column) { return column.name == name; });
    if (!is_declared && name.find('.') == std::string::npos) {
      throw error(fmt::format("a scene has no column {}", in_quotes(name)));
    }
    for (std::size_t line = lines_.size(); line-- > 0;) {
      const std::string& word = line == 0 ? name : no_word;
      text_.insert(lines_[line].words.back().end, " " + word);
      table_[line].push_back(word);
    }
    read();
  }

  /// Replaces a word. Blanks before the next word give way, so that columns stay aligned.
  void put(std::size_t line, std::size_t column, const std::string& word) {
    const Line& text_line = lines_[line];
    const auto [begin, end] = text_line.words[column];
    const bool is_last = column + 1 == text_line.words.size();
    const std::size_t next = is_last ? end : text_line.words[column + 1].begin;
    const bool has_tab = text_.substr(end, next - end).find('\t') != std::string::npos;
    std::string cell = word;
    if (has_tab) {
      cell += text_.substr(end, next - end);
    } else if (!is_last) {
      cell.resize(std::max(next - begin, word.size() + 1), ' ');
    }
    text_.replace(begin, next - begin, cell);
    move_words(line, column, word.size(), cell.size() - (next - begin));
  }

  /// Updates the places of words after a word of `size` bytes was put and all that follows moved by
  /// `shift` bytes. A negative `shift` wraps.
  void move_words(std::size_t line, std::size_t column, std::size_t size, std::size_t shift) {
    Line& text_line = lines_[line];
    text_line.words[column].end = text_line.words[column].begin + size;
    text_line.end += shift;
    for (std::size_t i = column + 1; i < text_line.words.size(); ++i) {
      text_line.words[i].begin += shift;
      text_line.words[i].end += shift;
    }
    for (std::size_t i = line + 1; i < lines_.size(); ++i) {
      lines_[i].begin += shift;
      lines_[i].end += shift;
      for (Line::Word& word : lines_[i].words) {
        word.begin += shift;
        word.end += shift;
      }
    }
  }

  std::string text_;
  std::string label_;
  std::string line_end_;
  std::vector<Line> lines_;   ///< names of columns, then rows
  std::vector<Words> table_;  ///< words that the lines must have
};

}  // namespace

std::string edit_scene(std::string text, const std::vector<SceneEdit>& edits,
                       const std::string& label) {
  EditedScene edited(std::move(text), label);
  for (const SceneEdit& edit : edits) std::visit(edited, edit);
  edited.check();
  text = edited.take();
  if (text.size() > most_scene_bytes) throw InputError({label, 0, 0}, "the scene becomes too long");
  return text;
}

}  // namespace gamer
